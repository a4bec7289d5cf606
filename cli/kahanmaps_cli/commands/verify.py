"""kahanmaps verify."""

from __future__ import annotations

from collections import Counter
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.display import markup
from kahanmaps.display.checks import headline, sections_of, witness_lines
from kahanmaps_cli import options as opt
from kahanmaps_cli.commands.family import MEMBER_OPTIONS, random_member_file, random_member_options
from kahanmaps_cli.params import Section
from kahanmaps_cli.runs.certificates import certificate_option, refuse_certificate_with_eps, write_certificate
from kahanmaps_cli.screen.progress import Progress
from kahanmaps_cli.screen.render import exit_status, print_report, verdict_style
from kahanmaps_cli.screen.terminal import NUMBER_WIDTH, console, on_terminal, print_raw, print_stdout, shorten, styled

_METHOD_NAMES = {
    "symbolic, normal form": "symbolic",
    "symbolic": "symbolic",
    "exact": "exact",
    "exact rational point": "exact",
    "point over GF(p)": "point mod p",
    "random points over GF(p)": "points",
    "random points": "points",
    "outside the hypotheses": "outside",
    "special member": "special",
    "control": "exact",
}
_LEGEND = {
    "symbolic, normal form": "symbolic: an identity of rational functions in indeterminate roots of chi, coefficients "
    "of H, x and eps, multiplied out for the normal form; the hypotheses of this member are verified exactly",
    "symbolic": "symbolic: an identity of rational functions of x (and eps), multiplied out for this member",
    "exact": "exact: no x in it, computed over Q",
    "exact rational point": "exact: shown at an exact rational point, which is a proof (or a refutation)",
    "point over GF(p)": "point mod p: shown at a point over GF(p), which is a proof (or a refutation)",
    "random points over GF(p)": "points: held at random points over GF(p), error below the bound given",
    "special member": "special: the statement is for generic A and H, and this member is special; it does not count",
    "outside the hypotheses": "outside: the member does not satisfy the hypotheses of the statement",
}


@click.command("verify")
@opt.system_argument
@opt.parameter_option
@random_member_options
@opt.eps_options
@click.option("--universal", is_flag=True, help="Verify the claims for the generic member instead of a given one.")
@click.option(
    "--beyond",
    is_flag=True,
    help="Print which statements remain true for other H, J, steps and A, with counterexamples.",
)
@click.option("--controls", is_flag=True, help="Check that every claim fails if one hypothesis is violated.")
@click.option(
    "--section",
    "sections",
    type=Section(),
    metavar="N",
    multiple=True,
    help="Restrict to this section: 1 to 9, beyond (or 10) or conclusions (or 11). Repeatable.",
)
@click.option(
    "--order",
    type=int,
    metavar="N",
    default=3,
    show_default=True,
    help="Verify the first N terms of the expansions of the integrals in eps^2.",
)
@click.option(
    "--balls", "ball_bits", type=int, metavar="BITS", help="Also compute with complex balls around the roots of chi."
)
@opt.evidence_options
@click.option("--markdown", "as_markdown", is_flag=True, help="Print the table in Markdown.")
@certificate_option
@opt.verbose_option
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """Verify every statement of the paper of Petrera and Suris for a member of its family.

    \b
      kahanmaps verify                        # a random member with m = 3
      kahanmaps verify paper_m3
      kahanmaps verify --m 4 --generic --seed 2          # chi irreducible over Q
      kahanmaps verify --chi '(t-1)*(t^2+1)' --balls 128
      kahanmaps verify --universal --m 3      # theorems for the generic member
      kahanmaps verify --controls --section 6            # violated hypotheses
      kahanmaps verify --m 2 --json | jq '.claims[0]'
      kahanmaps verify --beyond             # generalizations
      kahanmaps verify --section conclusions  # geometry of the level sets

    The member is SYSTEM, or a random one given by --m, --eigenvalues, --generic or --chi; by default m = 3. Claims are
    proved by symbolic expansion, by a formal proof or by an exact computation, or supported at random points over GF(p)
    with a bound on the error. Formulas with misprints are listed both as printed and corrected. m is at most 8; for m >
    6 claims with sums over all eigenvalues are only supported.

    --certificate FILE also writes the proofs of `kahanmaps certificate` for the member: its integrals, invariant
    measure and Poisson tensor. (`kahanmaps certificate SYSTEM --commute associates` is about its commuting maps.)

    Exit status: 0 every claim holds (proved or supported), 1 one is refuted, 2 usage error, 3 one is undecided.
    Misprints are expected to be refuted and do not count.
    """
    if options["as_json"] and options["as_markdown"]:
        raise click.UsageError("give --json or --markdown, not both")
    refuse_certificate_with_eps(options)
    if options["certificate"] is not None and (options["universal"] or options["beyond"] or options["controls"]):
        raise click.UsageError(
            "a certificate is about one member: give --certificate without --universal, --beyond and --controls"
        )
    member_options = {name: options[name] for name in MEMBER_OPTIONS}
    typed_options = [name for name, value in member_options.items() if value is not None and value is not False]
    if options["universal"] or options["beyond"]:
        conflicting = [f"--{name}" for name in typed_options if name != "m"]
        conflicting += ["SYSTEM"] * (system is not None)
        if conflicting:
            flag = "--beyond" if options["beyond"] else "--universal"
            raise click.UsageError(f"found {flag} and {conflicting[0]}, expected {flag} with --m only")
    elif system is not None and typed_options:
        raise click.UsageError("give either a SYSTEM, or the options of a random member (--m, --eigenvalues, ...)")
    if system is None and options["parameters"]:
        raise click.UsageError("found -p without SYSTEM: a random member has no parameters")
    with Progress(options["quiet"]) as progress:
        settings = lib.Settings(
            eps=opt.requested_eps(options["eps"], options["time_step"], required=False),
            seed=options["seed"],
            error_bits=options["error_bits"],
            progress=progress,
        )
        verify_options = lib.VerifyOptions(
            options["sections"] or None, options["order"], options["ball_bits"], options["controls"], options["beyond"]
        )
        m = 3 if options["m"] is None else options["m"]
        if options["beyond"] and not options["controls"]:
            report = lib.beyond_table(m, settings)
        elif options["universal"] or options["beyond"]:
            report = lib.verify(None, settings, verify_options, m=m)
        else:
            if system is not None:
                file = opt.load_system(system, {"parameters": options["parameters"]})
            else:
                file = random_member_file(options)
            report = lib.verify(file, settings, verify_options)
    as_json, verbose = options["as_json"], options["verbose"]
    if report.context.get("beyond") and not as_json:
        print_raw(lib.table(report))
    elif options["as_markdown"]:
        print_raw(markdown(report))
    elif as_json or not on_terminal():
        print_report(report, as_json, verbose, options["quiet"])
    else:
        _print_terminal(report, verbose)
    return write_certificate(options, report.context["system"], report.certificate, exit_status(report))


def markdown(report: lib.Report) -> str:
    """Return the table of claims and verdicts in Markdown, as in docs/audit.md."""
    lines = [markup.markdown(headline(report))]
    section = None
    for finding in report.findings:
        if finding.place.get("section") != section:
            section = finding.place.get("section")
            title = finding.place.get("section_title", "Together")
            lines += ["", f"### {f'{section} {title}' if section in range(1, 10) else title}", ""]
            lines += ["| statement | formula | how | verdict |", "|---|---|---|---|"]
        verdict = str(finding.verdict) + (" as printed" if finding.place.get("misprint") else "")
        cells = (
            finding.place.get("place", ""),
            markup.code(finding.formula or finding.claim),
            _method_text(finding.evidence),
            verdict,
        )
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join([*lines, "", f"Verdict: {report.verdict} ({_verdict_counts(report)})"])


def _print_terminal(report: lib.Report, verbose: bool) -> None:
    from rich import box
    from rich.table import Table

    print_stdout(headline(report), style="bold")
    by_section = sections_of(report.findings)
    unsectioned = by_section.pop("", [])
    has_controls = bool(report.context.get("controls"))
    for name, findings in by_section.items():
        table = Table(
            title=name, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, show_lines=verbose, expand=True
        )
        table.add_column("statement", overflow="fold", min_width=17, max_width=19)
        table.add_column("formula", overflow="fold", ratio=1)
        how, how_width = ("violated", 24) if has_controls else ("how", 14)
        table.add_column(how, overflow="fold", min_width=11, max_width=how_width)
        table.add_column("verdict", no_wrap=True)
        for finding in findings:
            misprint = finding.place.get("misprint")
            lines = [finding.formula or finding.claim, *([f"misprint: {misprint}"] if misprint else [])]
            if verbose:
                lines.append(finding.claim.split(": ", 1)[-1])
                lines += [f"{evidence.method}: {evidence.summary}" for evidence in (finding.evidence, *finding.also)]
            if finding.witness is not None and (verbose or not finding.control):
                lines += witness_lines(finding.witness, NUMBER_WIDTH)
            verdict = f"{finding.verdict}\nas printed" if misprint else str(finding.verdict)
            is_control = has_controls and "violation" in finding.place
            table.add_row(
                styled(finding.place["place"]),
                styled("\n  ".join(lines)),
                styled(str(finding.place["violation"]) if is_control else _method_text(finding.evidence)),
                styled(verdict, verdict_style(finding)),
            )
        console().print(table)
    for finding in unsectioned:
        print_stdout(f"{finding.claim}: {finding.evidence.summary}")
    for method in dict.fromkeys(finding.evidence.method for finding in report.findings):
        if method in _LEGEND:
            print_stdout(_LEGEND[method])
    # `evidence` decided the verdict of a finding; `also` is its further evidence.
    all_evidence = [evidence for finding in report.findings for evidence in (finding.evidence, *finding.also)]
    bounds = [int(str(e.data["error_bound"])[3:]) for e in all_evidence if "error_bound" in e.data]
    if bounds:
        sentence = f"also: {len(bounds)} claims held at random points over GF(p)"
        print_stdout(f"{sentence}, each false with probability below 2^-{min(bounds)}")
    methods = Counter(e.method for f in report.findings for e in f.also if "error_bound" not in e.data)
    for method, count in methods.items():
        print_stdout(f"also: {count} claims: {method} (-v)")
    for finding in report.findings:
        if str(finding.verdict) == "refuted" and not finding.control:
            print_stdout(f"refuted: {shorten(finding.claim, 200)}")
    for note in report.notes:
        print_stdout(f"note: {note}")
    print_stdout(f"verdict\t{report.verdict}\t({_verdict_counts(report)})", 9)


def _method_text(evidence: lib.Evidence) -> str:
    method = _METHOD_NAMES.get(evidence.method, evidence.method)
    bound: Any = evidence.data.get("error_bound")
    return f"{method}, {bound}" if bound else method


def _verdict_counts(report: lib.Report) -> str:
    counts = Counter(str(f.verdict) for f in report.findings if f.applies and not f.control)
    text = ", ".join(f"{number} {verdict}" for verdict, number in counts.items())
    misprints = sum(1 for f in report.findings if f.place.get("misprint"))
    return text + (f"; {misprints} misprints, refuted as printed" if misprints else "")
