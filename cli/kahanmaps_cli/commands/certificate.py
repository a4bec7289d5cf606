"""kahanmaps certificate."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.commands.convert import write_text
from kahanmaps_cli.options import integral_option, load_pair, load_system, output_options, system_options
from kahanmaps_cli.params import Whole
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import as_typed, print_stderr
from kahanmaps_cli.screen.render import envelope, print_json

_CHECKERS = ("rocq", "gp", "sympy")  # as in kahanmaps.certificates.certificate, which is not imported for --help


@click.command("certificate")
@system_options
@click.option(
    "--for", "checker", type=click.Choice(_CHECKERS), required=True, help="The program that checks the certificate."
)
@click.option(
    "--claim",
    "claims",
    metavar="NAME",
    multiple=True,
    help="Certify this claim: an integral of the file, modified_hamiltonian, H0, H1, ..., volume, poisson (default: "
    "all of these); or all that a search proves: integrals, density, poisson, darboux, symmetry, equivalence (to a "
    "system of the catalogue); or entropy: positive entropy of a planar map.",
)
@click.option("--all", "everything", is_flag=True, help="Certify all these claims, including the results of searches.")
@integral_option("Certify that this function of x and eps is an integral.", into="integrals")
@click.option(
    "--commute",
    metavar="OTHER",
    help="Certify that the maps of SYSTEM and OTHER commute; OTHER is a system, or `associates` for the pairs of "
    "associated systems of a member.",
)
@click.option(
    "--equivalent",
    metavar="OTHER",
    help="Certify that T, given by --by, takes the Kahan map of SYSTEM to that of OTHER, for the same eps.",
)
@click.option("--by", metavar="EXPRS", help="T as expressions in the variables of SYSTEM, e.g. 'x + 1; 2*y'.")
@click.option("--period", type=Whole(1), metavar="N", help="Certify that the N-th iterate of the map is the identity.")
@click.option(
    "--effort",
    type=click.IntRange(lib.LEAST_EFFORT, lib.MOST_EFFORT),
    metavar="E",
    default=1,
    show_default=True,
    help="Limit for the length of the identities: each increment by 1 doubles it.",
)
@click.option("-o", "--output", type=OutputFile(), metavar="FILE", help="Write to FILE.")
@output_options
def command(system: str | None, checker: str, output: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Write proofs about the map of SYSTEM that Coq (Rocq), PARI/GP or SymPy checks.

    \b
      kahanmaps certificate euler_top --for rocq -o euler_top.v        # then: coqc euler_top.v
      kahanmaps certificate euler_top --for gp -o euler_top.gp         # then: gp -q euler_top.gp
      kahanmaps certificate euler_top --for sympy -o certificate.py    # then: python certificate.py
      kahanmaps certificate lotka_volterra --for gp --all | gp -q
      kahanmaps certificate paper_m2 --for gp --commute associates | gp -q
      kahanmaps certificate "u' = 2*v; v' = 3*u^2 - 1" --for gp --equivalent weierstrass -p g2=4 --by 'u; 2*v'
      kahanmaps certificate --vars x,y --image 'y; (3 + y)/x' --for gp --integral '(x+1)*(y+1)*(x+y+3)/(x*y)'

    The script defines the map by its equation M(x, eps) x~ = r(x, eps), states for every eps that a function is an
    integral or a Darboux polynomial, that a volume form or a Poisson tensor is invariant, or that the map has a
    symmetry, and proves it by identities of polynomials, without kahanmaps. gp and python print true for each identity,
    and end with a status that is not 0 if one does not hold.

    A line on standard error says how many claims and bytes the certificate has, and estimates the seconds that the
    program takes to check it. --json prints these numbers, and the text unless it goes to FILE.

    Exit status: 0 the certificate is written, 1 a claim is false, 2 usage error.
    """
    if options["commute"] and (options["claims"] or options["everything"] or options["integrals"] or options["period"]):
        raise click.UsageError("give --commute, or other claims, not both")
    if options["claims"] and options["everything"]:
        raise click.UsageError("give --claim or --all, not both")
    if options["commute"] and options["equivalent"]:
        raise click.UsageError("give --commute or --equivalent, not both")
    if (options["by"] is None) != (options["equivalent"] is None):
        raise click.UsageError("--equivalent OTHER and --by EXPRS belong together")
    other, load_options = options["commute"] or options["equivalent"], {**options, "quiet": quiet}
    if other in (None, "associates"):
        file = load_system(system, load_options)
    else:
        file, other = load_pair(system, other, load_options)
    integrals = {name or f"I{k}": text for k, (name, text) in enumerate(options["integrals"], 1)}
    command_words = ["kahanmaps", "certificate", *([system] if system is not None else [])]
    command_words += [f"--vars={options['variables']}"] if options["variables"] is not None else []
    command_words += [f"--{key}={text}" for key in ("rhs", "image", "inverse") for text in options[key]]
    command_words += [word for name, value in options["parameters"] for word in ("-p", f"{name}={value}")]
    command_words += ["--for", checker, *(word for name in options["claims"] for word in ("--claim", name))]
    command_words += [
        word
        for key in ("commute", "equivalent", "by", "period")
        if options[key]
        for word in (f"--{key}", str(options[key]))
    ]
    command_words += ["--all"] if options["everything"] else []
    command_words += ["--effort", str(options["effort"])] if options["effort"] != 1 else []
    command_words += [word for name, text in integrals.items() for word in ("--integral", f"{name}={text}")]
    try:
        everything, command_line = options["everything"], as_typed(command_words)
        text = lib.certificate(
            file,
            checker,
            options["claims"] or None,
            integrals or None,
            everything=everything,
            commute=None if options["equivalent"] else other,
            equivalent=other if options["equivalent"] else None,
            by=[text.strip() for text in (options["by"] or "").split(";") if text.strip()],
            period=options["period"],
            effort=options["effort"],
            command=command_line,
        )
    except lib.FalseClaim as error:
        print_stderr(f"refuted: {error}")
        return 1
    if not quiet:
        print_stderr(f"{file.name}: {text.summary}")
    if as_json:
        size = {"lines": len(text.splitlines()), "bytes": len(text.encode()), "seconds": float(f"{text.seconds:.2g}")}
        entries = {"for": checker, "claims": list(text.claims), **size, "text": str(text) if output is None else None}
        print_json({**envelope("certificate"), "system": file.name, **entries})
    if output is not None or not as_json:
        write_text(text, f"{file.name}: a certificate for {checker}", output, quiet)
    return 0
