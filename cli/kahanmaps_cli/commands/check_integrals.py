"""kahanmaps check-integrals."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.options import check_options, load_system, settings_from, system_options
from kahanmaps_cli.params import NameValue
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_report


@click.command("check-integrals")
@system_options
@click.option(
    "--integral",
    "integrals",
    type=NameValue(name_is_optional=True),
    multiple=True,
    metavar="[NAME=]EXPR",
    help="A claimed integral: a rational function of the variables and eps.",
)
@check_options
def command(system: str | None, integrals: tuple[tuple[str, str], ...], **options: Any) -> int:
    """Are the integrals of SYSTEM conserved by its Kahan map?  Without --eps the question is asked for every eps.

    Known ones: the modified Hamiltonian of Hamiltonian systems, in both normalisations of the paper, and for
    members of the family the K~ of all rational associated systems. Claimed ones: the [integrals] of the file, and
    --integral.

    \b
      kahanmaps check-integrals pair.toml
      kahanmaps check-integrals euler_top -p a1=1 -p a2=2 -p a3=-3
      kahanmaps check-integrals my.toml --integral 'I1=(x^2+y^2)/(1-eps^2*z^2)' --eps 1/10
      kahanmaps check-integrals --vars x,y --rhs y --rhs=-x --integral x^2+y^2

    Exit status: 0 conserved (proved or supported), 1 refuted, 2 wrong use, 3 undecided or stopped early.
    """
    from kahanmaps.algebra.text import parse_rational_function
    from kahanmaps.checks.conserve import check_integrals

    progress = Progress(options["quiet"])
    settings = settings_from(options, progress)
    file = load_system(system, options["variables"], options["rhs"], options["parameters"])
    extra = {
        name or f"I{k}": parse_rational_function(text, (*file.variables, "eps"), file.parameters)
        for k, (name, text) in enumerate(integrals, start=1)
    }
    report = check_integrals(file, settings, extra)
    progress.done()
    return print_report(report, options["as_json"], options["verbose"])
