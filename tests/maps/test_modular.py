"""Many orbits modulo a prime at once.

Specified here: points, and where orbits end, are those of the exact orbit over GF(p), for every kernel and both ways of
stepping; the arithmetic under it is right at the edges of what its doubles can hold.
"""

import random

import numpy as np
import pytest
from flint import fmpq_poly
from helpers import EULER_TOP, FORCED_PLANE, HENON_HEILES, LORENZ, LOTKA_VOLTERRA, quick

from kahanmaps.algebra.fields import GF
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.planar import normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits.iteration import Orbit
from kahanmaps.maps.residues.ensemble import ModularEnsemble, ResidueArithmetic, _split
from kahanmaps.maps.residues.numba_kernel import kernels

MERSENNE = 2**61 - 1
over_kernels = pytest.mark.parametrize("kernel", ["numpy", "numba"])


@pytest.fixture(autouse=True)
def _numba_where_it_is_asked_for(request):
    if "numba" in request.node.name:
        pytest.importorskip("numba")


SPLIT = draw_with_eigenvalues([1, -2], seed=7)
MEMBERS = {
    "1,-2": SPLIT,
    "1,-2,3": draw_with_eigenvalues([1, -2, 3], seed=3),
    "t^2 + 1": draw_with_chi(fmpq_poly([1, 0, 1]), seed=5),
}
FORMS = {name: normal_form(member) for name, member in MEMBERS.items()}


def exact(system, eps, start, prime, steps, backward=False):
    """The last point, its index and whether the orbit ended there, by exact steps over GF(p)."""
    orbit = Orbit(KahanMap(system, eps, GF(prime)), start, steps, backward=backward)
    *_, last = orbit
    return [int(entry) for entry in last.x], last.step, orbit.end.status == "singular"


def assert_exact(ensemble, system, eps, starts, steps, backward=False):
    taken = np.where(ensemble.singular_at < 0, ensemble.steps, ensemble.singular_at)
    x, at, counts = ensemble.x.tolist(), ensemble.singular_at.tolist(), taken.tolist()
    ended = 0
    for i, start in enumerate(starts):
        point, index, singular = exact(system, eps, start, ensemble.prime, steps, backward)
        assert (x[i], counts[i]) == (point, index)
        assert at[i] == (index if singular else -1)
        assert ensemble.status[i] == ("singular" if singular else "completed")
        ended += singular
    return ended


def random_starts(rng, prime, dim, count):
    return [[rng.randrange(prime) for _ in range(dim)] for _ in range(count)]


@over_kernels
@pytest.mark.parametrize(
    "prime",
    quick([3, 5, 7, 31, 101, 65_537, 2**31 - 1, 2**31 + 11, 2**60 + 33, MERSENNE], [3, 31, 2**31 + 11, MERSENNE]),
)
@pytest.mark.parametrize("name", MEMBERS)
def test_orbits_of_members_are_the_exact_ones_and_end_where_those_end(name, prime, kernel):
    system, form, rng = MEMBERS[name].chosen.system, FORMS[name], random.Random(prime)
    try:
        KahanMap(system, "1/11", GF(prime))
    except BadPrime:
        pytest.skip("no reduction")
    starts = random_starts(rng, prime, form.dim, 40)
    for given in (form, None):
        ensemble = ModularEnsemble(system, "1/11", starts, prime, form=given, kernel=kernel)
        ensemble.advance(3)
        ensemble.advance(9)
        ended = assert_exact(ensemble, system, "1/11", starts, 12)
        assert ended > 0 or prime > 101
        assert ended < 40 or prime < 7
        assert (ensemble.steps, ensemble.kernel, len(ensemble)) == (12, kernel, 40)


@over_kernels
@pytest.mark.parametrize(
    "system", [LOTKA_VOLTERRA, LORENZ, HENON_HEILES, EULER_TOP, FORCED_PLANE], ids=["LV", "L", "HH", "ET", "FP"]
)
@pytest.mark.parametrize("prime", [11, 2**31 - 1, MERSENNE])
def test_orbits_of_any_quadratic_system_are_the_exact_ones_forward_and_backward(system, prime, kernel):
    starts = random_starts(random.Random(prime), prime, system.dim, 30)
    for backward in (False, True):
        ensemble = ModularEnsemble(system, "1/7", starts, prime, kernel=kernel, backward=backward)
        ensemble.advance(10)
        assert ensemble.method == "elimination"
        assert_exact(ensemble, system, "1/7", starts, 10, backward)


@pytest.mark.parametrize(("prime", "is_used"), [(2, False), (3, True), (7, True)])
def test_modulo_2_planes_are_not_used_for_their_coordinates_are_zero(prime, is_used):
    field = GF(prime)
    assert (_split(normal_form(draw_with_eigenvalues([0, 1], 1)), field, field.one) is not None) == is_used


def test_the_planes_are_used_where_chi_splits_and_else_the_elimination():
    system, form = MEMBERS["t^2 + 1"].chosen.system, FORMS["t^2 + 1"]
    starts = random_starts(random.Random(1), 29, 4, 3)
    assert ModularEnsemble(system, 1, starts, 29, form=form, kernel="numpy").method == "planes"
    assert ModularEnsemble(system, 1, starts, 31, form=form, kernel="numpy").method == "elimination"
    # 1 = -2 modulo 3.
    assert (
        ModularEnsemble(SPLIT.chosen.system, 1, starts, 3, form=FORMS["1,-2"], kernel="numpy").method == "elimination"
    )


def test_modulo_2_there_is_one_kernel():
    system = LORENZ.scaled(3)
    starts = [[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    ensemble = ModularEnsemble(system, 3, starts, 2)
    ensemble.advance(4)
    assert ensemble.kernel == "numpy"
    assert_exact(ensemble, system, 3, starts, 4)


def test_threads_share_the_orbits_among_them_numba():
    system, form = SPLIT.chosen.system, FORMS["1,-2"]
    x = np.random.default_rng(1).integers(0, 97, (101, 4))
    for given in (form, None):
        one = ModularEnsemble(system, "1/10", x, 97, form=given, kernel="numba")
        three = ModularEnsemble(system, "1/10", x, 97, form=given, kernel="numba", threads=3)
        for ensemble in (one, three):
            ensemble.advance(4)
            ensemble.advance(5)
        assert one.x.tolist() == three.x.tolist()
        assert one.singular_at.tolist() == three.singular_at.tolist()
    with pytest.raises(InputError, match="0 threads"):
        ModularEnsemble(system, "1/10", x, 97, threads=0)


WRONG = [
    ({"prime": 2**61 + 15}, "62 bits"),
    ({"prime": 91}, "composite"),
    ({"kernel": "fortran"}, "numpy or numba"),
    ({"starts": [[1, 2]]}, "2 coordinates"),
    ({"starts": np.array([[1, 2]])}, "shape"),
    ({"form": FORMS["1,-2,3"]}, "belongs to another system"),
    ({"eps": 0}, "eps = 0"),
    ({"eps": 101}, "divides"),
    ({"eps": 0.5}, "0.5"),
]


@pytest.mark.parametrize(("change", "sentence"), WRONG)
def test_what_cannot_be_done_is_refused_with_a_reason(change, sentence):
    given = {"starts": [[1, 2, 3, 4]], "eps": "1/10", "prime": 101, "form": None, "kernel": "numpy"} | change
    with pytest.raises(InputError, match=sentence):
        ModularEnsemble(
            SPLIT.chosen.system,
            given["eps"],
            given["starts"],
            given["prime"],
            form=given["form"],
            kernel=given["kernel"],
        )


# Arithmetic.

PRIMES = [3, 101, 2**31 - 1, 2**31 + 11, 2**32 - 5, 2**45 - 55, 2**52 - 47, 2**53 - 111, 2**60 - 93, MERSENNE]


def hard(prime, rng, count):
    """Residues, many of them near the ends, near p/2, and near multiples of 2^31."""
    near = [0, prime - 1, prime // 2, 2**31, 2**31 - 1, (prime >> 31) << 31, ((prime >> 31) << 31) - 1, 2**52, 2**53]
    chosen = [(rng.choice(near) + rng.randint(-2, 2)) % prime if rng.random() < 0.6 else rng.randrange(prime)]
    for _ in range(count - 1):
        chosen.append((rng.choice(near) + rng.randint(-2, 2)) % prime if rng.random() < 0.6 else rng.randrange(prime))
    return chosen


@pytest.mark.parametrize("prime", PRIMES)
def test_sums_of_products_are_exact_also_at_the_ends(prime):
    rng, arithmetic = random.Random(prime), ResidueArithmetic(prime)
    for terms in (1, 2, 3, 4):
        columns = [hard(prime, rng, 1_500) for _ in range(2 * terms)]
        arrays = [arithmetic.array(column) for column in columns]
        lefts, rights = map(arithmetic.left, arrays[::2]), map(arithmetic.right, arrays[1::2])
        found = arithmetic.dot(*zip(lefts, rights, strict=True)).tolist()
        pairs = list(zip(columns[::2], columns[1::2], strict=True))
        expected = [sum(a[i] * b[i] for a, b in pairs) % prime for i in range(1_500)]
        assert found == expected


@pytest.mark.parametrize("prime", PRIMES)
def test_compiled_products_are_exact_too_numba(prime):
    _, _, inner_product = kernels()
    rng = random.Random(prime)
    n, R = np.uint64(-pow(prime, -1, 2**64) % 2**64), 2**64
    rows, x = hard(prime, rng, 1000), hard(prime, rng, 4)
    for first in range(0, 1000, 4):
        row = rows[first : first + 4]
        found = int(inner_product(np.array(row, np.uint64), np.array(x, np.uint64), np.uint64(prime), n))
        assert found * R % prime == sum(a * b for a, b in zip(row, x, strict=True)) % prime
        assert found < prime
