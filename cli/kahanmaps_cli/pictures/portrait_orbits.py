"""The orbits of a portrait, wherever they come from: walked now, or read from a file."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from kahanmaps.errors import counted
from kahanmaps_cli import library as lib

if TYPE_CHECKING:
    from kahanmaps.maps.orbits.stored import Stored

_PILOT = 4_000_000  # coordinates, from which the axes and the window of a density are chosen

Told = Callable[[str], None]


def _field_of(file: lib.SystemFile) -> lib.QuadraticSystem | None:
    """The vector field whose Kahan map it is, a rational number in the place of an algebraic one; else None."""
    map_ = file.map.rounded
    return map_.system if isinstance(map_, lib.Kahan) and not map_.system.symbols else None


@dataclass(eq=False)
class Orbits:
    """Either `stored` or (`ensemble`, `steps`); `notes` are for standard error, `ended` counts by reason."""

    name: str
    variables: tuple[str, ...]
    file: lib.SystemFile | None
    eps: Any
    starts: lib.FloatArray
    stored: Stored | None = None
    ensemble: Any = None
    form: Any = None
    steps: int = 0
    backward: bool = False
    chosen: bool = False
    notes: list[str] = field(default_factory=list)
    ended: dict[str, int] = field(default_factory=dict)
    walked: int | None = None

    @classmethod
    def of_file(cls, stored: Stored, file: lib.SystemFile | None, eps: Any, name: str) -> Orbits:
        """Orbits of a file."""
        import numpy as np

        starts = np.asarray(stored.points[0], dtype=np.float64)
        return cls(name, stored.variables, file, eps, starts, stored=stored, ended=stored.ended)

    @classmethod
    def to_walk(
        cls, file: lib.SystemFile, eps: Any, starts: Any, steps: int, *, backward: bool, axes: str | None
    ) -> Orbits:
        """Orbits that are to be walked, from `starts` or where those are None from chosen ones."""

        from kahanmaps_cli.runs.ensemble_run import normal_form_for

        chosen = starts is None
        if chosen:
            named = [text.strip() for text in (axes or "").split(",")]
            plane = [file.variables.index(text) for text in named if text in file.variables]
            plane = [*plane, *(k for k in range(file.dim) if k not in plane)][:2]
            field = _field_of(file)
            if field is None:
                raise lib.InputError(
                    f"found no starts for {file.map.kind}, expected --start X, --starts FILE or --random N: they are "
                    "chosen around the fixed points of a vector field only"
                )
            starts = lib.automatic_starts(field, eps, plane, backward=backward)
        normal_form = normal_form_for(file, None)
        form = None if isinstance(normal_form, lib.NoNormalForm) else normal_form.form
        ensemble = lib.ensemble_for(
            file.map, lib.fmpq(1) if eps is None else eps, starts, steps, backward=backward, form=form
        )
        return cls(
            file.label,
            file.variables,
            file,
            eps,
            starts,
            ensemble=ensemble,
            form=form,
            steps=steps,
            backward=backward,
            chosen=chosen,
        )

    @property
    def counts_records(self) -> bool:
        """Whether the numbers of the steps are not known, only their order."""
        return self.stored is not None and not self.stored.header

    def function(self, text: str) -> lib.PointFunction:
        """An integral of the system's file or H by its name, or an expression."""
        named = {name: known.function for name, known in self._known().items() if isinstance(known, lib.PointFunction)}
        parameters = {} if self.file is None else self.file.rounded.parameters
        return lib.point_function(text.strip(), self.variables, self.eps, parameters, named)

    def colouring(self, text: str) -> lib.WatchedFunction:
        """The same, and integrals that theorems give, in which the image of the point occurs."""
        known = self._known().get(text.strip())
        return self.function(text) if known is None else known

    def _known(self) -> Mapping[str, lib.WatchedFunction]:

        if self.file is None:
            return {}
        return lib.functions_of(self.file.rounded, lib.fmpq(0) if self.eps is None else self.eps)

    def walk(self, progress: Told) -> lib.Trajectories:
        """All points."""
        import numpy as np

        if self.stored is not None:
            points = self.stored.points
            lib.require_points(*points.shape)
            found = lib.Trajectories(self.variables, np.array(points, dtype=np.float64), self.stored.steps, self.ended)
        else:
            found = lib.walked(self.ensemble, self.steps, lambda step: progress(f"step {step} of {self.steps}"))
            self.ended = found.ended
        self._points = found.points
        self.walked = len(found.points) - 1
        return found

    def pilot(self) -> lib.FloatArray:
        """Some points of a long walk, (points, dim): its beginning, or records all over a file."""
        import numpy as np

        if self.stored is not None:
            points = self.stored.points
            rows = np.linspace(0, len(points) - 1, max(1, min(len(points), _PILOT // points[0].size)))
            self._points = np.asarray(points[rows.astype(int)], dtype=np.float64)
        else:
            steps = max(1, min(self.steps, _PILOT // self.starts.size))
            system = self.ensemble.system
            ensemble = lib.ensemble_for(system, self.eps, self.starts, steps, backward=self.backward, form=self.form)
            self._points = np.concatenate(list(ensemble.records(steps, 1)))
        flat: lib.FloatArray = self._points.reshape(-1, len(self.variables))
        return flat

    def axes_from(
        self, text: str | None, count: int, points: lib.FloatArray | None = None
    ) -> tuple[lib.PointFunction | str, ...]:
        """The axes that were asked for, or the `count` variables whose points fill most (said in the notes)."""
        if text is not None:
            pieces = [piece.strip() for piece in text.split(",")]
            if len(pieces) not in (2, 3) or not all(pieces):
                raise lib.InputError(f"found --axes {text[:60]}, expected two or three: x,y or x,y,z")
            if len(set(pieces)) < len(pieces):
                raise lib.InputError(f"found --axes {text[:60]}, expected different ones")
            return tuple(
                "step" if piece == "step" and "step" not in self.variables else self.function(piece) for piece in pieces
            )
        dim = len(self.variables)
        if dim < count and not (dim == 1 and count == 2):
            raise lib.InputError(f"found {dim} variables, expected at least {count} for that many axes")
        if dim == 1:
            return "step", self.function(self.variables[0])
        flat = self._points.reshape(-1, dim) if points is None else points
        chosen = [self.variables[k] for k in lib.fullest_axes(flat, count)]
        if dim > count:
            self.notes.append(f"axes {', '.join(chosen)}: their points fill most of the picture (--axes chooses)")
        return tuple(self.function(name) for name in chosen)

    def euler(self) -> lib.Trajectories:
        """Explicit Euler from the same starts."""
        assert self.file is not None
        system = _field_of(self.file) or self.file.system  # which says why there is none
        found = lib.euler_orbits(system, -self.eps if self.backward else self.eps, self.starts, self.steps)
        for reason, count in found.ended.items():
            self.notes.append(f"explicit Euler: {counted(count, 'orbit')} {reason}")
        return found

    def count(
        self, axes: Sequence[lib.PointFunction], window: lib.Window, shape: tuple[int, int], progress: Told
    ) -> lib.Density:
        """The points of all orbits counted in cells."""
        began = time.monotonic()

        def told(points: int) -> None:
            rate = points / max(1e-9, time.monotonic() - began)
            progress(f"{points:.3g} of {total:.3g} points, {rate:.2g} a second")

        if self.stored is not None:
            portions, total = (
                lib.portions_of(self.stored.points),
                self.stored.points.shape[0] * self.stored.points.shape[1],
            )
        else:
            portions, total = self.ensemble.records(self.steps, 1), self.ensemble.n * (self.steps + 1)
        found = lib.density_of(portions, axes, window, shape, told)
        if self.stored is not None:
            self.walked = len(self.stored.points) - 1
        else:
            self.ended = lib.ended_early(self.ensemble)
            self.walked = self.ensemble.step
        return found

    def flow(
        self, axes: Sequence[lib.PointFunction | str], window: lib.Window, options: Mapping[str, Any]
    ) -> lib.Flow | None:
        """What is drawn of the differential equation; None where the map has none or it is not wanted."""
        from dataclasses import replace

        import numpy as np

        system = None if self.file is None else _field_of(self.file)
        if system is None:
            if options["flow"]:
                raise lib.InputError("--flow draws solutions of x' = f(x): name a system with a quadratic field")
            return None
        functions = [axis for axis in axes if not isinstance(axis, str)]
        variables = [axis.variable for axis in functions if axis.variable is not None]
        in_plane = len(axes) == 2 and not options["no_field"]
        found = lib.plane_flow(system, variables if in_plane else [], window)
        if options["levels"] or options["euler"]:  # arrows among many grey lines tell nothing
            found = replace(found, places=found.places[:0], arrows=found.arrows[:0])
        if options["flow"]:
            if len(functions) < len(axes):
                raise lib.InputError("--flow draws curves in phase space: it does not go with the axis step")
            box = lib.window_of(self._points.reshape(-1, len(self.variables)), self.starts)
            time = float(lib.time_step(self.eps) * self.steps) * (-1 if self.backward else 1) if self.steps else None
            curves = lib.solutions(system, self.starts, box, time)
            found = replace(found, solutions=tuple(np.stack([axis(x) for axis in functions], axis=-1) for x in curves))
        return found

    def note_outside(self, left_out: int, count: int) -> None:
        """Say that points lie outside the window."""
        if left_out:
            self.notes.append(f"{left_out} of {count} points lie outside the window (--window)")

    def told(self) -> Iterator[str]:
        """What is drawn, and what became of it."""
        orbits = counted(len(self.starts), "orbit")
        eps = "" if self.eps is None else lib.eps_told(self.eps, *([] if self.file is None else [self.file.map]))
        if self.stored is not None:
            yield f"{self.name}: {orbits} of {counted(len(self.stored.points), 'point')}{eps}"
        else:
            backward = ", backward" if self.backward else ""
            chosen = " from chosen starts" if self.chosen else ""
            yield f"{self.name}: {orbits}{chosen}, {counted(self.walked or 0, 'step')}{backward}{eps}"
        for reason, count in self.ended.items():
            yield f"{count} of {orbits} ended early: {reason}"
