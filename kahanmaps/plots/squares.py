"""Do two Kahan maps commute, seen from one point: the lattice Phi_f^i Phi_g^j x, reached along both orders. Exact.

The square x, Phi_f x, Phi_g x has two candidates for its fourth corner, Phi_g(Phi_f x) and Phi_f(Phi_g x). What is
drawn is computed here, `draw_squares.py` draws it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.documents.files import SystemFile, matched
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.family.recognise import recognised_hamiltonian, recognised_member
from kahanmaps.maps.implicit import BirationalMap, MapOver
from kahanmaps.maps.kahan import Kahan, as_map
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_STEPS = 12
MAX_BITS = 300_000  # of the numerators and denominators of one coordinate: seconds for a step

Point = tuple[fmpq, ...]
Lattice = tuple[tuple[Point | None, ...], ...]  # [i][j], None where a map has no value or numbers are too long


@dataclass(frozen=True)
class MapPair:
    """Two maps that are compared, systems standing for theirs; the second is scaled where it has another step.

    `names` are short texts, `note` says how variables are matched, where that needs a word.
    """

    f: QuadraticSystem | BirationalMap
    g: QuadraticSystem | BirationalMap
    names: tuple[str, str]
    note: str = ""


@dataclass(frozen=True, eq=False)
class Squares:
    """Two lattices from one point: `g_after_f[i][j]` is Phi_g^j(Phi_f^i x), `f_after_g[i][j]` is Phi_f^i(Phi_g^j x).

    `stopped` says in a sentence why points are missing, empty where none is.
    """

    pair: MapPair
    g_after_f: Lattice
    f_after_g: Lattice
    stopped: str

    @property
    def steps(self) -> int:
        """How often each map is applied."""
        return len(self.g_after_f) - 1

    @property
    def compared(self) -> list[tuple[Point, Point]]:
        """The pairs of points that the two orders lead to, where both are there."""
        rows = zip(self.g_after_f[1:], self.f_after_g[1:], strict=True)
        pairs = (pair for row, other in rows for pair in zip(row[1:], other[1:], strict=True))
        return [(one, other) for one, other in pairs if one is not None and other is not None]

    @property
    def closes(self) -> bool | None:
        """Whether the two orders lead to the same points, by ==; None where there is nothing to compare."""
        pairs = self.compared
        return all(one == other for one, other in pairs) if pairs else None

    @property
    def gap(self) -> float:
        """The largest distance, in all coordinates, between points that should be one."""
        squares = [sum(((a - b) ** 2 for a, b in zip(*pair, strict=True)), fmpq(0)) for pair in self.compared]
        return float(arb(max(squares, default=fmpq(0))).sqrt().mid())

    @property
    def verdict(self) -> str:
        """In words: closes exactly, the gap, or that nothing could be compared."""
        if self.closes is None:
            return "no fourth corner"
        return "closes exactly" if self.closes else f"gap {self.gap:.3g}"


def squares(
    pair: MapPair, start: Sequence[Any], eps: Any, steps: int = 1, progress: Callable[[str], None] = lambda _: None
) -> Squares:
    """Walk `steps` steps of each map from an exact start in both orders; eps is exact, the time step is 2 eps.

    Raises InputError for wrong sizes.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "0"])
    >>> g = QuadraticSystem.from_text(["x", "y"], ["0", "-y^2"])
    >>> squares(MapPair(f, g, ("f", "g")), [1, 2], "1/10").verdict
    'closes exactly'
    >>> h = QuadraticSystem.from_text(["x", "y"], ["y^2", "0"])
    >>> squares(MapPair(f, h, ("f", "h")), [1, 2], "1/10").verdict
    'gap 0.762'
    """
    if not 1 <= steps <= MAX_STEPS:
        raise InputError(f"found {steps} steps, expected 1 to {MAX_STEPS}")
    phi_f, phi_g = as_map(pair.f).at(eps), as_map(pair.g).at(eps)
    x = phi_f.point(start)
    missing: list[str] = []

    def orbit(phi: MapOver, first: Point | None, name: str) -> list[Point | None]:
        found = [first]
        for k in range(steps):
            progress(f"{name}, step {k + 1} of {steps}")
            image = None
            if found[-1] is not None:
                try:
                    image = tuple(phi.step(found[-1]))
                except SingularStep:
                    missing.append(f"{name}: the map has no value at a point on the way")
            if image and max(entry.p.bit_length() + entry.q.bit_length() for entry in image) > MAX_BITS:
                missing.append(f"{name}: the coordinates have more than {MAX_BITS} bits")
                image = None
            found.append(image)
        return found

    along_f, along_g = orbit(phi_f, x, "Phi_f"), orbit(phi_g, x, "Phi_g")
    g_after_f = tuple(tuple(orbit(phi_g, point, f"Phi_g after {i} times Phi_f")) for i, point in enumerate(along_f))
    columns = [orbit(phi_f, point, f"Phi_f after {j} times Phi_g") for j, point in enumerate(along_g)]
    f_after_g = tuple(tuple(column[i] for column in columns) for i in range(steps + 1))
    return Squares(pair, g_after_f, f_after_g, missing[0] if missing else "")


def pairs_of_member(file: SystemFile) -> tuple[MapPair, MapPair]:
    """The maps of a member that are drawn: two associated ones, and the control J grad H_0 and J grad H_1.

    The first is the system itself, the second has the other sign at the last factor of chi. Where m = 1 the control is
    f with 2 f. Raises InputError where the system is no member, declared or recognised, in its own coordinates.
    """
    member = file.member
    if member is None:
        hamiltonian = file.hamiltonian or recognised_hamiltonian(file.system)
        recognised = None if hamiltonian is None else recognised_member(hamiltonian)
        if recognised is None or not recognised.is_standard:
            raise InputError(
                f"{file.name} is of kind [{file.kind}], and one system commutes with itself: give a second system, "
                "or a member of the commuting family with the standard J, whose associated maps are drawn"
            )
        member = recognised.member
    J = standard_structure(member.dim)
    first = member.chosen
    second = member.associate((*member.signs[:-1], -member.signs[-1]))
    associated = MapPair(first.system, second.system, (f"f_{first.label}", f"f_{second.label}"))
    f = CubicHamiltonian(member.chain[0], J).system
    if member.m == 1:
        return associated, MapPair(f, f.scaled(2), ("f", "2 f"))
    g = CubicHamiltonian(member.chain[1], J).system
    return associated, MapPair(f, g, ("J grad H_0", "J grad H_1"))


def pair_of_systems(file: SystemFile, other: SystemFile, eps: Any, eps2: Any = None) -> MapPair:
    """Two systems of one dimension; with `eps2` the second has this step: it is scaled by eps2/eps."""
    g: QuadraticSystem | BirationalMap
    g, note = matched(file, other)
    if eps2 is not None:
        if not other.is_quadratic or not isinstance(g, Kahan):
            raise InputError(f"found eps2 with {other.map.kind}, expected a quadratic vector field, which it scales")
        g = g.system
        if rational(eps2) == 0:
            raise InputError("found eps2 = 0, expected another number: at eps = 0 the Kahan map is the identity")
        g = g.scaled(rational(eps2) / rational(eps))
    return MapPair(file.map, g, ("f", "g"), note)
