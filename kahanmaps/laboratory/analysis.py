"""The analysis of one map: preserved structures, growth of the degrees of its iterates, and a verdict.

The analysis uses the map only, and ignores what a file claims about its system. Every statement has a certainty.
Formulas are proved or supported, as identities in x and eps. Other statements are derived from the measured singularity
patterns, or measured modulo primes or along orbits. The number of integrals and the growth are determined independently
of each other: a map may have many integrals and grow exponentially.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from typing import Any

from kahanmaps.algebra.printing import attributes, format_polynomial
from kahanmaps.algebra.work import SPENT, Budget, units_at
from kahanmaps.checks.claims import Certainty
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError, KahanmapsError, show
from kahanmaps.laboratory.analyses.step import AnalysisContext, AnalysisStep
from kahanmaps.laboratory.analyses.table import ANALYSES, TITLES
from kahanmaps.laboratory.analysis_result import AnalysisResult, Statement
from kahanmaps.laboratory.conclusion import Conclusion, conclude
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.processes import end_with_parent, processors

# Units of work at effort 1, by dimension. The independent steps share one budget of this size, and the other steps
# share a second one.
_UNITS_BY_DIMENSION = {1: 16e6, 2: 16e6, 3: 30e6, 4: 60e6, 5: 110e6}
_MAX_UNITS = 150e6


@dataclass
class Analysis(AnalysisResult, PrintableResult):
    """The result of `analyze`: the results of all steps, and the statements and the verdict derived from them."""

    analyses: tuple[AnalysisStep, ...] = ANALYSES
    interrupted: bool = False

    def __repr__(self) -> str:
        conclusion = self.conclusion
        return (
            f"<Analysis: {self.file.name}, {conclusion.kind}{f' ({conclusion.ground})' if conclusion.ground else ''}>"
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for `pickle`, without the table ANALYSES of functions; copies use ANALYSES again."""
        return {name: value for name, value in vars(self).items() if value is not ANALYSES}

    @property
    def work(self) -> str:
        """The effort and the units of work done, as text: "effort 1, 12.3 million units"."""
        return f"effort {self.effort}, {self.units / 1e6:.1f} million units"

    def interrupt(self, reason: str = "interrupted") -> None:
        """Skip the pending steps, after Ctrl-C or at the end of a `time_limit`; `reason` is reported for each."""
        self.skipped += [f"{name}: {reason}" for name in self.pending]
        self.pending.clear()
        self.interrupted = True

    @property
    def conclusion(self) -> Conclusion:
        """The verdict on integrability, with the number of integrals and the growth of the degrees."""
        return conclude(self)

    @property
    def integrable(self) -> bool | None:
        """Whether the map is integrable; None if this is undecided. `conclusion.ground` names the kind of evidence."""
        return {"not integrable": False, "singular": None, "undecided": None}.get(self.conclusion.kind, True)

    @property
    def sections(self) -> list[tuple[str, list[Statement]]]:
        """The sections of the report that have statements, as pairs (title, statements)."""
        return self._sections(self._reported_steps)

    @property
    def final_sections(self) -> list[tuple[str, list[Statement]]]:
        """The sections before the first section that a pending step may change, as pairs (title, statements)."""
        steps = self._reported_steps
        indices = (k for k, step in enumerate(steps) if {step.name, *step.requires}.intersection(self.pending))
        return self._sections(steps[: next(indices, None)])

    @property
    def _reported_steps(self) -> list[AnalysisStep]:
        """The steps that have statements, in the order of their sections in the report."""
        steps = [step for step in self.analyses if step.statements is not None]
        return sorted(steps, key=lambda step: TITLES.index(step.title) if step.title in TITLES else len(TITLES))

    def _sections(self, steps: Sequence[AnalysisStep]) -> list[tuple[str, list[Statement]]]:
        sections = [(step.title, list(step.statements(self))) for step in steps if step.statements is not None]
        notes = [] if self.pending else [Statement(Certainty.NOTE, text) for text in self.skipped]
        return [(title, lines) for title, lines in (*sections, ("not done", notes)) if lines]

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each statement, for example for `pandas.DataFrame(analysis.rows())`."""
        statements = ((title, line) for title, lines in self.sections for line in lines)
        return [{"section": title, "status": line.status, "text": line.text} for title, line in statements]

    def to_json(self) -> dict[str, Any]:
        """Return plain data: the verdict, the statements, and the results of all steps."""
        from kahanmaps.maps.convention import eps_record
        from kahanmaps.version import __version__

        conclusion = self.conclusion
        return {
            "command": "analyze",
            "version": __version__,
            "system": self.file.name,
            **attributes(self.file, "parameters"),
            **attributes(self, "symbols"),
            **eps_record(self.eps, self.file.map),
            "arithmetic": "exact formulas, from residues modulo primes",
            **attributes(self, "seed", "effort", "units", "dim", "interrupted"),
            "verdict": {
                "integrability": conclusion.kind,
                "integrals": conclusion.integrals if self.integrals_were_counted else None,
                "integrals_exact": self.count_is_exact,
                "growth": conclusion.growth,
                **attributes(conclusion, "sense", "ground", "sentence"),
            },
            "statements": [
                {"section": title, **attributes(line, "status", "text")}
                for title, lines in self.sections
                for line in lines
            ],
            "divergence": format_polynomial(self.file.system.divergence) if self.file.is_quadratic else None,
            **{key: value for step in self.analyses for key, value in step.to_json(self).items()},
            "skipped": self.skipped,
            "document": dict(self.file.document),
        }


def analyze(
    system: SystemLike,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
    effort: int = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[Analysis], None] = lambda _: None,
    analyses: Sequence[AnalysisStep] = ANALYSES,
    processes: int = 1,
) -> Analysis:
    """Determine what a map preserves and how fast the degrees of its iterates grow, within a budget of counted work.

    Args:
        system: the map; a differential equation stands for its Kahan map. Claims and facts of a file are ignored. With
            an algebraic parameter, steps that do not apply over a number field are named in `skipped` of the result.
        symbols: names of parameters that stay symbols in integrals and densities; in other results they have values.
        eps: half the time step, an exact number; the results then hold at this eps only. None: they hold for every eps.
        time_step, h: the time step 2 eps, instead of eps.
        effort: an integer; an increase by 1 doubles the budget of counted work.
        seed: the random seed.
        progress: called with a message at the beginning of each step, and repeatedly during long steps.
        on_result: called with the results so far, at the beginning and after each step.
        analyses: the steps to run, in this order; the verdict depends on their results only.
        processes: if this is more than 1, and on Linux with at least two processors, a forked process runs the
            independent steps (other threads must tolerate a fork). The results are the same as with one process.

    Returns:
        An `Analysis`, which does not depend on the machine or its load. The list `skipped` names the steps that were
        not completed, with reasons. Ctrl-C and a `time_limit` raise an exception; the object that `on_result` received
        last then has the results of all completed steps.

    Raises:
        InputError: for eps = 0, unknown symbols, other steps, or an effort that is not an integer from -20 to 40.

    >>> from kahanmaps.documents.catalog import load
    >>> analysis = analyze(load("nahm_tetrahedral"))
    >>> analysis.conclusion.kind, analysis.conclusion.integrals, analysis.conclusion.growth
    ('integrable', 1, 'quadratic')
    """
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    laboratory = Laboratory(file, symbols, eps, seed, algebraic=True)  # rejects wrong arguments before any work
    units = units_at(effort, _UNITS_BY_DIMENSION.get(file.dim, _MAX_UNITS))
    if not all(isinstance(step, AnalysisStep) for step in analyses):
        steps_text = "steps of kahanmaps.laboratory.analyses.table.ANALYSES"
        raise InputError(f"found analyses = {show(analyses)}, expected {steps_text}")
    analysis = Analysis(file, laboratory.eps, effort, seed, laboratory.free_symbols, analyses=tuple(analyses))
    analysis.defect = laboratory.defect if file.is_quadratic else ""
    context = AnalysisContext(analysis, laboratory, symbols, progress)
    steps = sorted(filter(context.applies, analyses), key=lambda step: context.dim > step.slow_above)
    analysis.pending = [step.name for step in steps]
    on_result(analysis)
    can_fork = processes > 1 and processors() > 1 and sys.platform == "linux"
    forked_steps = [step for step in steps if step.is_independent and can_fork]
    skip_messages: dict[str, str] = {}
    # Separate budgets make the results of independent steps the same with one process and with two.
    accounts = {
        is_independent: _Account(context, [step for step in steps if step.is_independent is is_independent], units)
        for is_independent in (False, True)
    }
    with _fork_steps(context, forked_steps, accounts[True]) as connection:
        own_steps, awaited_steps = [step for step in steps if step not in forked_steps], list(forked_steps)
        while own_steps or awaited_steps:
            has_arrived = bool(awaited_steps) and (not own_steps or connection.poll())
            step, outcome = (awaited_steps if has_arrived else own_steps).pop(0), None
            progress(step.name)
            if has_arrived:
                # If the forked process has ended early, this process runs the step, and may raise the same error.
                with suppress(EOFError, OSError):
                    outcome = connection.recv()
            account = accounts[step.is_independent]
            result, reason, spent = outcome or account.run(step)
            account.book(step, spent)  # also for forked steps, since this process may have to run those that remain
            analysis.units += spent
            if reason:
                skip_messages[step.name] = f"{step.name}: {reason}"
                analysis.skipped = [skip_messages[step.name] for step in steps if step.name in skip_messages]
            else:
                analysis[step.key] = result
            analysis.pending.remove(step.name)
            on_result(analysis)
    if inapplicable_names := ", ".join(step.name for step in analyses if not context.applies(step)):
        if context.root is not None:
            analysis.skipped.append(
                f"over the number field {context.root.number_field}: {inapplicable_names}, integrals in iterates"
            )
        else:
            analysis.skipped.append(f"{inapplicable_names}: for vector fields only")
    return analysis


class _Account:
    """A budget shared by successive steps: later steps may use the units of work that earlier steps did not use."""

    def __init__(self, context: AnalysisContext, steps: Sequence[AnalysisStep], units: float) -> None:
        self.context, self.waiting, self.units = context, list(steps), units

    def run(self, step: AnalysisStep) -> tuple[Any, str, int]:
        """Run a step; return (result or None, the reason for a missing result or "", the units of work used)."""
        if self.units <= 0:
            return None, SPENT, 0
        budget = Budget(self.units * self.context.weight(step) / sum(map(self.context.weight, self.waiting)))
        try:
            result, reason = self.context.run(step, budget), ""
        except KahanmapsError as error:
            result, reason = None, str(error)
        return result, reason, budget.spent

    def book(self, step: AnalysisStep, spent: int) -> None:
        """Remove a completed step from the waiting ones, and subtract its units of work from the budget."""
        self.waiting.remove(step)
        self.units -= spent


@contextmanager
def _fork_steps(context: AnalysisContext, steps: Sequence[AnalysisStep], account: _Account) -> Iterator[Connection]:
    """Run the steps, if any, in a forked process, and yield the connection from which their outcomes are received."""
    parent_id, (receiver, sender) = os.getpid(), Pipe(duplex=False)
    if not steps:
        yield receiver
        return

    def work() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the first process handles Ctrl-C
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        end_with_parent(parent_id)
        context.progress = lambda _: None
        with suppress(Exception):
            for step in steps:
                result, reason, spent = account.run(step)
                account.book(step, spent)
                if not reason:
                    context.result[step.key] = result
                sender.send((result, reason, spent))

    process = get_context("fork").Process(target=work, daemon=True)
    with suppress(OSError):  # too little memory or too many processes: the first process then runs all steps
        process.start()
    try:
        sender.close()  # else the receiver would wait forever after the end of the forked process
        yield receiver
    finally:
        if process.pid is not None:
            process.kill()
            process.join()
