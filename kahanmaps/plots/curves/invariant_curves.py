"""Orbits of a Kahan map of the commuting family in the planes of its normal form, and their invariant cubics.

The data are computed here and plotted by `plot_invariant_curves.py`. Each real root of chi has a real plane with a
cubic Hamiltonian h and symplectic coordinates (u, v). In these coordinates h = kappa (u^3 - 3 u v^2) if h has three
real linear factors, and h = kappa (u^3 + 3 u v^2) if it has one. If h has a repeated factor, (u, v) are the coordinates
of `family show --normal-form`. A pair of complex roots has one plane, with the complex coordinates of the normal form
at the root with positive imaginary part.

Steps are computed with floating-point numbers of 256 bits, so that all plotted digits are correct. A point at a
distance below 2^-96 from infinity counts as a pole and ends the orbit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import RR, rational
from kahanmaps.algebra.printing import format_number
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import HypothesisError, InputError, counted
from kahanmaps.family.system_normal_form import NoNormalForm
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.plots.curves.plane_cubics import COMPLEX, Matrix, PlaneCubic, symmetric_coordinates, transform_cubic

MAX_POINTS = 1_000_000  # maximal number of points of all orbits together
MAX_STARTS = 7  # maximal number of initial points: the number of colors
BITS = 256  # precision of the floating-point numbers
_POLE_BITS = 96  # a point at a distance below 2^-96 from infinity counts as a pole
_PROGRESS_STEPS = 2_000  # number of steps between two progress messages
_MAX_COORDINATE = 1e60  # maximal coordinate in a picture: its cube does not overflow

Numbers = NDArray[Any]


@dataclass(frozen=True, eq=False)
class PlaneOrbit:
    """An orbit in one plane: its coordinates `u` and `v` at the steps 0, 1, ..., and the `cubic` that contains it.

    In a complex plane u and v are complex, and `cubic` is None.
    """

    u: Numbers
    v: Numbers
    cubic: PlaneCubic | None


@dataclass(frozen=True, eq=False)
class InvariantPlane:
    """A plane of the normal form: its root of chi (`root`, as text `root_text`), and an orbit for each initial point.

    `h` are the coefficients of the cubic Hamiltonian h(u, v), complex if the root is; `shape` describes h by a constant
    of `plane_cubics`. `index` is the index of the plane in the splitting, `block` the planar Kahan map in the
    coordinates (u, v), and `matrix` the 2 x 2 matrix that maps coordinates of the splitting to (u, v).
    """

    index: int
    root: complex
    root_text: str
    shape: str
    h: tuple[complex, complex, complex, complex]
    block: PlanarBlock
    matrix: Matrix
    orbits: tuple[PlaneOrbit, ...] = ()

    @property
    def is_real(self) -> bool:
        """Whether the root of chi is real: only a real plane contains a real cubic that can be plotted."""
        return self.root.imag == 0


@dataclass(frozen=True, eq=False)
class InvariantCurves:
    """The planes of a member with the orbits of all initial points; the real planes come first, by increasing root.

    `poles[k]` is the step at which the k-th orbit reaches a pole, or None if it completed `steps` steps. `originals[k]`
    is this orbit in the original variables, with a row for each step.
    """

    variables: tuple[str, ...]
    eps: fmpq
    steps: int
    planes: tuple[InvariantPlane, ...]
    originals: tuple[Numbers, ...]
    poles: tuple[int | None, ...]
    normal_form: str


def find_invariant_curves(
    file: SystemFile,
    starts: Sequence[Sequence[Any]],
    eps: Any,
    steps: int,
    progress: Callable[[str], None] = lambda _: None,
) -> InvariantCurves:
    """Compute the orbits of initial points in all planes of the normal form, and the cubics that contain the orbits.

    `starts` are exact points of the system, and `eps` is half the time step (exact). A system that is not declared as a
    member of the family is accepted if it is recognised as one. Raises HypothesisError if there is no normal form,
    since the system is not a member or chi has a repeated root. Raises InputError for invalid sizes.

    >>> from kahanmaps.documents.catalog import load
    >>> curves = find_invariant_curves(load("paper_m2"), [[1, 0, "1/2", 0]], "1/20", 100)
    >>> [plane.root_text for plane in curves.planes], curves.poles
    (['1', '2'], (None,))
    >>> orbit = curves.planes[0].orbits[0]
    >>> bool(abs(orbit.cubic.value(np.array([orbit.u[9], orbit.v[9]]))) < 1e-12)
    True
    """
    if not 1 <= len(starts) <= MAX_STARTS:
        raise InputError(f"found {len(starts)} initial points, expected 1 to {MAX_STARTS}")
    if steps < 0 or (steps + 1) * len(starts) > MAX_POINTS:
        raise InputError(
            f"found {steps} steps from {counted(len(starts), 'initial point')}, expected 0 or more steps and at most "
            f"{MAX_POINTS} points"
        )
    normal_form = file.normal_form
    if isinstance(normal_form, NoNormalForm):
        raise HypothesisError(
            f"{file.name} has no normal form whose planes could be drawn: {normal_form.reason}; expected a member of "
            "the family, declared or recognised, whose chi has no repeated root (see kahanmaps family show)"
        )
    epsilon = rational(eps)
    if epsilon == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    field = RR(BITS)
    splitting = Splitting(normal_form.form, field, epsilon, normal_form.T)
    with field.working():
        frames = _planes_without_orbits(splitting)
        orbits_by_start, originals, poles = [], [], []
        for number, start in enumerate(starts, 1):
            triples = splitting.triples([arb(rational(entry)) for entry in start])
            orbits: list[tuple[Numbers, Numbers]] = []
            curves: list[PlaneCubic | None] = []
            length, pole = steps + 1, None  # a pole in any of the planes ends the orbit
            for k, frame in enumerate(frames, 1):
                f, g, m, n = frame.matrix.entries()
                U, V, W = triples[frame.index]
                initial_triple = f * U + g * V, m * U + n * V, W
                label = f"start {number} of {len(starts)}" if len(starts) > 1 else "orbit"
                label = f"{label}: plane {k} of {len(frames)}"
                orbits.append(_compute_orbit(frame.block, initial_triple, epsilon, length, label, progress))
                if len(orbits[-1][0]) < length:
                    length = pole = len(orbits[-1][0])
                curves.append(_cubic_through(frame, initial_triple, epsilon) if frame.is_real else None)
            orbits = [(u[:length], v[:length]) for u, v in orbits]
            orbits_by_start.append([PlaneOrbit(u, v, cubic) for (u, v), cubic in zip(orbits, curves, strict=True)])
            # The orbit in the original variables, with a row for each step.
            points = np.zeros((length, splitting.dim))
            for frame, (u, v) in zip(frames, orbits, strict=True):
                a, b, c, d = (complex(_to_floating_point(entry)) for entry in frame.matrix.inv().entries())
                # For a complex plane the matrix of the splitting has separate columns for real and imaginary parts.
                zs = [a * u + b * v, c * u + d * v]
                columns = np.array([[float(entry) for entry in row] for row in splitting.matrix(frame.index)])
                real_parts = [x for z in zs for x in ((z.real, z.imag) if frame.root.imag else (z.real,))]
                points += np.stack(real_parts, axis=1) @ columns.T
            originals.append(points)
            poles.append(pole)
    planes = tuple(
        replace(frame, orbits=orbits) for frame, orbits in zip(frames, zip(*orbits_by_start, strict=True), strict=True)
    )
    return InvariantCurves(file.variables, epsilon, steps, planes, tuple(originals), tuple(poles), normal_form.text)


def _planes_without_orbits(splitting: Splitting) -> list[InvariantPlane]:
    """Return all planes without their orbits: the real planes by increasing root, then the complex planes."""
    rational_roots = [-factor[0] / factor[1] for factor, _ in splitting.form.chi.factor()[1] if factor.degree() == 1]
    frames = []
    for index, plane in enumerate(splitting.planes):
        root = plane.residue([arb(0), arb(1)])
        if isinstance(root, arb):
            exact_roots = [number for number in rational_roots if root.contains(arb(number))]
            text = format_number(exact_roots[0]) if exact_roots else f"{float(root.mid()):.5g}"
            shape, matrix = symmetric_coordinates(plane.block)
        else:
            # The real part is taken as 0 if its ball contains 0.
            real = 0.0 if root.real.contains(arb(0)) else float(root.real.mid())
            text = f"{real:.5g} +- {float(root.imag.mid()):.5g}i" if real else f"+-{float(root.imag.mid()):.5g}i"
            shape, matrix = COMPLEX, acb_mat([[1, 0], [0, 1]])
        coefficients = [entry.mid() for entry in transform_cubic(plane.block, matrix)]
        h = tuple(map(_to_floating_point, coefficients))
        if not np.isfinite(h).all():
            raise InputError(
                "the normal form leaves the range of floating-point numbers: its coefficients are too large to draw"
            )
        frames.append(
            InvariantPlane(index, complex(_to_floating_point(root)), text, shape, h, PlanarBlock(*coefficients), matrix)
        )
    return sorted(frames, key=lambda frame: (frame.root.imag != 0, frame.root.real, frame.root.imag))


def _compute_orbit(
    block: PlanarBlock, initial_triple: Triple, eps: fmpq, length: int, label: str, progress: Callable[[str], None]
) -> tuple[Numbers, Numbers]:
    """Return arrays of u and v at `length` points of an orbit; they are shorter if the orbit reaches a pole."""
    P = initial_triple
    us, vs = [], []
    time_step = 2 * arb(eps)
    pole_bound = max(abs(entry) for entry in (block.a, block.b, block.c, block.d)) * arb(2) ** -_POLE_BITS
    for k in range(length):
        U, V, W = P
        if k and abs(W) <= pole_bound * max(abs(U), abs(V)):
            break
        us.append(_to_floating_point(U / W / time_step))
        vs.append(_to_floating_point(V / W / time_step))
        P = block.image(P)
        norm = max(abs(entry) for entry in P)
        # The image of an indeterminacy point is undefined: the orbit ends at the next step, as at a pole.
        P = (U, V, W * 0) if norm == 0 else tuple((entry / norm).mid() for entry in P)
        if k % _PROGRESS_STEPS == 0:
            progress(f"{label}, step {k}")
    return np.array(us), np.array(vs)


def _cubic_through(frame: InvariantPlane, initial_triple: Triple, eps: fmpq) -> PlaneCubic:
    """Return the invariant cubic through the initial point.

    It is the level h/(1 + eps^2 D) = `numerator`/`denominator`, with D as in `plane_cubics`. Numerator and denominator
    are scaled such that the larger one is 1 or -1; both are 0 at a base point of the pencil of levels.
    """
    U, V, W = initial_triple
    time_step = 2 * arb(eps)
    u, v = U / W / time_step, V / W / time_step
    p, q, r = frame.block.D
    fraction_balls = frame.block.h(u, v), 1 + (p * U * U + q * U * V + r * V * V) / (W * W)
    fraction = [arb(0) if value.contains(arb(0)) else value for value in fraction_balls]
    scale = max(abs(value) for value in fraction)
    numerator, denominator = (float(value / scale) if scale > 0 else 0.0 for value in fraction)
    a, b, c, d = (entry.real for entry in frame.h)
    cubic = PlaneCubic((a, b, c, d), float(arb(eps)), numerator, denominator)
    coordinate_sizes = float(abs(u)), float(abs(v))
    largest = max(*map(abs, frame.h), *coordinate_sizes, cubic.length)
    smallest = min(cubic.length, max(coordinate_sizes) or cubic.length)
    if not 1 / _MAX_COORDINATE < smallest <= largest < _MAX_COORDINATE:
        raise InputError(
            f"found numbers from {smallest:.0e} to {largest:.0e} in the plane of lambda = {frame.root_text}, expected "
            f"{1 / _MAX_COORDINATE:.0e} to {_MAX_COORDINATE:.0e}: scale the initial point, the system or eps"
        )
    return cubic


def _to_floating_point(value: Any) -> Any:
    return complex(float(value.real.mid()), float(value.imag.mid())) if isinstance(value, acb) else float(value.mid())
