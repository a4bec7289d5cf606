"""kahanmaps plot invariant-curves."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import eps_options, load_system, requested_eps, system_options
from kahanmaps_cli.params import PointText
from kahanmaps_cli.pictures.output import Drawing, picture, two_variables
from kahanmaps_cli.screen.progress import Progress


@picture(
    "invariant-curves",
    system_options,
    click.option(
        "--start",
        "starts",
        type=PointText(),
        metavar="X",
        multiple=True,
        required=True,
        help="Initial point of an orbit. Repeatable.",
    ),
    eps_options,
    click.option(
        "--steps", type=int, metavar="N", default=120, show_default=True, help="Number of steps of each orbit."
    ),
    click.option("--original", metavar="X,Y", help="Add a panel of the orbits in two variables of SYSTEM."),
    click.option(
        "--projective", is_flag=True, help="Draw each projective plane as a disc whose rim is the line at infinity."
    ),
    click.option("--flow", is_flag=True, help="Add orbits of the differential equation, dashed."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawing:
    """Draw the invariant curves of a member of the commuting family, plane by plane.

    \b
      kahanmaps plot invariant-curves paper_m2 --start 1/2,-1/3,0,1 --eps 1/10 \\
          -o curves.pdf
      kahanmaps plot invariant-curves paper_m3 --start 1,0,1/2,0,1/3,1 \\
          --eps 1/20 --original x1,x2 -o product.pdf
      kahanmaps plot invariant-curves paper_m2 --start 1,0,1/2,0 \\
          --start 1/2,-1/3,0,1 --eps 1/20 --projective -o curves.svg
      kahanmaps plot invariant-curves paper_m3_irreducible \\
          --start 1,0,1/2,0,1/3,1 --eps 1/20 -o generic.png

    The normal form of the Kahan map of a member is a product of planar maps, one for each root of chi, and each planar
    orbit lies on a cubic curve. Dots are colored by the step, in the same way in all panels.

    A real root has a real plane with symplectic coordinates u, v in which the Hamiltonian is kappa (u^3 - 3 u v^2) or
    kappa (u^3 + 3 u v^2). A pair of complex roots has one complex plane; u and v have a panel each, without a curve.
    The system need not be declared as a member. If chi has a repeated root, there are no such planes.

    Exit status: 0 done, 2 usage error or no normal form, 3 an orbit met an indeterminacy point (the picture shows the
    orbit up to there).
    """
    file = load_system(options["system"], options)
    eps = requested_eps(options["eps"], options["time_step"], required=file.is_quadratic)
    original = two_variables("--original", options["original"], file.variables)
    curves = lib.find_invariant_curves(file, options["starts"], eps, options["steps"], progress)
    texts = [lib.format_point(start) for start in options["starts"]]
    labels = [f"start {text if len(text) <= 30 else text[:30] + '...'}" for text in texts]
    figure = lib.plot_invariant_curves(
        curves, options["style"], options["projective"], options["flow"], original, labels
    )
    messages = [f"{curves.normal_form}; {lib.eps_phrase(lib.eps_record(curves.eps))}"]
    for k, pole in enumerate(curves.poles, 1):
        if pole is not None:
            orbit_text = f"start {k}: " if len(curves.poles) > 1 else ""
            messages.append(f"{orbit_text}the orbit ends before step {pole}: a pole, or closer to one than 2^-96")
    for plane in curves.planes:
        if plane.shape == "0":
            messages.append(f"lambda = {plane.root_text}: h = 0, so that every point of this plane is fixed")
    outside_texts = [
        f"{view.outside} ({'' if column == 'uv' else column + ', '}lambda = {plane.root_text})"
        for _, plane, column in lib.panels_of(curves)
        if not options["projective"] and (view := lib.view_of(plane, column)).outside
    ]
    if outside_texts:
        messages.append(f"dots outside the windows: {', '.join(outside_texts)}; --projective shows all of them")
    is_complete = all(pole is None for pole in curves.poles)
    return Drawing(figure, file, messages, 0 if is_complete else 3)
