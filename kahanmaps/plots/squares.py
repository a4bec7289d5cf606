"""Pictures of whether two maps commute at one point x: Phi_f^i Phi_g^j x and Phi_g^j Phi_f^i x, computed exactly.

The square x, Phi_f x, Phi_g x has two candidates for its fourth corner, Phi_g(Phi_f x) and Phi_f(Phi_g x). In the
picture an arrow of f leads from Phi_f^i Phi_g^j x to Phi_f^(i+1) Phi_g^j x and ends in a dot; an arrow of g leads from
Phi_g^j Phi_f^i x to Phi_g^(j+1) Phi_f^i x and ends in a ring. If the maps commute, every ring contains a dot.
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
from kahanmaps.documents.files import SystemFile, match_variables
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.family.recognition import find_cubic_hamiltonian, find_family_structure
from kahanmaps.maps.floats.float_conversion import to_floats
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily, as_map
from kahanmaps.plots.curves.plane_cubics import Floats
from kahanmaps.plots.figures import drawing, escape_dollars, label_of, new_figure, wrap_text, write_beside
from kahanmaps.plots.portraits.windows import count_outside, window_of
from kahanmaps.plots.style import COLORS, Style
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_STEPS = 12  # maximal number of steps of each map
MAX_BITS = 300_000  # maximal number of bits of numerator and denominator of a coordinate: a step then takes seconds

Point = tuple[fmpq, ...]
Lattice = tuple[tuple[Point | None, ...], ...]  # [i][j]; None: indeterminacy point before, or numbers too long


@dataclass(frozen=True)
class MapPair:
    """Two maps to be compared. A system stands for its Kahan map; a second system with another eps is scaled.

    `names` are the names of the two maps in the picture. `note` says how their variables are matched if they differ.
    """

    f: QuadraticSystem | MapFamily
    g: QuadraticSystem | MapFamily
    names: tuple[str, str]
    note: str = ""


@dataclass(frozen=True, eq=False)
class Squares:
    """Lattices of points for a point x and maps F, G: `g_after_f[i][j]` is G^j(F^i x), `f_after_g[i][j]` is F^i(G^j x).

    `stop_reason` is a sentence that says why some points are missing; it is empty if none are missing.
    """

    pair: MapPair
    g_after_f: Lattice
    f_after_g: Lattice
    stop_reason: str

    @property
    def steps(self) -> int:
        """The number of times that each map is applied."""
        return len(self.g_after_f) - 1

    @property
    def compared(self) -> list[tuple[Point, Point]]:
        """The pairs of points with equal indices i, j > 0 in the two lattices, if both points exist."""
        rows = zip(self.g_after_f[1:], self.f_after_g[1:], strict=True)
        pairs = (pair for row, other_row in rows for pair in zip(row[1:], other_row[1:], strict=True))
        return [(p, q) for p, q in pairs if p is not None and q is not None]

    @property
    def closes(self) -> bool | None:
        """Whether the points of all pairs in `compared` are exactly equal; None if there are no pairs."""
        pairs = self.compared
        return all(p == q for p, q in pairs) if pairs else None

    @property
    def gap(self) -> float:
        """The largest Euclidean distance between the points of a pair in `compared`."""
        squares = [sum(((a - b) ** 2 for a, b in zip(*pair, strict=True)), fmpq(0)) for pair in self.compared]
        return float(arb(max(squares, default=fmpq(0))).sqrt().mid())

    @property
    def verdict(self) -> str:
        """The result as text: closes exactly, the size of the gap, or no fourth corner (nothing could be compared)."""
        if self.closes is None:
            return "no fourth corner"
        return "closes exactly" if self.closes else f"gap {self.gap:.3g}"


def squares(
    pair: MapPair, start: Sequence[Any], eps: Any, steps: int = 1, progress: Callable[[str], None] = lambda _: None
) -> Squares:
    """Apply each map `steps` times to an exact initial point, in both orders; `eps` is exact, half the time step.

    Raises InputError for an invalid number of steps or of coordinates.

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
    problems: list[str] = []

    def compute_orbit(phi: Map, first: Point | None, name: str) -> list[Point | None]:
        points = [first]
        for k in range(steps):
            progress(f"{name}, step {k + 1} of {steps}")
            image = None
            if points[-1] is not None:
                try:
                    image = tuple(phi.step(points[-1]))
                except SingularStep:
                    problems.append(f"{name}: the map is not defined at a point on the way")
            if image and max(entry.p.bit_length() + entry.q.bit_length() for entry in image) > MAX_BITS:
                problems.append(f"{name}: the coordinates have more than {MAX_BITS} bits")
                image = None
            points.append(image)
        return points

    along_f, along_g = compute_orbit(phi_f, x, "Phi_f"), compute_orbit(phi_g, x, "Phi_g")
    rows = [compute_orbit(phi_g, point, f"Phi_g after {i} times Phi_f") for i, point in enumerate(along_f)]
    columns = [compute_orbit(phi_f, point, f"Phi_f after {j} times Phi_g") for j, point in enumerate(along_g)]
    f_after_g = tuple(tuple(column[i] for column in columns) for i in range(steps + 1))
    return Squares(pair, tuple(map(tuple, rows)), f_after_g, problems[0] if problems else "")


def pairs_of_member(file: SystemFile) -> tuple[MapPair, MapPair]:
    """Return the two pairs of maps that are drawn for a member of the family: two associated systems, and a control.

    The first associated system is the member itself; the second has the opposite sign at the last factor of chi. The
    control is the pair J grad H_0, J grad H_1 with grad H_1 = A grad H_0 or, for m = 1, f = J grad H_0 and 2 f. Raises
    InputError unless the system is a member of the family, declared or recognised, in its own coordinates.
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
    """Return the pair of maps of two systems of equal dimension; `eps2` scales the second system by eps2/eps."""
    g: QuadraticSystem | MapFamily
    g, note = match_variables(file, other)
    if eps2 is not None:
        if not other.is_quadratic or not isinstance(g, KahanFamily):
            raise InputError(f"found eps2 with {other.map.kind}, expected it with a quadratic vector field")
        g = g.system
        if rational(eps2) == 0:
            raise InputError("found eps2 = 0, expected another number: at eps = 0 the Kahan map is the identity")
        g = g.scaled(rational(eps2) / rational(eps))
    return MapPair(file.map, g, ("f", "g"), note)


_F_COLOR, _G_COLOR, _GAP_COLOR = COLORS[1], COLORS[5], COLORS[0]
_MAX_COORDINATE = 1e150  # squares of larger numbers would overflow
_MIN_VISIBLE_GAP = 0.06  # fraction of the width of a panel; the picture of a smaller gap is magnified


def plot_squares(
    squares_of_pairs: Sequence[Squares],
    style: Style,
    axes: tuple[int, int] | None = None,
    captions: Sequence[str] = (),
) -> Figure:
    """Plot a panel for each pair of maps in the coordinates `axes`, by default those in which the squares are widest.

    `captions` replace the names of the maps above the panels. Raises InputError for invalid indices in `axes`, and for
    an initial point that is too large for a picture.
    """
    dim = squares_of_pairs[0].pair.f.dim
    if not all(np.isfinite(_to_table(squares.g_after_f)[0, 0]).all() for squares in squares_of_pairs):
        raise InputError(f"found an initial point with coordinates beyond {_MAX_COORDINATE:.0e}: it cannot be drawn")
    shown_axes = widest_axes(squares_of_pairs) if axes is None else axes
    if len(shown_axes) != 2 or not all(0 <= k < dim for k in shown_axes):
        raise InputError(f"found the variables {shown_axes}, expected two numbers from 0 to {dim - 1}")
    with drawing(style):
        from matplotlib.lines import Line2D

        letter_size = style.font_size * 2.54 / 72
        panel_width = style.width / max(len(squares_of_pairs), 1.25) - 4.2 * letter_size
        figure = new_figure(style, (panel_width + 10 * letter_size) / style.width)
        for k, panel in enumerate(figure.subplots(1, len(squares_of_pairs), squeeze=False).ravel()):
            caption = captions[k] if k < len(captions) else ""
            _draw_panel(panel, squares_of_pairs[k], shown_axes, caption, letter_size / panel_width, style)
        handles = [
            Line2D([], [], color=_F_COLOR, marker="o", markersize=3, label=r"$\Phi_f$"),
            Line2D([], [], color=_G_COLOR, marker="o", markersize=5.5, markerfacecolor="white", label=r"$\Phi_g$"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def widest_axes(squares_of_pairs: Sequence[Squares]) -> tuple[int, int]:
    """Return the two coordinates for which the smallest width among all squares and all gaps of corners is largest."""
    dim = squares_of_pairs[0].pair.f.dim
    if dim == 1:
        return 0, 0

    def score(pair: tuple[int, int]) -> float:
        widths = []
        for squares in squares_of_pairs:
            table = _to_table(squares.g_after_f)
            x, fx, gx = table[0, 0], table[-1, 0], table[0, -1]
            sides = np.stack([fx - x, gx - x])
            size = np.nanmax(np.abs(sides), initial=0.0)
            if np.isnan(sides).any() or size == 0:
                continue
            widths.append(np.linalg.svd(sides[:, pair] / size, compute_uv=False)[-1])
            if squares.closes is False:
                gaps = np.abs(table - _to_table(squares.f_after_g))
                widths.append(np.nanmax(gaps[..., pair], initial=0.0) / np.nanmax(gaps, initial=0.0))
        return float(min(widths, default=0.0))

    return max(combinations(range(dim), 2), key=score)


def _draw_panel(axes: Axes, squares: Squares, plane: tuple[int, int], caption: str, em: float, style: Style) -> None:
    """Draw one panel; `em` is the font size relative to the side of the panel."""
    gf, fg = _to_table(squares.g_after_f)[..., plane], _to_table(squares.f_after_g)[..., plane]
    all_points = np.concatenate([gf.reshape(-1, 2), fg.reshape(-1, 2)])
    all_points = all_points[np.isfinite(all_points).all(axis=1)]
    # Margins on each side, relative to the range of the points: space for names of corners, more of it in small panels.
    if squares.steps > 1:
        window = np.array(window_of(all_points, gf[0, 0][None]))
        space = np.array([[1.3 * em], [1.7 * em]])
        margins = np.maximum(0.12, space / (1 - 2 * np.minimum(0.36, space)))
    else:  # for one step all five points are shown
        window = np.array([all_points.min(axis=0), all_points.max(axis=0)]).T
        window[:, 1] += np.where(window[:, 0] < window[:, 1], 0, np.maximum(1e-9, np.abs(window[:, 1])))
        space = np.minimum(0.36, np.array([[3.2 * em], [2.5 * em]]))
        margins = np.maximum([[0.42], [0.36]], space / (1 - 2 * space))
    window = window + margins * np.diff(window, axis=1) * np.array([-1, 1])
    axes.set_box_aspect(1)
    variables = squares.pair.f.variables
    axes.set(xlim=window[0], ylim=window[1], xlabel=label_of(variables[plane[0]]), ylabel=label_of(variables[plane[1]]))
    axes.locator_params(nbins=5)
    if caption:
        equations = caption.replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")
        title = escape_dollars(wrap_text(equations, style.font_size / em, style.font_size))
        title = re.sub(r"\b([fg])(?=[:\xa0])", r"$\1$", title)
    else:
        f, g = (re.sub(r"^f_(.*)", r"f_{\1}", name).replace("grad ", r"\nabla ") for name in squares.pair.names)
        title = f"$f = {f}$,  $g = {g}$"
    outside_count = count_outside(all_points, tuple(map(tuple, window)))
    note = f"\n{outside_count} of {len(all_points)} points outside" if outside_count else ""
    axes.set_title(f"{title}\n{squares.verdict}{note}")
    _draw_lattices(axes, gf, fg)
    gap = (fg[-1, -1] - gf[-1, -1]) / np.diff(window, axis=1)[:, 0]
    is_small = bool(np.hypot(*gap) < _MIN_VISIBLE_GAP)
    if squares.steps == 1:
        corners = [(gf[0, 0], "$x$", ""), (gf[1, 0], r"$\Phi_f x$", ""), (gf[0, 1], r"$\Phi_g x$", "")]
        if squares.closes or (squares.closes is False and is_small):
            sign = "=" if squares.closes else r"\neq"
            corners.append((gf[1, 1], rf"$\Phi_g\Phi_f x {sign} \Phi_f\Phi_g x$", ""))
        else:  # the names of the last two corners are side by side
            sides = ("right", "left") if gf[1, 1, 0] < fg[1, 1, 0] else ("left", "right")
            corners += [(gf[1, 1], r"$\Phi_g\Phi_f x$", sides[0]), (fg[1, 1], r"$\Phi_f\Phi_g x$", sides[1])]
        center = np.nanmean(np.stack([point for point, _, _ in corners]), axis=0)
        for point, text, side in corners:
            _write_label(axes, point, text, center, em, side)
    else:
        _write_label(axes, gf[0, 0], "$x$", np.nanmean(all_points, axis=0), em)
    if squares.closes is False and is_small and np.any(gap != 0):
        _magnify(axes, gf, fg, all_points, window, style)


def _draw_lattices(axes: Axes, gf: Floats, fg: Floats) -> None:
    """Draw arrows (those of g end in rings, those of f in dots), and dotted lines where the maps do not commute."""
    from matplotlib.patches import FancyArrowPatch

    steps = len(gf) - 1
    width, size = (1.1, 5.5) if steps == 1 else (0.8, 4.0) if steps <= 4 else (0.5, 2.6)
    style: dict[str, Any] = {"arrowstyle": "-|>", "linewidth": width, "mutation_scale": 4 + 5 * width}
    style |= {"shrinkA": 2, "shrinkB": 2.5, "zorder": 2}
    for i in range(steps + 1):
        for j in range(steps + 1):
            arrows = [(gf[i, j], gf[i, j + 1], _G_COLOR)] if j < steps else []
            arrows += [(fg[i, j], fg[i + 1, j], _F_COLOR)] if i < steps else []
            for start, end, color in arrows:
                if np.isfinite([*start, *end]).all() and not np.array_equal(start, end):
                    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), color=color, **style))
            if not np.array_equal(gf[i, j], fg[i, j], equal_nan=True):
                ends = np.stack([gf[i, j], fg[i, j]])
                axes.plot(ends[:, 0], ends[:, 1], color=_GAP_COLOR, linestyle=":", linewidth=0.9, zorder=2)
    marker: dict[str, Any] = {"linestyle": "none", "marker": "o", "zorder": 3}
    rings, dots = gf.reshape(-1, 2), fg.reshape(-1, 2)
    axes.plot(*rings.T, color=_G_COLOR, markersize=size, markerfacecolor="white", markeredgewidth=0.8, **marker)
    axes.plot(*dots.T, color=_F_COLOR, markersize=0.5 * size, markeredgewidth=0, **{**marker, "zorder": 4})


def _magnify(axes: Axes, gf: Floats, fg: Floats, all_points: Floats, window: Floats, style: Style) -> None:
    """Draw both candidates for the last corner in the emptiest corner of the panel, magnified to be distinguishable."""
    lengths = np.diff(window, axis=1)[:, 0]
    relative_points = (all_points - window[:, 0]) / lengths
    if len(gf) == 2:  # the panel also contains the name of the last corner
        corner = (gf[-1, -1] - window[:, 0]) / lengths
        inwards, down = -np.sign(corner - 0.5)
        label_points = [corner + np.array([0.2 * k * inwards, -0.1 * down]) for k in range(4)]
        relative_points = np.concatenate([relative_points, np.array(label_points)])
    corners = [(x, y) for x in (0.04, 0.64) for y in (0.04, 0.64)]
    x, y = max(corners, key=lambda corner: np.hypot(*(relative_points - np.array(corner) - 0.16).T).min())
    inset = axes.inset_axes((x, y, 0.32, 0.32), zorder=7)
    ends = np.stack([gf[-1, -1], fg[-1, -1]])
    half_widths = 1.1 * (np.abs(ends[1] - ends[0]) / lengths).max() * lengths
    inset.set_xlim(ends[:, 0].mean() - half_widths[0], ends[:, 0].mean() + half_widths[0])
    inset.set_ylim(ends[:, 1].mean() - half_widths[1], ends[:, 1].mean() + half_widths[1])
    inset.set_xticks([])
    inset.set_yticks([])
    factor = rf"$\times {_in_two_digits(lengths[0] * 0.32 / (2 * half_widths[0]))}$"
    options: dict[str, Any] = {"xycoords": "axes fraction", "fontsize": style.smallest}
    write_beside(inset, factor, (0.04, 0.96), (0, 0), 1.5, va="top", zorder=8, **options)
    _draw_lattices(inset, gf[-2:, -2:], fg[-2:, -2:])
    inset.plot(*ends.T, color=_GAP_COLOR, linestyle=":", linewidth=0.9, zorder=2)


def _in_two_digits(number: float) -> str:
    """Format a positive number with two digits for a formula, such as 6.1 or 180, if necessary with a power of ten."""
    digits, power = f"{number:.1e}".split("e")
    return f"{float(f'{number:.2g}'):g}" if abs(int(power)) < 4 else rf"{digits}\cdot10^{{{int(power)}}}"


def _write_label(axes: Axes, point: Floats, text: str, center: Floats, em: float, side: str = "") -> None:
    """Write a text beside a point, away from `center`; a long text is above or below the point, inside of the panel.

    `side` is the alignment of a long text that has another long text beside it.
    """
    if not np.isfinite(point).all():
        return
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    low, length = limits[:, 0], limits[:, 1] - limits[:, 0]
    outward = (point - center) / length
    outward = outward / (np.hypot(*outward) or 1)
    x, y = point
    count = text.count("Phi")
    if count > 1:
        width = 1.6 * em * count
        ha = side or "center"
        left_part = {"left": 0.0, "center": width / 2, "right": width}[ha]
        share = (x - low[0]) / length[0]
        x = low[0] + length[0] * min(max(share, left_part + 0.02), max(left_part, 0.98 - width + left_part))
        offset = 0.0, 9.0 if outward[1] >= 0 else -9.0
    else:
        ha = "center" if abs(outward[0]) < 0.4 else "left" if outward[0] > 0 else "right"
        offset = 7 * outward[0], 7 * outward[1]
    va = "center" if abs(outward[1]) < 0.4 and count < 2 else "bottom" if outward[1] >= 0 else "top"
    write_beside(axes, text, (float(x), float(y)), offset, 2, ha=ha, va=va, zorder=5)


def _to_table(lattice: Lattice) -> Floats:
    """Return the points of a lattice in doubles; NaN for missing points, and for coordinates of at least 1e150."""
    missing = [float("nan")] * next(len(point) for row in lattice for point in row if point is not None)
    table = np.array([[missing if point is None else to_floats(point).tolist() for point in row] for row in lattice])
    return np.where(np.abs(table) < _MAX_COORDINATE, table, np.nan)
