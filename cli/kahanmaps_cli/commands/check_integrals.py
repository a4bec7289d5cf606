"""kahanmaps check-integrals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.options import check_options, integral_option, load_system, settings_from, system_options
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_report

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile


@click.command("check-integrals")
@system_options
@integral_option("A claimed integral: a rational function of the variables and eps.")
@check_options
def command(system: str | None, integrals: tuple[tuple[str, str], ...], **options: Any) -> int:
    """Are the integrals of SYSTEM conserved by its map?

    \b
      kahanmaps check-integrals paper_m3
      kahanmaps check-integrals euler_top -p a1=1 -p a2=2 -p a3=-3
      kahanmaps check-integrals my.toml --eps 1/10 \\
          --integral 'I1=(x^2+y^2)/(1-eps^2*z^2)'
      kahanmaps check-integrals --vars x,y --rhs y --rhs=-x --integral x^2+y^2

    Without --eps the question is asked for every eps.

    Known ones: the modified Hamiltonian of Hamiltonian systems, in both normalisations of the paper, and for
    members of the family the K~ of all rational associated systems. Claimed ones: the [integrals] of the file, and
    --integral.

    Exit status: 0 conserved (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early.
    """
    from kahanmaps.algebra.text import parse_rational_function
    from kahanmaps.checks.conserve import check_integrals

    with Progress(options["quiet"]) as progress:
        settings = settings_from(options, progress)
        file = load_system(system, options)
        names = file.claim_names
        extra = {name: parse_rational_function(text, names, file.parameters) for name, text in _named(integrals, file)}
        report = check_integrals(file, settings, extra)
    return print_report(report, options["as_json"], options["verbose"], options["quiet"])


def _named(integrals: Sequence[tuple[str, str]], file: SystemFile) -> list[tuple[str, str]]:
    """The claims with their names; those without one are called I1, I2, ..., as far as these are free.

    The bare name of an integral of the file adds nothing: all of these are checked anyway.
    """
    integrals = [(name, text) for name, text in integrals if name or text not in file.integrals]
    taken = [*file.integrals, *(name for name, _ in integrals if name)]
    for name in taken:
        if taken.count(name) > 1:
            raise click.UsageError(f"found two integrals of the name {name}, expected a name of its own for each")
    free = (f"I{k}" for k in count(1) if f"I{k}" not in taken)
    return [(name or next(free), text) for name, text in integrals]
