"""kahanmaps orbit."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shutil import get_terminal_size
from typing import IO, TYPE_CHECKING, Any

import click

from kahanmaps_cli.options import eps_options, load_system, system_options, the_eps
from kahanmaps_cli.orbit_formats import Csv, JsonLines, Npz, OutputFull, Text, Writer
from kahanmaps_cli.params import Arithmetic, NameValue, PointText, Steps
from kahanmaps_cli.progress import Progress, say

if TYPE_CHECKING:
    from kahanmaps.algebra.polynomials import RationalFunction
    from kahanmaps.maps.orbits import OrbitEnd
    from kahanmaps.systems.files import SystemFile

_FORMATS = ("text", "jsonl", "csv", "npz")
_STATUS = {"completed": 0, "periodic": 0, "interrupted": 130}


@click.command("orbit")
@system_options
@click.option("--start", type=PointText(), required=True, metavar="X", help="The start: 1/2,-1/3,0.25")
@eps_options
@click.option("--steps", type=int, help="How many steps to take.")
@click.option("--at", type=Steps(), metavar="N1,N2,...", help="Only these iterates.")
@click.option("--every", type=int, default=1, show_default=True, help="Only every K-th iterate.")
@click.option("--backward", is_flag=True, help="Step by the inverse map, Phi(., -eps).")
@click.option(
    "--arithmetic",
    type=Arithmetic(),
    default="exact",
    show_default=True,
    help="exact, float, mod:P or ball:BITS.",
)
@click.option(
    "--integral",
    "integrals",
    type=NameValue(name_is_optional=True),
    multiple=True,
    metavar="[NAME=]EXPR",
    help="A column beside the point: an expression in the variables and eps, the name of an integral of the file, or "
    "the word known for all that theorems give.",
)
@click.option("--max-digits", type=int, help="Digit budget (exact arithmetic; default 200000).")
@click.option("--format", "form", type=click.Choice(_FORMATS), help="Default text, or what the name of FILE says.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), metavar="FILE", help="Write to FILE.")
@click.option("-q", "--quiet", is_flag=True, help="No progress and no talk on standard error.")
def command(system: str | None, form: str | None, output: str | None, quiet: bool, **options: Any) -> int:
    """Iterate the Kahan map of SYSTEM from a start.

    \b
      kahanmaps orbit pair.toml --start 1/2,-1/3,0,1,2/5,-1 --eps 1/10 --steps 20
      kahanmaps orbit lotka_volterra --start 1,2 --time-step 1/5 --steps 1000 --arithmetic float -o lv.npz
      kahanmaps orbit --vars x,y,z --rhs y*z --rhs=-2*z*x --rhs x*y --start 1,1/2,1/3 --eps 1/10 --steps 5
      kahanmaps orbit pair.toml --start 1,2,3,4,5,6 --eps 1/10 --at 1000 --arithmetic mod:2305843009213693951
      kahanmaps orbit pair.toml --start 1,2,3,4,5,6 --eps 1/10 --steps 5 --integral known --format jsonl

    SYSTEM is a file, a name of the catalogue, or - for standard input. A right-hand side that starts with - is written
    --rhs=-x. Numbers are exact: integers, p/q, decimals. Ctrl-C ends after the step in flight and leaves a valid file.

    Exit status: 0 done, 2 wrong use, 3 stopped early (singular point, digit budget, ...), 130 interrupted.
    """
    eps = the_eps(options["eps"], options["time_step"])
    steps, at, every = options["steps"], options["at"], options["every"]
    if (steps is None) == (at is None):
        raise click.UsageError("give --steps N or --at N1,N2,..., one of the two")
    if steps is not None and steps < 0:
        raise click.UsageError(f"found --steps {steps}, expected 0 or more (--backward steps by the inverse map)")
    if at is not None and every != 1:
        raise click.UsageError("give --at N1,N2,... or --every K, not both")
    if every < 1:
        raise click.UsageError(f"found --every {every}, expected at least 1")
    if options["max_digits"] is not None and options["max_digits"] < 1:
        raise click.UsageError(f"found --max-digits {options['max_digits']}, expected at least 1")
    from kahanmaps.maps.orbits import OrbitEnd

    file = load_system(system, options["variables"], options["rhs"], options["parameters"])
    run = _Run(file, eps, options)
    output = None if output == "-" else output
    form = form or _form_from_name(output)
    wanted = set(at) if at is not None else None
    hidden = quiet or (output is None and sys.stdout.isatty())  # the points themselves show the progress
    with _opened(output, form) as stream, _signals(run.interrupt), Progress(hidden) as progress:
        writer = _writer(form, stream, run, to_file=output is not None)
        writer.header(run.header())
        try:
            for step, texts, values in run.points(lambda k: k in wanted if wanted is not None else k % every == 0):
                progress(f"step {step} of {run.steps}")
                if texts is not None:
                    writer.point(step, texts, values)
            end = run.end
        except OutputFull as full:
            end = OrbitEnd("budget", full.steps, str(full))
        writer.end(_end_record(end))
    told = output is None and form == "text" and sys.stdout.isatty()  # the last line says how it ended
    if not quiet and not told and (output is not None or end.status not in _STATUS):
        where = f"{output}: " if output is not None else ""
        say(f"{where}{end.status}: {end.message}")
    return _STATUS.get(end.status, 3)


class _Run:
    """One orbit in the arithmetic that was asked for: its points as text, its integrals, its end."""

    def __init__(self, file: SystemFile, eps: Any, options: dict[str, Any]) -> None:
        from kahanmaps.algebra.fields import GF, QQ, RR
        from kahanmaps.maps.kahan import KahanMap
        from kahanmaps.maps.orbits import DEFAULT_MAX_DIGITS, Orbit

        self.file = file
        self.eps = eps
        self.steps = options["steps"] if options["steps"] is not None else max(options["at"])
        self.start = options["start"]
        self.backward = options["backward"]
        self.kind, number = options["arithmetic"]
        self.arithmetic = self.kind if self.kind in ("exact", "float") else f"{self.kind}:{number}"
        self.columns: list[tuple[str, Callable[[Sequence[Any]], str | None]]] = []
        self.orbit: Any
        if self.kind == "float":
            from kahanmaps.maps.fast import FloatOrbit

            self.orbit = FloatOrbit(file.system, eps, self.start, self.steps, backward=self.backward)
            self.storage = "float"
        else:
            field = QQ if self.kind == "exact" else GF(number) if self.kind == "mod" else RR(number)
            kahan = KahanMap(file.system, eps, field)
            budget = options["max_digits"] or DEFAULT_MAX_DIGITS
            self.orbit = Orbit(kahan, self.start, self.steps, backward=self.backward, max_digits=budget)
            self.storage = "int" if self.kind == "mod" and number < 2**63 else "text"
            self.field = field
        self._add_integrals(options["integrals"])
        names = ["step", *file.variables, *(name for name, _ in self.columns)]
        for name in names:
            if names.count(name) > 1:
                raise click.UsageError(f"found two columns of the name {name}: write --integral NAME=EXPR")

    def interrupt(self) -> None:
        self.orbit.interrupt()

    @property
    def end(self) -> OrbitEnd:
        end: OrbitEnd = self.orbit.end
        return end

    def header(self) -> dict[str, Any]:
        from kahanmaps.algebra.text import format_number, format_polynomial
        from kahanmaps.checks.settings import CONVENTION
        from kahanmaps.version import __version__

        return {
            "system": self.file.name,
            "variables": list(self.file.variables),
            "rhs": [format_polynomial(polynomial) for polynomial in self.file.system.rhs],
            "eps": format_number(self.eps),
            "time_step": format_number(2 * self.eps),
            "convention": CONVENTION,
            "arithmetic": self.arithmetic,
            "start": [format_number(entry) for entry in self.start],
            "direction": "backward" if self.backward else "forward",
            "steps": self.steps,
            "seed": None,
            "version": __version__,
        }

    def points(self, wanted: Callable[[int], bool]) -> Iterator[tuple[int, list[str] | None, list[str | None]]]:
        """Every step; coordinates and integrals as text for the wanted ones only, for making them costs time."""
        if self.kind == "float":
            for step, x in self.orbit:
                if wanted(step):
                    yield step, [repr(float(entry)) for entry in x], [value(x) for _, value in self.columns]
                else:
                    yield step, None, []
            return
        for point in self.orbit:
            if wanted(point.step):
                yield point.step, point.text, [value(point.x) for _, value in self.columns]
            else:
                yield point.step, None, []

    def _add_integrals(self, requests: Sequence[tuple[str, str]]) -> None:
        from kahanmaps.algebra.text import parse_rational_function

        for k, (name, text) in enumerate(requests, start=1):
            if text == "known" and not name:
                self._add_known()
                continue
            if text in self.file.integrals:
                name, function = name or text, self.file.integrals[text]
            else:
                name = name or (text if len(text) <= 30 else f"I{k}")
                function = parse_rational_function(text, (*self.file.variables, "eps"), self.file.parameters)
            self._add_function(name, function)

    def _add_known(self) -> None:
        from kahanmaps.checks.conserve import known_integrals
        from kahanmaps.errors import InputError

        known = [integral for integral, _, _ in known_integrals(self.file)]
        if not known and not self.file.integrals:
            raise InputError(f"--integral known: no integral of {self.file.name} is known or claimed")
        if known and self.kind == "float":
            raise InputError(
                "--integral known needs exact, mod:P or ball:BITS arithmetic; give an expression for float"
            )
        for integral in known:
            self.columns.append((integral.name, self._exact_column(integral)))
        for name, function in self.file.integrals.items():
            self._add_function(name, function)

    def _add_function(self, name: str, function: RationalFunction) -> None:
        from kahanmaps.invariants.integrals import ClaimedIntegral

        if self.kind == "float":
            from kahanmaps.maps.fast import float_function

            self.columns.append((name, _float_column(float_function(function), float(self.orbit.map.eps))))
        else:
            self.columns.append((name, self._exact_column(ClaimedIntegral(name, function))))

    def _exact_column(self, integral: Any) -> Callable[[Sequence[Any]], str | None]:
        from kahanmaps.errors import KahanmapsError

        def value(x: Sequence[Any]) -> str | None:
            try:
                found = integral.value(self.field, self.eps, x)
            except KahanmapsError:  # the integral is not defined where the map is not
                return None
            return None if found is None else self.field.format(found)

        return value


def _float_column(function: Callable[..., float | None], eps: float) -> Callable[[Sequence[Any]], str | None]:
    def value(x: Sequence[Any]) -> str | None:
        found = function([*map(float, x), eps])
        return None if found is None else repr(found)

    return value


def _end_record(end: OrbitEnd) -> dict[str, Any]:
    record: dict[str, Any] = {"status": end.status, "steps": end.steps, "message": end.message}
    if end.period is not None:
        record["period"] = end.period
    return record


def _writer(form: str, stream: IO[Any], run: _Run, to_file: bool) -> Writer:
    columns, integrals = run.file.variables, [name for name, _ in run.columns]
    if form == "jsonl":
        return JsonLines(stream, columns, integrals)
    if form == "csv":
        return Csv(stream, columns, integrals)
    if form == "npz":
        return Npz(stream, columns, integrals, run.storage)
    on_terminal = not to_file and sys.stdout.isatty()
    return Text(stream, columns, integrals, get_terminal_size().columns if on_terminal else None)


def _form_from_name(output: str | None) -> str:
    suffix = Path(output).suffix[1:] if output is not None else ""
    return suffix if suffix in _FORMATS else "text"


@contextmanager
def _opened(output: str | None, form: str) -> Iterator[IO[Any]]:
    if output is not None:
        binary = form == "npz"
        encoding, errors = (None, None) if binary else ("utf-8", "backslashreplace")
        try:
            with open(output, "wb" if binary else "w", encoding=encoding, errors=errors) as stream:
                yield stream
        except OSError as error:  # a full disk comes without a name
            error.filename = error.filename or output
            raise
    elif form != "npz":
        yield sys.stdout
    elif sys.stdout.isatty():
        raise click.UsageError("npz is not for a terminal: add -o FILE")
    else:
        import io

        buffer = io.BytesIO()  # a zip archive needs a stream that can seek
        yield buffer
        sys.stdout.buffer.write(buffer.getvalue())


@contextmanager
def _signals(interrupt: Callable[[], None]) -> Iterator[None]:
    """The first Ctrl-C or SIGTERM ends the orbit after the step in flight, the second one at once."""

    def handler(signum: int, frame: Any) -> None:
        signal.signal(signum, signal.default_int_handler)
        interrupt()

    previous = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in previous.items():
            signal.signal(number, action)
