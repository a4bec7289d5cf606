"""One orbit in the arithmetic and by the method that were asked for: its points as text, its integrals, its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli.options import asked_integral

Column = tuple[str, Callable[[Sequence[Any]], str | None]]
Point = tuple[int, "list[str] | None", "list[str | None]"]


class OrbitRun:
    """An orbit, or some iterates of it, of the map of a system file, as points and columns of text.

    `steps` is the last step.
    """

    def __init__(self, file: lib.SystemFile, eps: Any, options: dict[str, Any]) -> None:
        self.file = file
        self.eps = eps
        self.steps: int = options["steps"] if options["at"] is None else max(options["at"])
        self.start = options["start"]
        self.backward = options["backward"]
        self.columns: list[Column] = []
        self.walk = lib.orbit(
            file.map,
            self.start,
            eps,
            steps=options["steps"],
            hamiltonian=file.hamiltonian,
            member=file.member,
            **{
                name: options[name]
                for name in (
                    *("at", "arithmetic", "method", "backward", "every", "max_digits", "kernel"),
                    *("accuracy", "progress"),
                )
            },
        )
        self.kind = self.walk.arithmetic.kind
        self._add_integrals(options["integrals"])
        names = ["step", *file.variables, *(name for name, _ in self.columns)]
        for name in names:
            if names.count(name) > 1:
                raise click.UsageError(f"found two columns of the name {name}: write --integral NAME=EXPR")

    @property
    def storage(self) -> str:
        """What an npz file holds: "float", "int" or "text"."""
        if self.kind == "float":
            return "float"
        return "int" if self.kind == "mod" and self.walk.arithmetic.number < 2**63 else "text"

    def header(self) -> dict[str, Any]:
        """What a result can be redone from."""
        header = {
            "system": self.file.name,
            "variables": list(self.file.variables),
            **self.file.map.written(),
            "eps": None if self.eps is None else lib.format_number(self.eps),
            "time_step": lib.format_number(2 * self.eps) if self.file.map.has_time_step else None,
            "convention": lib.convention(self.file.map),
            "arithmetic": str(self.walk.arithmetic),
            "method": self.walk.method,
            "start": [lib.format_number(entry) for entry in self.start],
            "direction": "backward" if self.backward else "forward",
            "steps": self.steps,
            "seed": None,
            "version": lib.__version__,
        }
        if self.kind == "float":
            header["kernel"] = self.walk.orbit.kernel
        return header

    def points(self) -> Iterator[Point]:
        """Every step that is computed; coordinates and integrals as text for the wanted ones only: they cost time."""
        for point in self.walk:
            if self.walk.wanted(point.step):
                yield point.step, point.text, [value(point.x) for _, value in self.columns]
            else:
                yield point.step, None, []

    def _add_integrals(self, requests: Sequence[tuple[str, str]]) -> None:
        for k, (name, text) in enumerate(requests, start=1):
            if text == "known" and not name:
                self._add_known()
            else:
                self._add_function(*asked_integral(self.file, name, text, f"I{k}"))

    def _add_known(self) -> None:
        known = [integral for integral, _, _ in lib.known_integrals(self.file)]
        if not known and not self.file.integrals:
            raise lib.InputError(f"--integral known: no integral of {self.file.name} is known or claimed")
        if known and self.kind == "float":
            raise lib.InputError(
                "--integral known needs exact, mod:P or ball:BITS arithmetic; give an expression for float"
            )
        for integral in known:
            self.columns.append((integral.name, self._exact_column(integral)))
        for name, function in self.file.integrals.items():
            self._add_function(name, function)

    def _add_function(self, name: str, function: lib.RationalFunction) -> None:
        if self.kind == "float":
            root = self.file.map.root
            values = [] if root is None else [lib.to_float(root.rounded())]
            # eps itself, also where the orbit steps by -eps: integrals are those of the map.
            self.columns.append((name, _float_column(lib.float_function(function), [*values, lib.to_float(self.eps)])))
        else:
            self.columns.append(
                (name, self._exact_column(lib.ClaimedIntegral(name, function, root=self.file.map.root)))
            )

    def _exact_column(self, integral: Any) -> Callable[[Sequence[Any]], str | None]:
        field, root = self.walk.arithmetic.field, self.file.map.root
        if root is not None and self.kind == "exact":
            field = root.number_field

        def value(x: Sequence[Any]) -> str | None:
            try:
                found = integral.value(field, self.eps, x)
            except lib.KahanmapsError:  # the integral is not defined where the map is not
                return None
            return None if found is None else field.format(found)

        return value


def _float_column(function: Callable[..., float | None], others: list[float]) -> Callable[[Sequence[Any]], str | None]:
    def value(x: Sequence[Any]) -> str | None:
        found = function([*map(float, x), *others])
        return None if found is None else repr(found)

    return value
