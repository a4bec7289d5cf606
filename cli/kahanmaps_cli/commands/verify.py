"""kahanmaps verify."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.draw import DRAWN, draw_options, drawn_file
from kahanmaps_cli.runs.verify_table import print_verification
from kahanmaps_cli.screen.progress import Progress


@click.command("verify")
@opt.system_argument
@opt.parameter_option
@draw_options
@opt.eps_options
@click.option("--universal", is_flag=True, help="Not one member: everything at random over GF(p), for every member.")
@click.option(
    "--beyond", is_flag=True, help="A table of what survives for other H, J, steps and A, with counterexamples."
)
@click.option("--controls", is_flag=True, help="Run every claim on input that breaks one hypothesis: it has to fail.")
@click.option(
    "--section",
    "sections",
    type=int,
    metavar="N",
    multiple=True,
    help="Only this section (1 to 9; 10: beyond the paper). Repeatable.",
)
@click.option(
    "--order",
    type=int,
    metavar="N",
    default=3,
    show_default=True,
    help="Order in eps^2 of the series of the integrals.",
)
@click.option("--balls", "ball_bits", type=int, metavar="BITS", help="Also over complex balls, all roots enclosed.")
@opt.evidence_options
@click.option("--markdown", "as_markdown", is_flag=True, help="The table in Markdown.")
@opt.verbose_option
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """Every statement of the paper of Petrera and Suris, put to the test for a member of its family.

    \b
      kahanmaps verify                        # a random member with m = 3
      kahanmaps verify paper_m3
      kahanmaps verify --m 4 --generic --seed 2          # chi irreducible over Q
      kahanmaps verify --chi '(t-1)*(t^2+1)' --balls 128
      kahanmaps verify --universal --m 3      # theorems for the generic member
      kahanmaps verify --controls --section 6            # what makes it fail
      kahanmaps verify --m 2 --json | jq '.claims[0]'
      kahanmaps verify --beyond             # what survives of them

    The member is SYSTEM, or drawn from --m, --eigenvalues, --generic or --chi; without any of these m = 3. Claims are
    proved by expanding them symbolically, verified exactly, or supported at random points over GF(p) with a bound on
    the error. Misprints stand in the table in both forms. m = 1 to 8; beyond m = 6 claims that sum over all eigenvalues
    are supported only.

    Exit status: 0 every claim holds (proved or supported), 1 one is refuted, 2 usage error, 3 one is undecided.
    Misprints are expected to be refuted and do not count.
    """
    if options["as_json"] and options["as_markdown"]:
        raise click.UsageError("give --json or --markdown, not both")
    drawn = {name: options[name] for name in DRAWN}
    given = [name for name, value in drawn.items() if value is not None and value is not False]
    if options["universal"] or options["beyond"]:
        clash = [f"--{name}" for name in given if name != "m"]
        clash += ["SYSTEM"] * (system is not None)
        if clash:
            flag = "--beyond" if options["beyond"] else "--universal"
            raise click.UsageError(f"found {flag} and {clash[0]}, expected {flag} with --m only")
    elif system is not None and given:
        raise click.UsageError("give a SYSTEM or say which member to draw (--m, --eigenvalues, ...), not both")
    if system is None and options["parameters"]:
        raise click.UsageError("found -p without SYSTEM: a member that is drawn has no parameters")
    with Progress(options["quiet"]) as progress:
        settings = lib.Settings(
            eps=opt.the_eps(options["eps"], options["time_step"], required=False),
            seed=options["seed"],
            error_bits=options["error_bits"],
            progress=progress,
        )
        what = lib.VerifyOptions(
            options["sections"] or None, options["order"], options["ball_bits"], options["controls"], options["beyond"]
        )
        if options["beyond"] and not options["controls"]:
            report = lib.survivors(3 if drawn["m"] is None else drawn["m"], settings)
        elif options["universal"] or options["beyond"]:
            report = lib.verify(None, settings, what, m=3 if drawn["m"] is None else drawn["m"])
        else:
            if system is not None:
                file = opt.load_system(system, {"parameters": options["parameters"]})
            else:
                file = drawn_file(options)
            report = lib.verify(file, settings, what)
    return print_verification(report, options["as_json"], options["as_markdown"], options["verbose"], options["quiet"])
