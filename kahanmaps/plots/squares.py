"""Do two Kahan maps commute, seen from one point: the lattice Phi_f^i Phi_g^j x, reached along both orders. Exact.

The square x, Phi_f x, Phi_g x has two candidates for its fourth corner, Phi_g(Phi_f x) and Phi_f(Phi_g x). In the
picture arrows of f start from points reached by g first, arrows of g from points reached by f first; a ring marks where
g ends, a dot where f does. Where the maps commute every ring holds its dot.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import arb, fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.documents.files import SystemFile, matched
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.family.recognition import find_cubic_hamiltonian, find_family_structure
from kahanmaps.maps.floats.float_conversion import to_floats
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily, as_map
from kahanmaps.plots.curves.plane_cubics import Floats
from kahanmaps.plots.figures import drawing, label_of, new_figure, plain, wrapped, write_beside
from kahanmaps.plots.portraits.windows import outside, window_of
from kahanmaps.plots.style import COLORS, Style
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_STEPS = 12
MAX_BITS = 300_000  # of the numerators and denominators of one coordinate: seconds for a step

Point = tuple[fmpq, ...]
Lattice = tuple[tuple[Point | None, ...], ...]  # [i][j], None where a map has no value or numbers are too long


@dataclass(frozen=True)
class MapPair:
    """Two maps that are compared, systems standing for theirs; the second is scaled where it has another step.

    `names` are short texts, `note` says how variables are matched, where that needs a word.
    """

    f: QuadraticSystem | MapFamily
    g: QuadraticSystem | MapFamily
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

    def orbit(phi: Map, first: Point | None, name: str) -> list[Point | None]:
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
        hamiltonian = file.hamiltonian or find_cubic_hamiltonian(file.system)
        recognised = None if hamiltonian is None else find_family_structure(hamiltonian)
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
    g: QuadraticSystem | MapFamily
    g, note = matched(file, other)
    if eps2 is not None:
        if not other.is_quadratic or not isinstance(g, KahanFamily):
            raise InputError(f"found eps2 with {other.map.kind}, expected a quadratic vector field, which it scales")
        g = g.system
        if rational(eps2) == 0:
            raise InputError("found eps2 = 0, expected another number: at eps = 0 the Kahan map is the identity")
        g = g.scaled(rational(eps2) / rational(eps))
    return MapPair(file.map, g, ("f", "g"), note)


_F, _G, _GAP = COLORS[1], COLORS[5], COLORS[0]
_LARGEST = 1e150  # what can be squared
_SEEN = 0.06  # of the width of a panel: a gap below it is shown magnified


def plot_squares(
    found: Sequence[Squares],
    style: Style,
    axes: tuple[int, int] | None = None,
    captions: Sequence[str] = (),
) -> Figure:
    """One panel for each pair of maps, in two coordinates: those given, or those in which the squares are widest.

    `captions` stand above the panels, in place of the names of the maps. Raises InputError for numbers that are none of
    variables, and for a start beyond the range of what can be drawn.
    """
    dim = found[0].pair.f.dim
    if not all(np.isfinite(_table(squares.g_after_f)[0, 0]).all() for squares in found):
        raise InputError(f"found a start with coordinates beyond {_LARGEST:.0e}: it cannot be drawn")
    chosen = widest_axes(found) if axes is None else axes
    if len(chosen) != 2 or not all(0 <= k < dim for k in chosen):
        raise InputError(f"found the variables {chosen}, expected two numbers from 0 to {dim - 1}")
    with drawing(style):
        from matplotlib.lines import Line2D

        letter = style.font_size * 2.54 / 72
        side = style.width / max(len(found), 1.25) - 4.2 * letter
        figure = new_figure(style, (side + 10 * letter) / style.width)
        for k, panel in enumerate(figure.subplots(1, len(found), squeeze=False).ravel()):
            caption = captions[k] if k < len(captions) else ""
            _draw(panel, found[k], chosen, caption, letter / side, style)
        handles = [
            Line2D([], [], color=_F, marker="o", markersize=3, label=r"$\Phi_f$"),
            Line2D([], [], color=_G, marker="o", markersize=5.5, markerfacecolor="white", label=r"$\Phi_g$"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def widest_axes(found: Sequence[Squares]) -> tuple[int, int]:
    """The two coordinates in which the thinnest of the squares is thickest, and a gap is seen if there is one."""
    dim = found[0].pair.f.dim
    if dim == 1:
        return 0, 0

    def score(pair: tuple[int, int]) -> float:
        widths = []
        for squares in found:
            table = _table(squares.g_after_f)
            x, fx, gx = table[0, 0], table[-1, 0], table[0, -1]
            sides = np.stack([fx - x, gx - x])
            size = np.nanmax(np.abs(sides), initial=0.0)
            if np.isnan(sides).any() or size == 0:
                continue
            widths.append(np.linalg.svd(sides[:, pair] / size, compute_uv=False)[-1])
            if squares.closes is False:
                gaps = np.abs(table - _table(squares.f_after_g))
                widths.append(np.nanmax(gaps[..., pair], initial=0.0) / np.nanmax(gaps, initial=0.0))
        return float(min(widths, default=0.0))

    return max(combinations(range(dim), 2), key=score)


def _draw(axes: Axes, squares: Squares, chosen: tuple[int, int], caption: str, letter: float, style: Style) -> None:
    """One panel; `letter` is the size of the letters in units of its side."""
    one, other = _table(squares.g_after_f)[..., chosen], _table(squares.f_after_g)[..., chosen]
    every = np.concatenate([one.reshape(-1, 2), other.reshape(-1, 2)])
    every = every[np.isfinite(every).all(axis=1)]
    # Margins on each side, in units of the range of the points: the names of corners need room, more in small panels.
    if squares.steps > 1:
        window = np.array(window_of(every, one[0, 0][None]))
        needed = np.array([[1.3 * letter], [1.7 * letter]])
        margins = np.maximum(0.12, needed / (1 - 2 * np.minimum(0.36, needed)))
    else:  # five points, all of which are wanted
        window = np.array([every.min(axis=0), every.max(axis=0)]).T
        window[:, 1] += np.where(window[:, 0] < window[:, 1], 0, np.maximum(1e-9, np.abs(window[:, 1])))
        needed = np.minimum(0.36, np.array([[3.2 * letter], [2.5 * letter]]))
        margins = np.maximum([[0.42], [0.36]], needed / (1 - 2 * needed))
    window = window + margins * np.diff(window, axis=1) * np.array([-1, 1])
    axes.set_box_aspect(1)
    variables = squares.pair.f.variables
    axes.set(
        xlim=window[0], ylim=window[1], xlabel=label_of(variables[chosen[0]]), ylabel=label_of(variables[chosen[1]])
    )
    axes.locator_params(nbins=5)
    if caption:
        equations = caption.replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")
        title = plain(wrapped(equations, style.font_size / letter, style.font_size))
        title = re.sub(r"\b([fg])(?=[:\xa0])", r"$\1$", title)
    else:
        f, g = (re.sub(r"^f_(.*)", r"f_{\1}", name).replace("grad ", r"\nabla ") for name in squares.pair.names)
        title = f"$f = {f}$,  $g = {g}$"
    beyond = outside(every, tuple(map(tuple, window)))
    note = f"\n{beyond} of {len(every)} points outside" if beyond else ""
    axes.set_title(f"{title}\n{squares.verdict}{note}")
    _draw_lattices(axes, one, other)
    gap = (other[-1, -1] - one[-1, -1]) / np.diff(window, axis=1)[:, 0]
    is_small = bool(np.hypot(*gap) < _SEEN)
    if squares.steps == 1:
        corners = [(one[0, 0], "$x$", ""), (one[1, 0], r"$\Phi_f x$", ""), (one[0, 1], r"$\Phi_g x$", "")]
        if squares.closes or (squares.closes is False and is_small):
            sign = "=" if squares.closes else r"\neq"
            corners.append((one[1, 1], rf"$\Phi_g\Phi_f x {sign} \Phi_f\Phi_g x$", ""))
        else:  # the names of the last two corners stand side by side
            sides = ("right", "left") if one[1, 1, 0] < other[1, 1, 0] else ("left", "right")
            corners += [(one[1, 1], r"$\Phi_g\Phi_f x$", sides[0]), (other[1, 1], r"$\Phi_f\Phi_g x$", sides[1])]
        middle = np.nanmean(np.stack([point for point, _, _ in corners]), axis=0)
        for point, text, side in corners:
            _label(axes, point, text, middle, letter, side)
    else:
        _label(axes, one[0, 0], "$x$", np.nanmean(every, axis=0), letter)
    if squares.closes is False and is_small and np.any(gap != 0):
        _magnify(axes, one, other, every, window, style)


def _draw_lattices(axes: Axes, one: Floats, other: Floats) -> None:
    """Arrows, rings where steps of g end, dots where steps of f end, and dotted lines across the gaps."""
    from matplotlib.patches import FancyArrowPatch

    steps = len(one) - 1
    width, size = (1.1, 5.5) if steps == 1 else (0.8, 4.0) if steps <= 4 else (0.5, 2.6)
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "linewidth": width, "mutation_scale": 4 + 5 * width}
    arrow |= {"shrinkA": 2, "shrinkB": 2.5, "zorder": 2}
    for i in range(steps + 1):
        for j in range(steps + 1):
            arrows = [(one[i, j], one[i, j + 1], _G)] if j < steps else []
            arrows += [(other[i, j], other[i + 1, j], _F)] if i < steps else []
            for start, end, color in arrows:
                if np.isfinite([*start, *end]).all() and not np.array_equal(start, end):
                    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), color=color, **arrow))
            if not np.array_equal(one[i, j], other[i, j], equal_nan=True):
                ends = np.stack([one[i, j], other[i, j]])
                axes.plot(ends[:, 0], ends[:, 1], color=_GAP, linestyle=":", linewidth=0.9, zorder=2)
    ring: dict[str, Any] = {"linestyle": "none", "marker": "o", "zorder": 3}
    rings, dots = one.reshape(-1, 2), other.reshape(-1, 2)
    axes.plot(*rings.T, color=_G, markersize=size, markerfacecolor="white", markeredgewidth=0.8, **ring)
    axes.plot(*dots.T, color=_F, markersize=0.5 * size, markeredgewidth=0, **{**ring, "zorder": 4})


def _magnify(axes: Axes, one: Floats, other: Floats, every: Floats, window: Floats, style: Style) -> None:
    """The last corners once more, as large as it takes to see that they are two; in the emptiest corner."""
    lengths = np.diff(window, axis=1)[:, 0]
    inside = (every - window[:, 0]) / lengths
    if len(one) == 2:  # the name of the last corner is there as well
        corner = (one[-1, -1] - window[:, 0]) / lengths
        inwards, down = -np.sign(corner - 0.5)
        name = [corner + np.array([0.2 * k * inwards, -0.1 * down]) for k in range(4)]
        inside = np.concatenate([inside, np.array(name)])
    places = [(x, y) for x in (0.04, 0.64) for y in (0.04, 0.64)]
    x, y = max(places, key=lambda place: np.hypot(*(inside - np.array(place) - 0.16).T).min())
    inset = axes.inset_axes((x, y, 0.32, 0.32), zorder=7)
    ends = np.stack([one[-1, -1], other[-1, -1]])
    half = 1.1 * (np.abs(ends[1] - ends[0]) / lengths).max() * lengths
    inset.set_xlim(ends[:, 0].mean() - half[0], ends[:, 0].mean() + half[0])
    inset.set_ylim(ends[:, 1].mean() - half[1], ends[:, 1].mean() + half[1])
    inset.set_xticks([])
    inset.set_yticks([])
    factor = rf"$\times {_in_two_digits(lengths[0] * 0.32 / (2 * half[0]))}$"
    how: dict[str, Any] = {"xycoords": "axes fraction", "fontsize": style.smallest}
    write_beside(inset, factor, (0.04, 0.96), (0, 0), 1.5, va="top", zorder=8, **how)
    _draw_lattices(inset, one[-2:, -2:], other[-2:, -2:])
    inset.plot(*ends.T, color=_GAP, linestyle=":", linewidth=0.9, zorder=2)


def _in_two_digits(number: float) -> str:
    """A positive number for a formula: 6.1, 180, or with a power of ten."""
    digits, power = f"{number:.1e}".split("e")
    return f"{float(f'{number:.2g}'):g}" if abs(int(power)) < 4 else rf"{digits}\cdot10^{{{int(power)}}}"


def _label(axes: Axes, point: Floats, text: str, middle: Floats, letter: float, side: str = "") -> None:
    """A text beside a point, away from the middle of them all; long ones above or below, moved so as to stay inside.

    `side` says how a long one is aligned, to which there is another one beside it.
    """
    if not np.isfinite(point).all():
        return
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    low, length = limits[:, 0], limits[:, 1] - limits[:, 0]
    away = (point - middle) / length
    away = away / (np.hypot(*away) or 1)
    x, y = point
    maps = text.count("Phi")
    if maps > 1:
        width = 1.6 * letter * maps
        aligned = side or "center"
        before = {"left": 0.0, "center": width / 2, "right": width}[aligned]
        across = (x - low[0]) / length[0]
        x = low[0] + length[0] * min(max(across, before + 0.02), max(before, 0.98 - width + before))
        offset = 0.0, 9.0 if away[1] >= 0 else -9.0
    else:
        aligned = "center" if abs(away[0]) < 0.4 else "left" if away[0] > 0 else "right"
        offset = 7 * away[0], 7 * away[1]
    raised = "center" if abs(away[1]) < 0.4 and maps < 2 else "bottom" if away[1] >= 0 else "top"
    write_beside(axes, text, (float(x), float(y)), offset, 2, ha=aligned, va=raised, zorder=5)


def _table(lattice: Lattice) -> Floats:
    """The points as floating-point numbers, nan where there is none or it is too large for them."""
    missing = [float("nan")] * next(len(point) for row in lattice for point in row if point is not None)
    found = np.array([[missing if point is None else to_floats(point).tolist() for point in row] for row in lattice])
    return np.where(np.abs(found) < _LARGEST, found, np.nan)
