"""Options and output shared by the commands that search for formulas: find-integrals, find-density and others."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.certificates import certificate_option, refuse_certificate_with_eps
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import abbreviated, print_stdout

F = TypeVar("F", bound=Callable[..., Any])


def search_options(section: str) -> Callable[[F], F]:
    """Return the options of a search; `section` is the section of a system file in which --toml prints the formulas."""
    return opt.stack(
        opt.eps_options,
        opt.symbolic_option,
        opt.effort_options,
        opt.seed_option,
        click.option("--toml", "as_toml", is_flag=True, help=f"Print the section [{section}] of a system file."),
        click.option("--latex", "as_latex", is_flag=True, help="Print the formulas in LaTeX."),
        certificate_option,
        opt.output_options,
    )


def require_one_form(options: dict[str, Any]) -> None:
    """Refuse --certificate with --eps, and more than one of --toml, --latex and --json."""
    if sum((options["as_toml"], options["as_latex"], options["as_json"])) > 1:
        raise click.UsageError("give one of --toml, --latex and --json")
    refuse_certificate_with_eps(options)


def symbols_and_eps(options: dict[str, Any]) -> tuple[tuple[str, ...], Any]:
    """Return a pair: the names given by --symbolic except eps, and the number eps (None if eps is symbolic)."""
    names = [name.strip() for name in (options["symbolic"] or "").split(",") if name.strip()]
    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
    if eps is not None and "eps" in names:
        raise click.UsageError("give --eps as a number, or eps among --symbolic, not both")
    return tuple(name for name in names if name != "eps"), eps


def search_arguments(options: dict[str, Any], *names: str) -> dict[str, Any]:
    """Return the keyword arguments of a search: symbols, eps, effort, seed, and the options called `names`."""
    symbols, eps = symbols_and_eps(options)
    return {"symbols": symbols, "eps": eps, **opt.pick(options, *names, "effort", "seed")}


def scope(result: Any) -> str:
    """Return the text that follows the name of the system in a heading: for which eps and symbols the formulas hold."""
    if getattr(result, "flow", False):
        return ", the flow x' = f(x)" + (f", every {', '.join(result.symbols)}" if result.symbols else "")
    eps_text = lib.eps_suffix(result.eps, result.file.map)
    return f"{eps_text}, every {', '.join(result.symbols)}" if result.symbols else eps_text


def heading(name: str, result: Any, search: SearchProgress) -> dict[str, Any]:
    """Return the JSON entries that are needed to repeat a search, and the number of units of work that it took."""
    return {
        **envelope(name),
        "system": result.file.name,
        "parameters": {key: str(value) for key, value in result.file.parameters.items()},
        "symbols": list(result.symbols),
        **lib.eps_record(result.eps, result.file.map),
        "arithmetic": "exact formulas, from residues modulo primes",
        "seed": result.seed,
        **search.work,
    }


def record(name: str, result: Any, search: SearchProgress, **entries: Any) -> dict[str, Any]:
    """Return the JSON record of a search."""
    return {**heading(name, result, search), **result.to_json(), **entries, "document": dict(result.file.document)}


def print_search(
    name: str,
    result: Any,
    search: SearchProgress,
    options: dict[str, Any],
    formulas: Iterable[tuple[str, Any, str]],
    last_line: str = "",
) -> None:
    """Print the result of a search as text, JSON, TOML or LaTeX, as requested.

    Each of `formulas` is a triple: name, object with `text`, `verdict` and `evidence`, origin (a text). `last_line` is
    printed after the formulas, in the text form only.
    """
    if options["as_json"]:
        print_json(record(name, result, search))
    elif options["as_toml"]:
        click.echo(result.toml_section(), nl=False)
    elif options["as_latex"]:
        for label, statement, _ in formulas:
            click.echo(f"{label} = {statement.to_json()['latex']}")
    else:
        print_stdout(f"{name}: {result.file.name}{scope(result)}")
        for label, statement, origin in formulas:
            print_stdout(
                f"{label}\t{statement.verdict}\t{abbreviated(statement.text)}\n\t{origin}{statement.evidence.summary}"
            )
        if last_line:
            print_stdout(last_line)
        for text in filter(None, (result.note, result.reason)):
            print_stdout(f"note\t{text}")


def print_list(
    name: str, heading: str, result: Any, search: SearchProgress, context: dict[str, Any], as_json: bool
) -> int:
    """Print the result of a search; print what remains undecided on standard error. Return the exit status."""
    if as_json:
        print_json({"command": name, **context, **result.to_json()})
    else:
        print_stdout(heading)
        print_stdout(str(result))
    if not search.quiet:
        for sentence in result.undecided:
            print_stderr(f"undecided: {sentence}")
    return 0 if result.complete and not search.is_over else 3
