"""The number of cycles of each length of a map on projective space over GF(p).

If P^n(GF(p)) is small, the orbits of all its points are computed, otherwise those of random points. Counts are exact.

The lengths are not compared with the Hasse-Weil bound p + 1 + 2 sqrt p. This bound holds for a cycle on an irreducible
curve of genus 1 that the map sends to itself. Integrable maps may have longer cycles, since level sets may have several
components, and the map may permute level sets. Source: roberts-jogia-vivaldi-2003, roberts-vivaldi-2009.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import GF, integer, rational
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.printing import all_fields
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.maps.projective import homogeneous_map

MAX_POINTS = 2_000_000  # in a space all of whose points are examined; halved for each dimension above 6
MAX_PRIME = 1 << 31  # products of two residues stay below 2^62
MAX_DIMENSION = 12  # in dimension n the minors of all points of a batch need up to 2^(n + 1) arrays
MAX_FACTORED = 6  # maximal dimension in which the forms of the map are expanded
DEFAULT_SAMPLES, MAX_SAMPLES, DEFAULT_STEPS = 500, 100_000, 10_000
DEFAULT_EPS = ("1/10", "1/7", "2/11", "3/13", "3/17", "5/19", "2/3", "5/2", "3", "5", "4", "6")


@dataclass(frozen=True)
class Census(PrintableResult):
    """Exact counts of the orbits of points of P^n over GF(p) under a map at one eps (half the time step).

    If `complete`, all points of P^n were examined, and `lengths` maps each length to the number of cycles. Otherwise
    random points were examined, and `lengths` maps each period to the number of these points with this period.
    `indeterminate` counts points at which the map is not defined, `pre_indeterminate` other points whose orbit reaches
    such a point, `preperiodic` points outside cycles whose orbit reaches a cycle, and `open` random points undecided
    after `steps` steps. `is_stopped` says whether a time limit ended the work; for all points `examined` is then 0.
    """

    prime: int
    eps: fmpq
    dim: int
    points: int
    complete: bool = False
    is_stopped: bool = False
    examined: int = 0
    indeterminate: int = 0
    pre_indeterminate: int = 0
    preperiodic: int = 0
    open: int = 0
    steps: int = 0
    lengths: Mapping[int, int] = field(default_factory=dict)

    @property
    def periodic(self) -> int:
        """The number of examined points that lie on cycles."""
        return sum(length * n if self.complete else n for length, n in self.lengths.items())

    @property
    def cycles(self) -> int | None:
        """The number of cycles; None unless all points were examined."""
        return sum(self.lengths.values()) if self.complete else None

    @property
    def longest(self) -> int:
        """The length of the longest cycle that was detected; 0 if there is none."""
        return max(self.lengths, default=0)

    def to_json(self) -> dict[str, Any]:
        """Return all fields as plain data."""
        return all_fields(self, stopped="is_stopped")

    def rows(self) -> list[dict[str, int]]:
        """Return a row for each entry of `lengths`, for example for pandas.DataFrame."""
        return [{"length": length, "count": count} for length, count in self.lengths.items()]


def cycle_census(
    system: SystemLike,
    eps: Any = None,
    prime: int = 0,
    *,
    time_step: Any = None,
    h: Any = None,
    samples: int | None = None,
    steps: int = DEFAULT_STEPS,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Census:
    """Count the cycles of a map on P^n over GF(p) by length, from the orbits of all points or of random points.

    The factors of a composition are applied one after another; if one of them is undefined, the point is indeterminate.
    Above dimension 6 a point at which a common factor of the forms of the map vanishes is also called indeterminate.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        eps: an exact number, half the time step for a Kahan map; a map without eps needs none.
        prime: a prime between 2 and 2^31.
        time_step, h: the time step 2 eps, instead of eps.
        samples: the number of random points; by default all points if there are at most 2,000,000 (halved for each
            dimension above 6), otherwise 500.
        steps: the maximal number of steps of the orbit of a random point.
        seed: the random seed.
        progress: called with messages.

    Returns:
        A `Census` with exact counts. If a `time_limit` ends the count early, `is_stopped` of the result is True.

    Raises:
        InputError: for arguments out of range. BadPrime: if eps or the map has no reduction modulo p.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> census = cycle_census(QuadraticSystem.from_text(["x", "y"], ["y", "6*x^2 - 2"]), "1/10", 31)
    >>> census.points, census.indeterminate, census.pre_indeterminate, census.periodic, census.longest
    (993, 3, 613, 377, 21)
    """
    import numpy as np

    map_, prime, eps = as_map(system), integer(prime, "prime"), resolve_eps(eps, time_step, h)
    eps = fmpq(1) if eps is None and not map_.has_eps else rational(eps)
    if steps < 1 or not 1 <= (DEFAULT_SAMPLES if samples is None else samples) <= MAX_SAMPLES:
        raise InputError(f"found {samples} samples, {steps} steps, expected 1 to {MAX_SAMPLES} and 1 or more")
    space = _ProjectiveMap(map_, eps, prime)
    census = Census(prime, eps, map_.dim, sum(prime**m for m in range(map_.dim + 1)))
    if samples is None and census.points <= MAX_POINTS >> max(0, map_.dim - 6):
        return _count_all_points(space, census, progress)
    samples, rng = samples or DEFAULT_SAMPLES, np.random.default_rng(derive_seed(seed, map_.seed_data, eps, prime))
    vectors = rng.integers(0, prime, (map_.dim + 1, 2 * samples + 20))  # surplus, since zero vectors are no points
    initial_points = points = space.normalized(vectors[:, vectors.any(axis=0)][:, :samples])
    census = replace(census, examined=initial_points.shape[1])
    step, lengths, is_stopped = 0, dict[int, int](), False
    indeterminate = [0, 0]  # the numbers of initial points without image, and of those whose orbits end later
    try:
        while step < steps and points.shape[1]:
            progress(f"p = {prime}: step {step} of at most {steps}")
            batches = range(0, points.shape[1], space.batch_size)
            points = np.hstack([space.images(points[:, k : k + space.batch_size]) for k in batches])
            is_indeterminate, is_periodic = ~points.any(axis=0), (points == initial_points).all(axis=0)
            indeterminate[step > 0] += int(is_indeterminate.sum())
            step += 1
            if is_periodic.any():
                lengths[step] = int(is_periodic.sum())
            is_open = ~(is_indeterminate | is_periodic)
            points, initial_points = points[:, is_open], initial_points[:, is_open]
    except TimeLimit:
        is_stopped = True
    census = replace(census, is_stopped=is_stopped, steps=step, lengths=lengths, open=initial_points.shape[1])
    return replace(census, indeterminate=indeterminate[0], pre_indeterminate=indeterminate[1])


def _count_all_points(space: _ProjectiveMap, census: Census, progress: Callable[[str], None]) -> Census:
    import numpy as np

    p, count = census.prime, census.points
    # A code has the coordinates as base-p digits; its leading digit is 1. So codes are p^m, ..., 2 p^m - 1 for m <= n.
    codes = np.concatenate([np.arange(p**m, 2 * p**m) for m in range(census.dim + 1)])
    place_values = p ** np.arange(census.dim + 1)
    images = np.full(count + 1, count)  # the index `count` stands for an undefined image
    try:
        for k in range(0, count, space.batch_size):
            progress(f"p = {p}: the images of {k} of {count} points")
            image_codes = place_values @ space.images(codes[k : k + space.batch_size] // place_values[:, None] % p)
            images[k : k + len(image_codes)] = np.where(image_codes > 0, np.searchsorted(codes, image_codes), count)
    except TimeLimit:
        return replace(census, is_stopped=True)
    iterates = images
    for _ in range(count.bit_length()):  # doubles the number of steps; at the end all orbits are in cycles
        iterates = iterates[iterates]
    cyclic_points = np.setdiff1d(iterates, [count])
    lengths: Counter[int] = Counter()
    successors, is_seen = images.tolist(), bytearray(count)
    for point in cyclic_points.tolist():
        length = 0
        while not is_seen[point]:
            is_seen[point] = 1
            point = successors[point]
            length += 1
        lengths[length] += length > 0
    indeterminate, ending = (int((points[:count] == count).sum()) for points in (images, iterates))
    counts_by_kind = dict[str, Any](
        indeterminate=indeterminate,
        pre_indeterminate=ending - indeterminate,
        preperiodic=count - ending - len(cyclic_points),
    )
    return replace(census, complete=True, examined=count, lengths=dict(sorted((+lengths).items())), **counts_by_kind)


class _ProjectiveMap:
    """A map at one eps on P^n over GF(p). A point is a column of n + 1 residues, of which the last nonzero one is 1."""

    def __init__(self, map_: MapFamily, eps: fmpq, prime: int) -> None:
        if not 2 < prime < MAX_PRIME or map_.dim > MAX_DIMENSION:  # modulo 2 every Kahan map is the identity
            expected = f"an odd prime below {MAX_PRIME} and a dimension of at most {MAX_DIMENSION}"
            raise InputError(f"found the prime {prime} for a map of dimension {map_.dim}, expected {expected}")
        self.prime = prime
        self.batch_size = 1 << max(8, 18 - map_.dim)  # points in a batch; their minors should fit in a cache
        # For each factor: (False, a row of its forms) or (True, a matrix whose maximal minors are its forms), as terms.
        self.maps: list[tuple[bool, list[list[list[tuple[tuple[int, ...], int]]]]]] = []
        for factor in map_.at(eps, GF(prime)).factors:
            matrix, is_by_minors = factor.equation.polynomials(), False
            if factor.equation.explicit is not None:
                matrix = factor.equation.explicit.polynomials()
            elif map_.dim <= MAX_FACTORED and not (projective_map := homogeneous_map(factor)).factor.is_constant():
                matrix = [projective_map.forms]
            else:
                is_by_minors = True
            terms = [[[(tuple(map(int, m)), int(c)) for m, c in form.terms()] for form in row] for row in matrix]
            self.maps.append((is_by_minors, terms))

    def images(self, X: Any) -> Any:
        """Return the images of at most `batch_size` points (columns); a column of zeros is an undefined image."""
        p = self.prime
        for is_by_minors, matrix in self.maps:
            powers: dict[tuple[int, ...], Any] = {}
            for exponents in {exponents for row in matrix for form in row for exponents, _ in form}:
                monomial = X[0] ** 0
                for coordinate, exponent in zip(X, exponents, strict=True):
                    for _ in range(exponent):
                        monomial = monomial * coordinate % p
                powers[exponents] = monomial
            rows = [[sum(c * powers[m] % p for m, c in f) % p if f else None for f in row] for row in matrix]
            image = kernel_minors(rows, lambda a, b: a * b % p) if is_by_minors else rows[0]
            values = 0 * X
            for value, form in zip(values, image, strict=True):
                value += 0 if form is None else form % p
            X = self.normalized(values * X.any(axis=0))
        return X

    def normalized(self, X: Any) -> Any:
        """Divide each column by its last nonzero entry; columns of zeros are unchanged."""
        scale = X[0]
        for row in X[1:]:
            scale = row + scale * (row == 0)
        for bit in reversed(f"{self.prime - 2:b}"):  # 1/x = x^(p - 2), and 0 for x = 0
            X, scale = X * scale % self.prime if bit == "1" else X, scale * scale % self.prime
        return X


def default_eps(prime: int) -> list[fmpq]:
    """Return the first two eps of a fixed list that are defined, nonzero and different up to sign modulo the prime.

    The sign is ignored, since -eps gives the inverse map. For p > 5, values with eps^4 = 1 modulo p are omitted, since
    some maps are periodic only at such eps.

    >>> default_eps(101)
    [1/7, 2/11]
    """
    eps_by_residue: dict[int, fmpq] = {}
    for eps in map(rational, DEFAULT_EPS):
        if eps.p % prime and eps.q % prime:
            residue = int(GF(prime).convert(eps))
            if prime <= 5 or pow(residue, 4, prime) != 1:
                eps_by_residue.setdefault(min(residue, prime - residue), eps)
    return list(eps_by_residue.values())[:2]
