"""Orbits of any map in any arithmetic: `orbit` chooses the method, `Trajectory` is its result."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import cached_property
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple, overload

from flint import arb, fmpq

from kahanmaps.algebra.etale import EtaleElement
from kahanmaps.algebra.fields import GF, MAX_BALL_BITS, Field, integer, rational
from kahanmaps.algebra.printing import json_float
from kahanmaps.atomic_files import open_append
from kahanmaps.display_protocols import HtmlDisplay, data_frame
from kahanmaps.errors import BadPrime, InexactNumber, InputError, KahanmapsError
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.maps.convention import either, eps_record, resolve_eps
from kahanmaps.maps.convention import time_step as time_step_at
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.kahan import KahanFamily, SystemLike, as_map
from kahanmaps.maps.kernels import choose_kernel
from kahanmaps.maps.orbits.arithmetic import Arithmetic
from kahanmaps.maps.orbits.iteration import (
    DEFAULT_MAX_DIGITS,
    Orbit,
    OrbitEnd,
    OrbitPoint,
    require_short,
    require_steps,
)
from kahanmaps.maps.orbits.methods import DOUBLING_FROM, MethodChoice, choose_method
from kahanmaps.maps.orbits.writers import FORMATS, OutputFull, Writer, form_of, writer_to
from kahanmaps.maps.values import as_point, is_float_value
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.version import __version__

if TYPE_CHECKING:
    from kahanmaps.family.associated import FamilyMember

_MAX_SINGLE_STEPS = 10**13  # more single steps would take years
# Up to these numbers of steps, no normal form is searched for: an exact search takes longer than it saves. A normal
# form also makes the points more accurate in floating point and with balls.
_MAX_STEPS_WITHOUT_SEARCH = {"exact": 20, "float": 3, "ball": 3, "mod": DOUBLING_FROM["mod"] - 1}
_LONG_INPUT_BITS = 4000  # if eps or the initial point has more bits, no normal form is searched for up to 24 steps
_MAX_SEARCH_DIMENSION = 16  # largest dimension in which a normal form is searched for
_FALLBACK_BITS = 4096  # precision of the balls if no precision that was tried suffices
_BITS_PER_DIGIT = 3.3219281


def orbit(
    system: SystemLike | Map,
    start: Any = None,
    eps: Any = None,
    steps: int | None = None,
    *,
    x0: Any = None,
    time_step: Any = None,
    h: Any = None,
    n: int | None = None,
    at: Sequence[int] | None = None,
    arithmetic: str | Arithmetic | Field | type[float] = "exact",
    exact: bool | None = None,
    method: str | None = None,
    backward: bool = False,
    every: int = 1,
    max_digits: int | None = None,
    hamiltonian: CubicHamiltonian | None = None,
    member: FamilyMember | None = None,
    normal_form: SystemNormalForm | NoNormalForm | None = None,
    kernel: str | None = None,
    accuracy: int = 15,
    progress: Callable[[str], None] | None = None,
) -> Trajectory:
    """Return the orbit of an initial point, or some of its iterates, as a lazy sequence of points.

    Args:
        system: the map; a quadratic system stands for its Kahan map. A map at a fixed eps, such as phi @ psi, is
            iterated over its own field.
        start, x0: the initial point: exact numbers, a dict by variable, or text "1/2,-1/3"; or floats for float orbits.
        eps: an exact number, for Kahan maps half the time step; None for a map that does not depend on eps. For float
            orbits, a float stands for the decimal number that Python prints.
        time_step, h: the time step 2 eps, instead of eps.
        steps, n: the number of steps; instead of it, `at` may be given.
        at: the requested iterates.
        arithmetic: "exact", "float", "mod:P", "ball:BITS" or "ball:auto"; or QQ, GF(p), RR(bits), CC(bits), a number
            field.
        exact: True for "exact", False for "float", instead of `arithmetic`.
        method: "generic", "normal-form" or "doubling"; by default chosen automatically.
        backward: whether steps are taken by the inverse map.
        every: only the points whose step is a multiple of this number are yielded.
        max_digits: the budget of decimal digits in exact arithmetic (default 200,000).
        hamiltonian, member: the Hamiltonian of a quadratic system, or its structure as a member of the family, if
            known, so that the normal form need not be searched for.
        normal_form: the normal form, or the reason why there is none; by default it is computed if this saves time.
        kernel: "numpy" or "numba", for float orbits.
        accuracy: the number of correct decimal digits, for "ball:auto".
        progress: a function that is called with a message for each precision that "ball:auto" tries.

    Returns:
        The trajectory: points are computed as they are read, and are exact, enclosed or rounded according to the
        arithmetic. Read `end` afterwards; `method` is the method, and `why` the reason for its choice.

    Raises:
        InputError: for invalid values, and for combinations of map, method and arithmetic that are not available.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> riccati = QuadraticSystem.from_text(["x"], ["x^2"])
    >>> [point.text for point in orbit(riccati, ["1/5"], "1/2", steps=3)]
    [['1/5'], ['1/4'], ['1/3'], ['1/2']]
    >>> [point.text for point in orbit(riccati, ["1/5"], "1/2", steps=3, arithmetic="mod:7")]
    [['3'], ['2'], ['5'], ['4']]
    """
    if exact is not None:
        if arithmetic != "exact":
            raise InputError(f"found exact = {exact} and arithmetic = {arithmetic!r}, expected one of them")
        arithmetic = "exact" if exact else "float"
    start, steps = either(start=start, x0=x0), either(steps=steps, n=n)
    is_float = Arithmetic.of(arithmetic).kind == "float"
    if start is None:
        raise InputError("found the initial point None, expected x0=[...], a sequence of exact numbers")
    system = system if isinstance(system, Map) else as_map(system)
    start = as_point(start, system.variables)
    if not is_float:
        for x in filter(is_float_value, (*start, eps, time_step, h)):
            try:
                rational(x)
            except InexactNumber as error:
                raise InexactNumber(f"{error}; or exact=False, for an orbit in floating point") from None
    eps = resolve_eps(eps, time_step, h, floats=is_float)
    if (steps is None) == (at is None):
        raise InputError("expected either steps=, the number of steps, or at=, the requested iterates")
    require_steps(steps)
    if integer(every, "every") < 1:
        raise InputError(f"found every = {every!r}, expected a positive integer")
    field, arithmetic = arithmetic, Arithmetic.of(arithmetic)
    if is_float:  # an initial point in floats is accepted, and converted exactly
        start = [float(x) if hasattr(x, "dtype") and x.dtype.kind == "f" else x for x in start]
        for x in start:
            if isinstance(x, float) and not math.isfinite(x):
                raise InputError(f"found {x} in the initial point, expected finite numbers")
        start = [fmpq(*x.as_integer_ratio()) if isinstance(x, float) else x for x in start]
    if not isinstance(at, Iterable | None):
        raise InputError(f"found at = {at!r}, expected a sequence of steps, at=[{at}]")
    if kernel is not None:
        choose_kernel(kernel, is_long=False)
    requested_steps = None if at is None else frozenset(integer(step, "a step of at") for step in at)
    last_step = max(requested_steps, default=0) if requested_steps is not None else (steps or 0)
    require_steps(last_step)
    request = OrbitRequest(
        system,
        start,
        eps,
        last_step,
        requested_steps,
        every,
        backward,
        DEFAULT_MAX_DIGITS if max_digits is None else max_digits,
        kernel,
    )
    if isinstance(system, Map):
        return _orbit_at_one_eps(request, field)
    map_ = system
    if eps is None and map_.has_eps:
        raise InputError('found no eps, expected an exact number, eps="1/10" or h="1/5": the map depends on eps')
    if isinstance(field, Field) and field != arithmetic.field:  # the field is a number field or complex balls
        if at is not None or method not in (None, "generic"):
            raise InputError(f"orbits over {field} are computed step by step: give steps=, without at= and method=")
        phi = map_.at(1 if eps is None else eps, field)
        return _orbit_at_one_eps(request._replace(map=phi, eps=None), field)
    request = request._replace(map=map_, eps=fmpq(1) if eps is None else rational(eps))
    if arithmetic.kind == "exact":
        numbers = [entry for entry in start if not isinstance(entry, EtaleElement)]
        require_short(request.eps, [rational(entry) for entry in numbers], max_digits)
    if normal_form is None:
        normal_form = _find_normal_form(request, method, arithmetic, hamiltonian, member)
    choice = choose_method(method, arithmetic.kind, normal_form, at)
    if choice.name != "doubling" and last_step > _MAX_SINGLE_STEPS:
        raise InputError(
            f"step {last_step} is too large for single steps (at most {_MAX_SINGLE_STEPS:.0e}), "
            f"and no other method is available: {choice.reason}"
        )
    form = normal_form if choice.name != "generic" and isinstance(normal_form, SystemNormalForm) else None
    remark = ""
    if arithmetic == Arithmetic("ball"):
        try:
            bits = bits_for(
                lambda bits: request.points_by(choice.name, form, Arithmetic("ball", bits)), accuracy, progress
            )
        except NotAccurate as error:
            bits, remark = _FALLBACK_BITS, str(error)
        arithmetic = Arithmetic("ball", bits)
    return Trajectory(request.points_by(choice.name, form, arithmetic), request, arithmetic, choice, remark)


class OrbitRequest(NamedTuple):
    """The arguments of an orbit and the requested points; `steps` is the last step."""

    map: Any
    start: Sequence[Any]
    eps: Any
    steps: int
    at: frozenset[int] | None
    every: int
    backward: bool
    max_digits: int
    kernel: str | None

    def is_requested(self, step: int) -> bool:
        """Return whether the point of this step is requested."""
        return step in self.at if self.at is not None else step % self.every == 0

    def points_by(self, method: str, normal_form: SystemNormalForm | None, arithmetic: Arithmetic) -> Any:
        """Return an iterator over the points, computed by a method in an arithmetic."""
        if arithmetic.kind == "float":
            from kahanmaps.maps.floats.float_orbit import FloatOrbit

            every = self.every if self.at is None else max(1, math.gcd(*self.at))
            form = None if normal_form is None else normal_form.form
            arguments = (self.map.real_approximation, self.eps, self.start, self.steps)
            return FloatOrbit(*arguments, backward=self.backward, form=form, kernel=self.kernel, every=every)
        map_at_eps = self.map.at(self.eps, arithmetic.field)
        limits: dict[str, Any] = {"backward": self.backward, "max_digits": self.max_digits}
        if method == "doubling" and normal_form is not None:
            return Orbit(map_at_eps, self.start, at=self.at or (), normal_form=normal_form, **limits)
        form_of_steps = normal_form if method == "normal-form" else None
        is_requested = self.is_requested if self.at is not None or self.every > 1 else None
        return Orbit(map_at_eps, self.start, self.steps, normal_form=form_of_steps, is_requested=is_requested, **limits)


class Trajectory(HtmlDisplay):
    """The result of `orbit`: points in the given `arithmetic`, computed by `method`; `why` is the reason for `method`.

    Iteration stores no points; for length, indexing, tables and arrays all points are computed and stored. `integrals`
    are functions of x and eps (PhaseFunction) by name, whose values are added to tables and files.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> result = orbit(QuadraticSystem.from_text(["x"], ["x^2"]), ["1/5"], "1/2", steps=3)
    >>> len(result), result[-1].x, result.rows()[0]
    (4, (1/2,), {'step': 0, 'x': '1/5'})
    """

    def __init__(
        self, orbit: Any, request: OrbitRequest, arithmetic: Arithmetic, method: MethodChoice, remark: str = ""
    ) -> None:
        self.orbit = orbit
        self.arithmetic = arithmetic
        self.method, self._why = method.name, method.text
        self.variables: tuple[str, ...] = request.map.variables
        self.integrals: Mapping[str, Any] = {}
        self._request, self._remark = request, remark

    def __repr__(self) -> str:
        return f"Trajectory({', '.join(self.variables)}; {self.arithmetic}, {self.method})"

    @property
    def why(self) -> str:
        """The reason for the choice of the method; for long orbits over Q also the relations between points in use."""
        relations = getattr(self.orbit, "relations", None)
        return self._why if relations is None else f"{self._why}; {relations}"

    def interrupt(self) -> None:
        """Stop a running orbit after the current step (safe to call from a signal handler)."""
        self.orbit.interrupt()

    @property
    def end(self) -> OrbitEnd:
        """How the orbit ended; reading it computes and stores the remaining points."""
        if self.orbit.end is None:
            _ = self.points
        end: OrbitEnd = self.orbit.end
        return OrbitEnd("precision", end.steps, self._remark) if self._remark and end.is_complete else end

    @cached_property
    def points(self) -> list[OrbitPoint]:
        """All requested points."""
        return [point for point in self._compute_points() if self._request.is_requested(point.step)]

    def preview(self, count: int) -> list[OrbitPoint]:
        """Return the first `count` points if they are stored or every step is requested, otherwise an empty list."""
        if "points" in self.__dict__ or (self._request.at is None and self._request.every == 1):
            return list(islice(self, count))
        return []

    def __len__(self) -> int:
        return len(self.points)

    @overload
    def __getitem__(self, index: int) -> OrbitPoint: ...
    @overload
    def __getitem__(self, index: slice) -> OrbitPoints: ...
    @overload
    def __getitem__(self, index: str) -> Any: ...
    def __getitem__(self, index: int | slice | str) -> Any:
        """Return a point (by index), a list of points (by slice), or the array of values of a variable (by name)."""
        if isinstance(index, slice):
            return OrbitPoints(self, index)
        if not isinstance(index, str):
            return self.points[index]
        if index not in self.variables:
            raise UnknownVariable(f"found the variable {index!r}, expected one of {', '.join(self.variables)}")
        return self.x[:, self.variables.index(index)]

    @property
    def x(self) -> Any:
        """The coordinates as an array of shape (points, dim): floats, ints for residues, otherwise exact objects."""
        return self.to_numpy(None if self.arithmetic.kind in ("float", "mod") else object)

    @property
    def t(self) -> Any:
        """The times of the points as an array, exact for exact orbits; the steps if the map has no time step."""
        import numpy as np

        steps = [-point.step if self._request.backward else point.step for point in self.points]
        map_, eps = self._request.map, self._request.eps
        h = map_.time_step if isinstance(map_, Map) else time_step_at(eps, map_)
        if h is None:
            return np.array(steps)
        if self.arithmetic.kind == "float":
            return np.array(steps) * (int(h.p) / int(h.q))
        return np.array([step * h for step in steps], dtype=object)

    @property
    def shape(self) -> tuple[int, int]:
        """The number of points and the number of coordinates."""
        return len(self), len(self.variables)

    def to_numpy(self, dtype: Any = None) -> Any:
        """Return the coordinates as an array of shape (points, dim), like `numpy.asarray(orbit, dtype)`."""
        return self.__array__(dtype)

    def to_xarray(self) -> Any:
        """Return the coordinates as an xarray.Dataset of floats along `step`. Raises InputError without xarray."""
        try:
            xarray: Any = import_module("xarray")
        except ImportError as error:
            raise InputError(f"to_xarray needs xarray ({error}): pip install xarray, or take to_pandas()") from error
        table, steps = self.to_numpy(), [point.step for point in self.points]
        times = [float(time) for time in self.t]
        data = {name: ("step", table[:, k]) for k, name in enumerate(self.variables)}
        return xarray.Dataset(data, coords={"step": steps, "t": ("step", times)})

    def plot(self, *arguments: Any, **options: Any) -> Any:
        """Draw two of the coordinates, by default x = 0 and y = 1, and return the axes."""
        return import_module("kahanmaps.plots.plot").plot.orbit(self, *arguments, **options)

    def rows(self) -> list[dict[str, Any]]:
        """Return one row for each point: its step, its coordinates and the values of the integrals (None at poles).

        Floats and residues are numbers, all other values are exact text.
        """
        kind = {"float": float, "mod": int}.get(self.arithmetic.kind, str)
        names = (*self.variables, *self.integrals)
        rows = []
        for point in self.points:
            numbers = [text and kind(text) for text in (*point.text, *self.values(point))]
            rows.append({"step": point.step, **dict(zip(names, numbers, strict=True))})
        return rows

    def values(self, point: OrbitPoint) -> list[str | None]:
        """Return the values of the integrals at a point, as text; None for an integral that is not defined there."""
        values: list[str | None] = []
        for function in self.integrals.values():
            try:  # at eps also for a backward orbit: the integrals belong to the map, not to its inverse
                value = function.value(point.field, self._request.eps, point.x)
            except (KahanmapsError, ArithmeticError):  # undefined at the point, or too large for floats
                value = None
            is_defined = value is not None and not (isinstance(value, float) and not math.isfinite(value))
            values.append(point.field.format(value) if is_defined else None)
        return values

    def to_pandas(self) -> Any:
        """Return `rows()` as a pandas DataFrame. Raises InputError if pandas is not installed."""
        return data_frame(self.rows())

    def save(self, path: str | Path) -> OrbitEnd:
        """Write the orbit to a file in the format given by its suffix, like `write`."""
        return self.write(path)

    def to_csv(self, path: str | Path) -> None:
        """Write step and coordinates of the points to a .csv file, without a metadata file."""
        with open_append(path) as stream:
            self.write(stream, "csv")

    def write(
        self,
        to: str | Path | IO[str] | Writer,
        form: str = "",
        name: str = "",
        on_step: Callable[[int], None] = lambda _: None,
    ) -> OrbitEnd:
        """Write the requested points as they are computed, like the command `kahanmaps orbit`.

        Args:
            to: a path, a stream of text, or a writer. For csv, a file with the metadata is written next to the path.
            form: "text", "json", "jsonl", "csv", "npz", "parquet", or (float orbits without integrals) "npy"; by
                default the format given by the suffix of the path, and text for a stream.
            name: the name of the system.
            on_step: a function that is called with the number of every step computed.

        Returns:
            How the orbit ended, as written to the file; "budget" if an npz file cannot hold more points.

        Raises:
            InputError: for unknown formats, and if npy cannot hold the requested data.
        """
        if not form:
            form = form_of(to) if isinstance(to, str | Path) else "text"
        if form not in FORMATS:
            raise InputError(f"found the format {form!r}, expected {', '.join(FORMATS)}")
        if form == "npy":
            from kahanmaps.maps.floats.float_orbit import stream_orbit

            if not isinstance(to, str | Path):
                raise InputError("the format npy needs a path, got a stream")
            if self.arithmetic.kind != "float":
                raise InputError("npy is for float orbits: use npz, or jsonl, which holds numbers of any length")
            if self._request.at is not None or self.integrals:
                raise InputError("npy holds the points of steps= and every=: for at= or integrals use npz")
            return self._end_with_float_data(stream_orbit(self.orbit, to, progress=on_step))[0]
        columns = (self.variables, list(self.integrals))
        with nullcontext(to) if isinstance(to, Writer) else writer_to(to, form, *columns) as writer:
            writer.header(self.header(name))
            try:
                if self.arithmetic.kind == "float" and self._request.at is None and not self.integrals:
                    count, every = 0, self._request.every
                    for step, points in self.orbit.portions():
                        writer.portion(count * every, every, points)
                        count += len(points)
                        on_step(step)
                else:
                    for point in self._all_points():
                        on_step(point.step)
                        if self._request.is_requested(point.step):
                            writer.point(point.step, point.text, self.values(point))
                end = self.end
            except OutputFull as error:
                end = OrbitEnd("budget", error.steps, str(error))
            end, float_data = self._end_with_float_data(end)
            writer.end(end, float_data)
        return end

    def header(self, name: str = "") -> dict[str, Any]:
        """Return the data from which the orbit can be reproduced; `name` is the name of the system."""
        request = self._request
        header = {
            "system": name,
            "variables": list(self.variables),
            **request.map.to_record(),
            **({} if isinstance(request.map, Map) else eps_record(request.eps, request.map)),
            "arithmetic": str(self.arithmetic),
            "method": self.method,
            "start": [str(entry) for entry in request.start],
            "direction": "backward" if request.backward else "forward",
            "steps": request.steps,
            "seed": None,
            "version": __version__,
        }
        return {**header, "kernel": self.orbit.kernel} if self.arithmetic.kind == "float" else header

    def _end_with_float_data(self, end: OrbitEnd) -> tuple[OrbitEnd, dict[str, Any]]:
        """Return how the orbit ended, and for a float orbit the drift and the near-singular steps."""
        if self.arithmetic.kind != "float":
            return end, {}
        message, float_data = end.message, {"near_singular": self.orbit.near_singular}
        if self.orbit.drift:
            float_data["drift"] = {drift.name: json_float(drift.largest) for drift in self.orbit.drift}
            largest = max(float(drift.largest) for drift in self.orbit.drift)
            message += f"; largest observed drift of the integrals h/(1 + eps^2 D): {largest:.3g}"
        if self.orbit.near_singular:
            first_step = self.orbit.near_singular_at
            message += f"; near-singular steps: {self.orbit.near_singular}, the first from step {first_step}"
        return replace(end, message=message), float_data

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        """Return the coordinates as an array of shape (points, dim), for `numpy.asarray`.

        Args:
            dtype: by default float64, to which exact numbers are rounded; for residues int64, or object if int64 is too
                small. `object` leaves the coordinates unchanged: fmpq, elements of a number field, balls, float, and
                residues as int. An integer dtype represents the coordinates exactly.

        Raises:
            InputError: if the dtype cannot represent the coordinates: for integers, numbers that are not integers or
                too large; for floats, balls, algebraic numbers, and residues that would be rounded.
        """
        import numpy as np

        if copy is False:
            raise InputError("found copy=False, expected copy=None: the array of an orbit is created on demand")
        prime = self.arithmetic.number if self.arithmetic.kind == "mod" else 0
        rows: list[list[Any]] = [[int(x) if prime else x for x in point.x] for point in self.points]
        default_dtype = np.float64 if not prime else np.int64 if prime < 2**63 else object
        array_dtype = np.dtype(default_dtype if dtype is None else dtype)
        if array_dtype.kind == "O":
            table = np.empty((len(rows), len(self.variables)), dtype=object)
            for index in np.ndindex(table.shape):
                table[index] = rows[index[0]][index[1]]
            return table
        if self.arithmetic.kind == "ball" or any(isinstance(x, EtaleElement) for x in self[0].x):
            raise InputError(
                f'{self.arithmetic} arithmetic has no values of dtype {array_dtype}: use arithmetic="float" or '
                "dtype=object"
            )
        if array_dtype.kind in "iu":
            limits = np.iinfo(array_dtype)
            for row in rows:
                for k, x in enumerate(row):
                    number = fmpq(*x.as_integer_ratio()) if isinstance(x, float) and math.isfinite(x) else x
                    row[k] = int(number.p) if isinstance(number, fmpq) and number.q == 1 else number
                    if not (isinstance(row[k], int) and limits.min <= row[k] <= limits.max):
                        text = str(x)
                        raise InputError(
                            f"found the coordinate {text if len(text) < 50 else text[:40] + '...'}, expected integers "
                            f"from {limits.min} to {limits.max} for {array_dtype}: use dtype=object, which keeps all "
                            "numbers unchanged, or dtype=float"
                        )
            return np.array(rows, dtype=array_dtype)
        if array_dtype.kind not in "fc":
            raise InputError(f"found the dtype {array_dtype}, expected one of floats or integers, or object")
        if prime > 2 ** (np.finfo(array_dtype).nmant + 1):
            raise InputError(
                f"found {array_dtype}, which rounds residues modulo {prime}, expected dtype=int or dtype=object"
            )
        from kahanmaps.maps.floats.float_conversion import to_float

        return np.array([[to_float(x) if isinstance(x, fmpq) else x for x in row] for row in rows], dtype=array_dtype)

    def __iter__(self) -> Iterator[OrbitPoint]:
        # This is a generator, since `list` calls __len__, which computes the points, before it reads the first point.
        yield from (point for point in self._all_points() if self._request.is_requested(point.step))

    def _all_points(self) -> Iterator[OrbitPoint]:
        """Yield the stored points; if none are stored, all points as they are computed, even if not requested."""
        yield from self.points if "points" in self.__dict__ else self._compute_points()

    def _compute_points(self) -> Iterator[OrbitPoint]:
        if self.arithmetic.kind != "float":
            yield from self.orbit
            return
        from kahanmaps.maps.floats.float_orbit import FLOATS

        for step, x in self.orbit:
            yield OrbitPoint(step, FLOATS, tuple(x.tolist()))


class OrbitPoints(list[OrbitPoint]):
    """A slice of an orbit: a list of points with the arrays `x` and `t` of the orbit."""

    def __init__(self, orbit: Trajectory, index: slice) -> None:
        super().__init__(orbit.points[index])
        self._orbit, self._index = orbit, index

    @property
    def x(self) -> Any:
        """The coordinates, as `Trajectory.x`."""
        return self._orbit.x[self._index]

    @property
    def t(self) -> Any:
        """The times, as `Trajectory.t`."""
        return self._orbit.t[self._index]


class UnknownVariable(InputError, KeyError):
    """An orbit has no variable of this name."""


class NotAccurate(Exception):
    """No available precision gives the requested number of correct digits."""


def bits_for(orbit_with: Callable[[int], Orbit], digits: int, on_progress: Callable[[str], None] | None = None) -> int:
    """Return a precision in bits at which all points have `digits` correct digits, relative to the largest coordinate.

    The precision is doubled until it suffices. `orbit_with` returns the orbit over RR(bits); an orbit that ends for
    another reason than precision is accepted. `on_progress` is called for every trial. Raises NotAccurate if the
    largest precision does not suffice.

    >>> from kahanmaps.algebra.fields import RR
    >>> from kahanmaps.maps.kahan import KahanMap
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> bits_for(lambda bits: Orbit(KahanMap(system, "1/10", RR(bits)), [1, 2], 50), 15)
    128
    """
    bits = 64
    while bits < digits * _BITS_PER_DIGIT + 32:
        bits *= 2
    while bits < MAX_BALL_BITS:
        orbit = orbit_with(bits)
        if on_progress is not None:
            on_progress(f"balls of {bits} bits")
        # Accuracy is relative to the largest coordinate, as a coordinate may be 0; one inaccurate point ends the trial.
        is_accurate = all(
            entry.is_exact() or entry.rad() * arb(10) ** digits <= max(abs(coordinate.mid()) for coordinate in point.x)
            for point in orbit
            for entry in point.x
        )
        if is_accurate and orbit.end is not None and orbit.end.status != "precision":
            return bits
        bits *= 2
    raise NotAccurate(f"not even balls of {bits // 2} bits give {digits} digits at every point")


def _orbit_at_one_eps(request: OrbitRequest, numbers: Any) -> Trajectory:
    """Return the orbit of a map at a fixed eps over its own field; `numbers` is that field or "exact"."""
    phi, exact_arithmetic = request.map, Arithmetic("exact")
    if request.eps is not None or request.at is not None or numbers not in ("exact", exact_arithmetic, phi.field):
        raise InputError(f"{phi!r} has a fixed eps and field: give only an initial point and steps=")
    p, bits = phi.field.characteristic, getattr(phi.field, "bits", 0)
    arithmetic = Arithmetic("mod", p) if p else Arithmetic("ball", bits) if bits else exact_arithmetic
    points = Orbit(phi, request.start, request.steps, backward=request.backward, max_digits=request.max_digits)
    request = request._replace(start=points.start, eps=phi.eps)
    return Trajectory(points, request, arithmetic, MethodChoice("generic", "it is a map at one eps"))


def _find_normal_form(
    request: OrbitRequest,
    method: str | None,
    arithmetic: Arithmetic,
    hamiltonian: CubicHamiltonian | None,
    member: FamilyMember | None,
) -> SystemNormalForm | NoNormalForm:
    """Return the normal form, or the reason why it is not used."""
    map_, eps = request.map, request.eps
    if method == "generic":
        return NoNormalForm("not computed")
    if not isinstance(map_, KahanFamily) or map_.system.symbols:
        return NoNormalForm(f"it is {map_.kind}")
    if method is None:  # do not search for a normal form if the search takes longer than the orbit
        max_steps = _MAX_STEPS_WITHOUT_SEARCH[arithmetic.kind]
        numbers = [eps, *(rational(entry) for entry in request.start)]
        if max(max(abs(x.p).bit_length(), x.q.bit_length()) for x in numbers) > _LONG_INPUT_BITS:
            max_steps = max(max_steps, 24)
        if request.steps <= max_steps:
            return NoNormalForm("not computed for so few steps")
        if member is None and map_.dim > _MAX_SEARCH_DIMENSION:
            return NoNormalForm(f"not computed in dimension {map_.dim}")
    normal_form = system_normal_form(map_.system, hamiltonian, member)
    if isinstance(normal_form, NoNormalForm):
        return normal_form
    if arithmetic.kind == "float" and normal_form.T is not None and method is None:
        return NoNormalForm("in floating point it requires J = [[0, I], [-I, 0]]")
    if arithmetic.kind in ("ball", "mod"):
        from kahanmaps.maps.normal_form.iterate import NthIterate, special_start

        if arithmetic.kind == "ball" and (reason := special_start(normal_form, eps, request.start)):
            return NoNormalForm(reason)
        try:
            if arithmetic.kind == "mod":
                NthIterate(normal_form, eps, GF(arithmetic.number))
        except BadPrime as error:
            return NoNormalForm(str(error))
    return normal_form
