"""One door to all orbits: of any map, in any arithmetic, by the fastest way that gives what is asked for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple, overload

from flint import arb, fmpq

from kahanmaps.algebra.etale import EtaleElement
from kahanmaps.algebra.fields import GF, MAX_BALL_BITS, Field, integer, rational
from kahanmaps.algebra.parsing import parse_point
from kahanmaps.algebra.printing import json_float
from kahanmaps.atomic_files import open_append
from kahanmaps.display_protocols import data_frame
from kahanmaps.errors import BadPrime, InputError, KahanmapsError
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.maps.convention import eps_record, resolve_eps
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.kahan import KahanFamily, SystemLike, as_map
from kahanmaps.maps.orbits.arithmetic import Arithmetic
from kahanmaps.maps.orbits.iteration import (
    DEFAULT_MAX_DIGITS,
    Orbit,
    OrbitEnd,
    OrbitPoint,
    require_short,
    require_steps,
)
from kahanmaps.maps.orbits.methods import DOUBLING_FROM, Method, choose_method
from kahanmaps.maps.orbits.writers import FORMATS, OutputFull, Writer, form_of, writer_to
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.version import __version__

if TYPE_CHECKING:
    from kahanmaps.family.associated import FamilyMember

_TOO_FAR = 10**13  # years
_FEW_STEPS = 3  # for which looking for a normal form does not pay
_LONG_INPUT = 4000  # bits of start and eps, from which on setting up a normal form pays later
_LARGE_DIMENSION = 16
_BITS_AT_LEAST = 4096  # where no precision is enough
_BITS_PER_DIGIT = 3.3219281


def orbit(
    system: SystemLike | Map,
    start: Any,
    eps: Any = None,
    steps: int | None = None,
    *,
    time_step: Any = None,
    at: Sequence[int] | None = None,
    arithmetic: str | Arithmetic | Field | type[float] = "exact",
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
    """The orbit of a start, or some of its iterates: iterate over it once, then look at `end`.

    Args:
        system: the map; a quadratic system stands for its Kahan map. A map at one eps, phi @ psi for example, is
            iterated as it is, in its own numbers.
        start: exact numbers, or text such as "1/2,-1/3"; floats may start float orbits.
        eps: an exact number, for Kahan maps half the time step; none for a map without it.
        time_step: 2 eps, in its place.
        steps: how many steps to take, or
        at: which iterates alone are wanted.
        arithmetic: "exact", "float", "mod:P", "ball:BITS" or "ball:auto"; or a field: QQ, GF(p), RR(bits), CC(bits), a
            number field.
        method: "generic", "normal-form" or "doubling"; chosen by itself unless given.
        backward: step by the inverse map.
        every: multiples of it alone are wanted.
        max_digits: the digit budget in exact arithmetic (200,000 unless given).
        hamiltonian, member: what is known of a quadratic system, so that its normal form need not be searched.
        normal_form: the normal form itself, or why there is none; looked for where it pays unless given.
        kernel: "numpy" or "numba", for floats.
        accuracy: decimal digits, for "ball:auto".
        progress: is told of trials.

    Returns:
        The points as they come, exact, enclosed or rounded as the arithmetic is; `method` says how and why.

    Raises:
        InputError: for wrong values, and for what the map, the method and the arithmetic do not allow together.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> riccati = QuadraticSystem.from_text(["x"], ["x^2"])
    >>> [point.text for point in orbit(riccati, ["1/5"], "1/2", steps=3)]
    [['1/5'], ['1/4'], ['1/3'], ['1/2']]
    >>> [point.text for point in orbit(riccati, ["1/5"], "1/2", steps=3, arithmetic="mod:7")]
    [['3'], ['2'], ['5'], ['4']]
    """
    eps = resolve_eps(eps, time_step)
    if (steps is None) == (at is None):
        raise InputError("expected a number of steps, or at: the steps that are wanted; one of the two")
    require_steps(steps)
    if integer(every, "every") < 1:
        raise InputError(f"found every = {every!r}, expected a positive integer")
    field, arithmetic = arithmetic, Arithmetic.of(arithmetic)
    if isinstance(start, str):
        start = parse_point(start)
    if not hasattr(start, "__len__"):
        raise InputError(f"found the start {start!r}, expected a sequence of numbers")
    if arithmetic.kind == "float":  # which floats may start, exactly these
        for x in start:
            if isinstance(x, float) and not math.isfinite(x):
                raise InputError(f"found {x} in the start, expected finite numbers")
        start = [fmpq(*x.as_integer_ratio()) if isinstance(x, float) else x for x in start]
    if not isinstance(at, Iterable | None):
        raise InputError(f"found at = {at!r}, expected a sequence of steps, at=[{at}]")
    wanted = None if at is None else frozenset(integer(step, "a step of at") for step in at)
    far = max(wanted, default=0) if wanted is not None else (steps or 0)
    require_steps(far)
    request = OrbitRequest(system, start, eps, far, wanted, every, backward, max_digits or DEFAULT_MAX_DIGITS, kernel)
    if isinstance(system, Map):
        return _orbit_at_one_eps(request, field)
    map_ = as_map(system)
    if eps is None and map_.has_eps:
        raise InputError("found no eps, expected an exact number: the map depends on it")
    if isinstance(field, Field) and field != arithmetic.field:  # a number field, complex balls
        if at is not None or method not in (None, "generic"):
            raise InputError(f"over {field} orbits go step by step: found at= or method=, expected steps alone")
        phi = map_.at(1 if eps is None else eps, field)
        return _orbit_at_one_eps(request._replace(map=phi, eps=None), field)
    request = request._replace(map=map_, eps=fmpq(1) if eps is None else rational(eps))
    if arithmetic.kind == "exact":
        numbers = [entry for entry in start if not isinstance(entry, EtaleElement)]
        require_short(request.eps, [rational(entry) for entry in numbers], max_digits)
    if normal_form is None:
        normal_form = _normal_form(request, method, arithmetic, hamiltonian, member)
    chosen = choose_method(method, arithmetic.kind, normal_form, at)
    if chosen.name != "doubling" and far > _TOO_FAR:
        raise InputError(
            f"step {far} is too far to be reached one step after the other (more than {_TOO_FAR:.0e}), "
            f"and there is no other way here: {chosen.reason}"
        )
    used = normal_form if chosen.name != "generic" and isinstance(normal_form, SystemNormalForm) else None
    remark = ""
    if arithmetic == Arithmetic("ball"):
        try:
            bits = bits_for(lambda bits: request.by(chosen.name, used, Arithmetic("ball", bits)), accuracy, progress)
        except NotAccurate as error:
            bits, remark = _BITS_AT_LEAST, str(error)
        arithmetic = Arithmetic("ball", bits)
    return Trajectory(request.by(chosen.name, used, arithmetic), request, arithmetic, chosen, remark)


class OrbitRequest(NamedTuple):
    """Which points of which orbit are wanted; `steps` is the last one."""

    map: Any
    start: Sequence[Any]
    eps: Any
    steps: int
    at: frozenset[int] | None
    every: int
    backward: bool
    max_digits: int
    kernel: str | None

    def wants(self, step: int) -> bool:
        """Whether this step is one that was asked for."""
        return step in self.at if self.at is not None else step % self.every == 0

    def by(self, method: str, normal_form: SystemNormalForm | None, numbers: Arithmetic) -> Any:
        """The iterator over them by a method, in an arithmetic."""
        if numbers.kind == "float":
            from kahanmaps.maps.floats.fast import FloatOrbit

            every = self.every if self.at is None else max(1, math.gcd(*self.at))
            form = None if normal_form is None else normal_form.form
            given = (self.map.real_approximation, self.eps, self.start, self.steps)
            return FloatOrbit(*given, backward=self.backward, form=form, kernel=self.kernel, every=every)
        over = self.map.at(self.eps, numbers.field)
        limits: dict[str, Any] = {"backward": self.backward, "max_digits": self.max_digits}
        if method == "doubling" and normal_form is not None:
            return Orbit(over, self.start, at=self.at or (), normal_form=normal_form, **limits)
        normal = normal_form if method == "normal-form" else None
        wanted = self.wants if self.at is not None or self.every > 1 else None
        return Orbit(over, self.start, self.steps, normal_form=normal, wanted=wanted, **limits)


class Trajectory:
    """What `orbit` returns. `arithmetic` is the one used, `method` its name and `why` the reason; `orbit` does it.

    Iterate over it, and nothing is kept; or ask for its length, for points by their number, for a table or an array,
    and all points are computed and kept. `integrals` are functions of x and eps (PhaseFunction) by name, whose values
    tables and files are to have beside the points.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> found = orbit(QuadraticSystem.from_text(["x"], ["x^2"]), ["1/5"], "1/2", steps=3)
    >>> len(found), found[-1].x, found.rows()[0]
    (4, (1/2,), {'step': 0, 'x': '1/5'})
    """

    def __init__(
        self, orbit: Any, request: OrbitRequest, arithmetic: Arithmetic, chosen: Method, remark: str = ""
    ) -> None:
        self.orbit = orbit
        self.arithmetic = arithmetic
        self.method, self._why = chosen.name, chosen.text
        self.variables: tuple[str, ...] = request.map.variables
        self.integrals: Mapping[str, Any] = {}
        self._request, self._remark = request, remark

    def __repr__(self) -> str:
        return f"Trajectory({', '.join(self.variables)}; {self.arithmetic}, {self.method})"

    @property
    def why(self) -> str:
        """The method and the reason for it, of long orbits over Q also what came to be known on the way."""
        relations = getattr(self.orbit, "relations", None)
        return self._why if relations is None else f"{self._why}; {relations}"

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight (safe to call from a signal handler)."""
        self.orbit.interrupt()

    @property
    def end(self) -> OrbitEnd:
        """How it ended; where not all points have come yet, they are computed and kept."""
        if self.orbit.end is None:
            _ = self.points
        end: OrbitEnd = self.orbit.end
        return OrbitEnd("precision", end.steps, self._remark) if self._remark and end.is_whole else end

    @cached_property
    def points(self) -> list[OrbitPoint]:
        """All points that were asked for."""
        return [point for point in self._computed() if self._request.wants(point.step)]

    def __len__(self) -> int:
        return len(self.points)

    @overload
    def __getitem__(self, index: int) -> OrbitPoint: ...
    @overload
    def __getitem__(self, index: slice) -> list[OrbitPoint]: ...
    def __getitem__(self, index: int | slice) -> OrbitPoint | list[OrbitPoint]:
        return self.points[index]

    def rows(self) -> list[dict[str, Any]]:
        """A row for each point: its step, the coordinates and the values of the integrals, None at poles.

        Floats and residues are numbers, others exact text.
        """
        kind = {"float": float, "mod": int}.get(self.arithmetic.kind, str)
        names = (*self.variables, *self.integrals)
        found = []
        for point in self.points:
            numbers = [text and kind(text) for text in (*point.text, *self.values(point))]
            found.append({"step": point.step, **dict(zip(names, numbers, strict=True))})
        return found

    def values(self, point: OrbitPoint) -> list[str | None]:
        """Those of the integrals, as text; None where one is not defined."""
        values: list[str | None] = []
        for function in self.integrals.values():
            try:  # eps itself, also where the orbit steps by -eps: integrals are those of the map
                value = function.value(point.field, self._request.eps, point.x)
            except (KahanmapsError, ArithmeticError):  # not defined where the map is not, or beyond the range of floats
                value = None
            is_defined = value is not None and not (isinstance(value, float) and not math.isfinite(value))
            values.append(point.field.format(value) if is_defined else None)
        return values

    def to_pandas(self) -> Any:
        """`rows()` as a table of pandas. Raises InputError where that, an extra, is not installed."""
        return data_frame(self.rows())

    def to_csv(self, path: str | Path) -> None:
        """Write the points alone, as `kahanmaps orbit -o` does: step and coordinates, exact."""
        with open_append(path) as stream:
            self.write(stream, "csv")

    def write(
        self,
        to: str | Path | IO[str] | Writer,
        form: str = "",
        name: str = "",
        told: Callable[[int], None] = lambda _: None,
    ) -> OrbitEnd:
        """Write the points that are wanted as they are computed, as `kahanmaps orbit` does.

        Args:
            to: a path, beside which a .csv file gets what it is of; a stream of text; or a writer.
            form: "text", "json", "jsonl", "csv", "npz", for the points of float orbits alone "npy"; by default what
                the ending of the path stands for, for a stream text.
            name: that of the system.
            told: is called with every step that was computed.

        Returns:
            How it ended, as the file says it; "budget" where an npz file cannot hold more.

        Raises:
            InputError: for other formats, and for npy where it cannot hold what is wanted.
        """
        if not form:
            form = form_of(to) if isinstance(to, str | Path) else "text"
        if form not in FORMATS:
            raise InputError(f"found the format {form!r}, expected {', '.join(FORMATS)}")
        if form == "npy":
            from kahanmaps.maps.floats.fast import stream_orbit

            if not isinstance(to, str | Path):
                raise InputError("npy grows in a file: found a stream, expected a path")
            if self.arithmetic.kind != "float":
                raise InputError("npy is for float orbits: take npz, or jsonl, which holds numbers of any length")
            if self._request.at is not None or self.integrals:
                raise InputError("npy holds the points of steps= and every=: for at= or integrals take npz")
            return self._ended(stream_orbit(self.orbit, to, progress=told))[0]
        columns = (self.variables, list(self.integrals))
        with nullcontext(to) if isinstance(to, Writer) else writer_to(to, form, *columns) as writer:
            writer.header(self.header(name))
            try:
                for point in self._known():
                    told(point.step)
                    if self._request.wants(point.step):
                        writer.point(point.step, point.text, self.values(point))
                end = self.end
            except OutputFull as full:
                end = OrbitEnd("budget", full.steps, str(full))
            end, more = self._ended(end)
            writer.end(end, more)
        return end

    def header(self, name: str = "") -> dict[str, Any]:
        """What the orbit can be made again from, as plain data; `name` is that of the system."""
        request = self._request
        header = {
            "system": name,
            "variables": list(self.variables),
            **request.map.written(),
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

    def _ended(self, end: OrbitEnd) -> tuple[OrbitEnd, dict[str, Any]]:
        """How it ended, and of a float orbit what it may have lost on the way, in the message and as plain data."""
        if self.arithmetic.kind != "float":
            return end, {}
        message, more = end.message, {"near_singular": self.orbit.near_singular}
        if self.orbit.drift:
            more["drift"] = {drift.name: json_float(drift.largest) for drift in self.orbit.drift}
            largest = max(float(drift.largest) for drift in self.orbit.drift)
            message += f"; block integrals moved by at most {largest:.3g} where looked at"
        if self.orbit.near_singular:
            first = self.orbit.near_singular_at
            message += f"; near-singular steps: {self.orbit.near_singular}, the first from step {first}"
        return replace(end, message=message), more

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        """The coordinates (points, dim) as an array for `numpy.asarray`.

        Args:
            dtype: float64 by default, to which exact numbers are rounded; of residues int64, or object where they do
                not fit. `object` has the coordinates as they are: fmpq, elements of a number field, balls, float, and
                residues as int. An integer dtype has them exactly.

        Raises:
            InputError: for what the dtype does not hold: numbers that are no integers or too large for an integer
                dtype; balls, algebraic numbers, and residues that are rounded, for floats.
        """
        import numpy as np

        if copy is False:
            raise InputError("found copy=False, expected copy=None: an orbit has no array before it is asked for one")
        prime = self.arithmetic.number if self.arithmetic.kind == "mod" else 0
        rows: list[list[Any]] = [[int(x) if prime else x for x in point.x] for point in self.points]
        default = np.float64 if not prime else np.int64 if prime < 2**63 else object
        kind = np.dtype(default if dtype is None else dtype)
        if kind.kind == "O":
            table = np.empty((len(rows), len(self.variables)), dtype=object)
            for at in np.ndindex(table.shape):
                table[at] = rows[at[0]][at[1]]
            return table
        if self.arithmetic.kind == "ball" or any(isinstance(x, EtaleElement) for x in self[0].x):
            raise InputError(
                f'found {self.arithmetic} arithmetic, expected numbers: take arithmetic="float", or dtype=object'
            )
        if kind.kind in "iu":
            limits = np.iinfo(kind)
            for row in rows:
                for k, x in enumerate(row):
                    number = fmpq(*x.as_integer_ratio()) if isinstance(x, float) and math.isfinite(x) else x
                    row[k] = int(number.p) if isinstance(number, fmpq) and number.q == 1 else number
                    if not (isinstance(row[k], int) and limits.min <= row[k] <= limits.max):
                        text = str(x)
                        raise InputError(
                            f"found the coordinate {text if len(text) < 50 else text[:40] + '...'}, expected integers "
                            f"from {limits.min} to {limits.max} for {kind}: take dtype=object, which has all numbers "
                            "as they are, or dtype=float"
                        )
            return np.array(rows, dtype=kind)
        if kind.kind not in "fc":
            raise InputError(f"found the dtype {kind}, expected one of floats or integers, or object")
        if prime > 2 ** (np.finfo(kind).nmant + 1):
            raise InputError(f"found {kind}, which rounds residues modulo {prime}, expected dtype=int or dtype=object")
        from kahanmaps.maps.floats.doubles import to_float

        return np.array([[to_float(x) if isinstance(x, fmpq) else x for x in row] for row in rows], dtype=kind)

    def __iter__(self) -> Iterator[OrbitPoint]:
        # `list` asks for the length between here and the first point
        yield from (point for point in self._known() if self._request.wants(point.step))

    def _known(self) -> Iterator[OrbitPoint]:
        """The points that are kept, or all that are computed now, of which not all need be asked for."""
        yield from self.points if "points" in self.__dict__ else self._computed()

    def _computed(self) -> Iterator[OrbitPoint]:
        if self.arithmetic.kind != "float":
            yield from self.orbit
            return
        from kahanmaps.maps.floats.fast import FLOATS

        for step, x in self.orbit:
            yield OrbitPoint(step, FLOATS, tuple(x.tolist()))


class NotAccurate(Exception):
    """No precision was enough."""


def bits_for(orbit_with: Callable[[int], Orbit], digits: int, told: Callable[[str], None] | None = None) -> int:
    """The bits with which every point has `digits` correct digits of its largest coordinate; doubled in every trial.

    `orbit_with` makes the orbit over RR(bits). An orbit that ends for another reason than precision is taken as it
    is. `told` hears of every trial. Raises NotAccurate where not even the largest precision will do.

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
        if told is not None:
            told(f"balls of {bits} bits")
        # The largest coordinate counts, for one may be zero; the first point that is not accurate ends the trial.
        enough = all(
            entry.is_exact() or entry.rad() * arb(10) ** digits <= max(abs(other.mid()) for other in point.x)
            for point in orbit
            for entry in point.x
        )
        if enough and orbit.end is not None and orbit.end.status != "precision":
            return bits
        bits *= 2
    raise NotAccurate(f"not even balls of {bits // 2} bits give {digits} digits at every point")


def _orbit_at_one_eps(request: OrbitRequest, numbers: Any) -> Trajectory:
    """The orbit of a map that has its eps and its field, which `numbers` may name."""
    phi, exact = request.map, Arithmetic("exact")
    if request.eps is not None or request.at is not None or numbers not in ("exact", exact, phi.field):
        raise InputError(f"{phi!r} has its eps and its numbers, expected a start and a number of steps alone")
    p, bits = phi.field.characteristic, getattr(phi.field, "bits", 0)
    kind = Arithmetic("mod", p) if p else Arithmetic("ball", bits) if bits else exact
    points = Orbit(phi, request.start, request.steps, backward=request.backward, max_digits=request.max_digits)
    request = request._replace(start=points.start, eps=phi.eps)
    return Trajectory(points, request, kind, Method("generic", "it is a map at one eps"))


def _normal_form(
    request: OrbitRequest,
    method: str | None,
    arithmetic: Arithmetic,
    hamiltonian: CubicHamiltonian | None,
    member: FamilyMember | None,
) -> SystemNormalForm | NoNormalForm:
    """The normal form, where it may be of use."""
    map_, eps = request.map, request.eps
    if method == "generic":
        return NoNormalForm("not looked for")
    if not isinstance(map_, KahanFamily) or map_.system.symbols:
        return NoNormalForm(f"it is {map_.kind}")
    if method is None:  # where looking for a normal form would cost more than it can save
        few = DOUBLING_FROM["mod"] - 1 if arithmetic.kind == "mod" else _FEW_STEPS
        numbers = [eps, *(rational(entry) for entry in request.start)]
        if max(max(abs(x.p).bit_length(), x.q.bit_length()) for x in numbers) > _LONG_INPUT:
            few = max(few, 24)
        if request.steps <= few:
            return NoNormalForm("not looked for, for so few steps")
        if member is None and map_.dim > _LARGE_DIMENSION:
            return NoNormalForm(f"not looked for in dimension {map_.dim}")
    normal_form = system_normal_form(map_.system, hamiltonian, member)
    if isinstance(normal_form, NoNormalForm):
        return normal_form
    if arithmetic.kind == "float" and normal_form.T is not None and method is None:
        return NoNormalForm("in machine numbers only J = [[0, I], [-I, 0]] has one")
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
