"""The orbits of a Kahan map on the points of P^n over GF(p): which are cycles, how long they are, what is lost.

Where the points are few, the whole graph of the map is made; else random points are followed. The counts are exact,
modulo one prime and at one eps. Source: roberts-vivaldi-2009.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flint import fmpq, fmpq_mat

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import GF, rational
from kahanmaps.algebra.written.plain import all_fields
from kahanmaps.displayed import Printed
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.laboratory.symmetry.reversors import require_reversor
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import Kahan, as_map
from kahanmaps.systems.quadratic import QuadraticSystem

if TYPE_CHECKING:
    from kahanmaps.maps.residues.projective import ProjectiveMap

MAX_POINTS = 2_000_000  # up to which the whole graph is made, up to dimension 6
DEFAULT_SAMPLES = 500
MAX_SAMPLES = 100_000
DEFAULT_EPS = ("1/10", "1/7", "2/11", "3/13", "3/17", "5/19", "2/3", "5/2", "3", "5", "4", "6")


@dataclass(frozen=True)
class Census(Printed):
    """What becomes of the points of P^n over GF(p) under the Kahan map at one eps (half the time step); exact counts.

    `lengths` is the number of cycles by length if the graph is `complete`, else the number of sampled points whose
    orbit came back, by length; `at_infinity` the same for the cycles that lie in Z = 0, which some maps leave
    invariant; `symmetric` for the other cycles that the reversing symmetry maps to themselves (None: no symmetry
    known, or samples). `fixed` counts the fixed points of R and Phi R. A point is `lost` where the map has
    no value, `falling` if its orbit gets to such a point, `transient` if its orbit gets to a cycle without being on it,
    and `open` if that was not settled within `steps` steps (samples only, which cannot tell it from transient).
    """

    prime: int
    eps: fmpq
    dim: int
    points: int
    complete: bool
    looked_at: int
    lost: int
    falling: int
    transient: int
    open: int
    steps: int
    stopped: bool
    lengths: Mapping[int, int]
    at_infinity: Mapping[int, int]
    symmetric: Mapping[int, int] | None
    fixed: tuple[int, int] | None
    factor: str | None
    degree: int
    is_undefined: bool

    @property
    def periodic(self) -> int:
        """The number of points, among those looked at, that lie on cycles."""
        return sum(length * n if self.complete else n for length, n in self.lengths.items())

    @property
    def cycles(self) -> int | None:
        """The number of cycles, None for samples."""
        return sum(self.lengths.values()) if self.complete else None

    @property
    def longest(self) -> int:
        """The length of the longest cycle seen, 0 if there is none."""
        return max(self.lengths, default=0)

    @property
    def mean(self) -> float | None:
        """The mean length of the cycles, None without cycles and for samples."""
        return self.periodic / self.cycles if self.cycles else None

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return all_fields(self)

    def rows(self) -> list[dict[str, int]]:
        """A row for each length: the number of cycles, or of sampled points; for pandas.DataFrame and the like."""
        return [{"length": length, "count": count} for length, count in self.lengths.items()]


def cycle_census(
    given: QuadraticSystem | BirationalMap,
    eps: Any,
    prime: int,
    *,
    reversor: fmpq_mat | None = None,
    samples: int | None = None,
    steps: int | None = None,
    seed: int = 0,
    seconds: float = 60.0,
    progress: Callable[[str], None] = lambda _: None,
) -> Census:
    """The orbits of a map on P^n over GF(p), all of them or those of random points.

    A system stands for its Kahan map. `eps` is exact, for that half the time step; 2 < `prime` < 2^29. Up to 2,000,000
    points (half as many with each dimension above 6, where a step costs twice as much) the whole graph is made unless
    `samples` says how many random points to follow; each is followed for at most `steps` steps (default 8 (p + 1 + 2
    sqrt p)), all of them for about `seconds` seconds. `reversor` is a matrix R with R^2 = I and f(R x) = -R f(x).
    Exact: counts, no estimates. Raises InputError for a wrong prime, matrix or number of samples, BadPrime where eps or
    the system have no reduction. Source: roberts-vivaldi-2009.

    >>> census = cycle_census(QuadraticSystem.from_text(["x", "y"], ["y", "6*x^2 - 2"]), "1/10", 31)
    >>> census.points, census.lost, census.falling, census.periodic, census.longest
    (993, 3, 613, 377, 21)
    """
    from kahanmaps.maps.residues.projective import ProjectiveMap

    exact_eps, map_ = rational(eps), as_map(given)
    if prime != 2:
        _require_reduction(map_, exact_eps, prime)
    if reversor is not None:
        if not isinstance(map_, Kahan):
            raise InputError(f"found a reversor for {map_.kind}, expected none: f(R x) = -R f(x) is asked of fields f")
        require_reversor(map_.system, reversor)
    if samples is not None and not 1 <= samples <= MAX_SAMPLES:
        raise InputError(f"found {samples} samples, expected 1 to {MAX_SAMPLES}")
    if steps is not None and steps < 1:
        raise InputError(f"found {steps} steps, expected at least 1")
    chart = ProjectiveMap(map_, exact_eps, prime)
    if samples is None and chart.count <= MAX_POINTS >> max(0, chart.dim - 6):
        progress(f"p = {prime}: the images of {chart.count} points")
        return _of_all_points(chart, exact_eps, None if reversor is None else GF(prime).convert_matrix(reversor))
    starts = seed_for(seed, map_.subject, exact_eps, prime)
    return _of_samples(chart, exact_eps, samples or DEFAULT_SAMPLES, starts, steps, seconds, progress)


def _of_all_points(chart: ProjectiveMap, eps: fmpq, reversor: Any) -> Census:
    """By the whole graph; `reversor` is a matrix modulo p."""
    from kahanmaps.maps.residues.projective import graph_of

    image = chart.table()
    graph = graph_of(image)
    labels, lengths = graph.lengths
    affine = graph.is_seen(labels, chart.count - chart.prime**chart.dim)
    symmetric, fixed = None, None
    if reversor is not None:
        R = chart.permutation(reversor)
        here = affine & (graph.label[R[labels]] == labels)
        symmetric = _counted(lengths[here])
        numbers = range(chart.count)
        fixed = (int((R == numbers).sum()), int((image[R] == numbers).sum()))
    rest = chart.count - graph.lost - graph.falling - int(lengths.sum())
    seen = (chart.count, graph.lost, graph.falling, rest, 0, 0, False)
    counts, far = _counted(lengths), _counted(lengths[~affine])
    return _census(chart, eps, True, *seen, counts, far, symmetric, fixed)


def _of_samples(
    chart: ProjectiveMap,
    eps: fmpq,
    samples: int,
    seed: int,
    steps: int | None,
    seconds: float,
    progress: Callable[[str], None],
) -> Census:
    """By random points, each followed until it is back."""
    from kahanmaps.maps.residues.projective import hasse_weil, random_points, walk_until_back

    starts = random_points(chart, samples, seed)
    limit = 8 * hasse_weil(chart.prime) if steps is None else steps
    end = time.monotonic() + seconds
    taken = limit

    def keep_on(step: int) -> bool:
        nonlocal taken
        progress(f"p = {chart.prime}: step {step} of at most {limit}")
        if time.monotonic() > end:
            taken = step - 1
            return False
        return True

    back, gone = walk_until_back(chart, starts, limit, keep_on)
    counts = _counted(back[back > 0])
    lost, falling = int((gone == 0).sum()), int((gone > 0).sum())
    left = starts.shape[1] - lost - falling - sum(counts.values())
    seen = (starts.shape[1], lost, falling, 0, left, taken, taken < limit)
    return _census(chart, eps, False, *seen, counts, {}, None, None)


def _census(chart: ProjectiveMap, eps: fmpq, *seen: Any) -> Census:
    form: dict[str, Any] = {"factor": chart.factor, "degree": chart.degree, "is_undefined": chart.is_undefined}
    return Census(chart.prime, eps, chart.dim, chart.count, *seen, **form)


def default_eps(prime: int, count: int = 2) -> list[fmpq]:
    """The first `count` eps of a fixed list, 1/10 and 1/7 leading, that are ordinary modulo the prime; exact.

    Left out are those without a reduction, those congruent to an earlier one up to sign (the inverse map), and, for
    p > 5, those with eps^4 = 1, at which maps may be periodic that are not so for other eps. There are fewer for tiny
    primes. Raises InputError for p = 2, where every Kahan map is the identity.

    >>> default_eps(101)
    [1/7, 2/11]
    """
    if prime == 2:
        raise InputError("found the prime 2, expected an odd one: modulo 2 every Kahan map is the identity")
    found: list[fmpq] = []
    seen: set[int] = set()
    field = GF(prime)
    for text in DEFAULT_EPS:
        try:
            residue = int(field.convert(text))
        except BadPrime:
            continue
        if residue and residue not in seen and (prime <= 5 or pow(residue, 4, prime) != 1):
            found.append(rational(text))
            seen |= {residue, prime - residue}
        if len(found) == count:
            break
    return found


def _require_reduction(map_: BirationalMap, eps: fmpq, prime: int) -> None:
    """Raise BadPrime with a sentence for this command where eps or the map cannot be reduced."""
    field = GF(prime)
    if eps == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    if eps.q % prime == 0 or eps.p % prime == 0:
        raise BadPrime(f"the prime {prime} divides {eps} = eps above or below: take another prime or eps", prime)
    try:
        map_.at(eps, field)
    except BadPrime as error:
        if map_.root is not None:
            raise
        what = "system" if isinstance(map_, Kahan) else "map"
        raise BadPrime(f"the prime {prime} divides a denominator of the {what}: take another prime", prime) from error


def _counted(lengths: Any) -> dict[int, int]:
    return dict(sorted(Counter(lengths.tolist()).items()))
