"""The analysis of one map: what it preserves, how fast its iterates grow in complexity, and a verdict.

The analysis uses the map only, and ignores what a file claims about its system. Every statement has a certainty: proved
or supported (formulas, as identities in x and eps), derived (from the measured singularity patterns), or measured
(modulo primes, or along orbits). The number of integrals and the growth are determined independently of each other: a
map may have many integrals and grow exponentially.
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
from kahanmaps.errors import KahanmapsError
from kahanmaps.laboratory.analyses.step import AnalysisContext, AnalysisStep
from kahanmaps.laboratory.analyses.table import ANALYSES, TITLES
from kahanmaps.laboratory.analysis_result import AnalysisResult, Statement
from kahanmaps.laboratory.conclusion import Conclusion, conclude
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.processes import end_with_parent, processors

# Units of work at effort 1 by dimension, for the independent steps and again for the other steps.
# Most maps use a small part of them.
_UNITS = {1: 16e6, 2: 16e6, 3: 30e6, 4: 60e6, 5: 110e6}
_MAX_UNITS = 150e6


@dataclass
class Analysis(AnalysisResult, PrintableResult):
    """The result of `analyze`: the results of all steps, with the statements and the verdict that follow from them."""

    analyses: tuple[AnalysisStep, ...] = ANALYSES
    interrupted: bool = False

    def __repr__(self) -> str:
        conclusion = self.conclusion
        return (
            f"<Analysis: {self.file.name}, {conclusion.kind}{f' ({conclusion.ground})' if conclusion.ground else ''}>"
        )

    def __getstate__(self) -> dict[str, Any]:
        """The state for `pickle`, which cannot store the functions of the table; the default of the class is used."""
        return {name: value for name, value in vars(self).items() if value is not ANALYSES}

    @property
    def work(self) -> str:
        """The effort and the work done: effort 1, 12.3 million units."""
        return f"effort {self.effort}, {self.units / 1e6:.1f} million units"

    def interrupt(self, reason: str = "interrupted") -> None:
        """Skip the steps that are pending, after Ctrl-C or at the end of a `time_limit`; `reason` is reported."""
        self.skipped += [f"{name}: {reason}" for name in self.pending]
        self.pending.clear()
        self.interrupted = True

    @property
    def conclusion(self) -> Conclusion:
        """The verdict on integrability, the number of integrals and the growth."""
        return conclude(self)

    @property
    def integrable(self) -> bool | None:
        """Whether the map is integrable; None if this is undecided. `conclusion.ground` names the kind of evidence."""
        return {"not integrable": False, "singular": None, "undecided": None}.get(self.conclusion.kind, True)

    @property
    def sections(self) -> list[tuple[str, list[Statement]]]:
        """The sections of the report that have statements: titles and statements."""
        return self._sections(self._reported_steps)

    @property
    def final_sections(self) -> list[tuple[str, list[Statement]]]:
        """The sections before the first one that a pending step may still change."""
        steps = self._reported_steps
        waiting = (k for k, step in enumerate(steps) if {step.name, *step.requires}.intersection(self.pending))
        return self._sections(steps[: next(waiting, None)])

    @property
    def _reported_steps(self) -> list[AnalysisStep]:
        """The steps with statements, in the order of the report."""
        reported = [step for step in self.analyses if step.statements is not None]
        return sorted(reported, key=lambda step: TITLES.index(step.title) if step.title in TITLES else len(TITLES))

    def _sections(self, steps: Sequence[AnalysisStep]) -> list[tuple[str, list[Statement]]]:
        sections = [(step.title, list(step.statements(self))) for step in steps if step.statements is not None]
        skipped = [] if self.pending else [Statement(Certainty.NOTE, text) for text in self.skipped]
        return [(title, lines) for title, lines in (*sections, ("not done", skipped)) if lines]

    def rows(self) -> list[dict[str, str]]:
        """A row for each statement, for example for `pandas.DataFrame(analysis.rows())`."""
        statements = ((title, line) for title, lines in self.sections for line in lines)
        return [{"section": title, "status": line.status, "text": line.text} for title, line in statements]

    def to_json(self) -> dict[str, Any]:
        """Plain data: the verdict, the statements, and all results."""
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
    """Determine what a map preserves and how fast its iterates grow in complexity, within a budget of counted work.

    Args:
        system: the map; a differential equation stands for its Kahan map. Claims and facts of a file are ignored. With
            an algebraic parameter, steps that do not apply over a number field are named in `skipped`.
        symbols: names of parameters that stay symbols in integrals and densities; other results use their values.
        eps: half the time step, an exact number: the analysis is then at this eps only. None: it is for every eps.
        time_step, h: the time step 2 eps, instead of eps.
        effort: an integer; each increase by 1 doubles the work that searches may take.
        seed: the random seed.
        progress: called with a message at the beginning of each step, and in steps that take longer.
        on_result: called with the results so far, at the beginning and after each step.
        analyses: the steps to run, in this order; the verdict rests on their results only.
        processes: with more than 1, a forked copy of this process runs the independent steps, if there is a second
            processor (on Linux only; other threads must tolerate a fork). The results are the same.

    Returns:
        An `Analysis`, the same on any machine at any load. Steps that were not completed are named in `skipped`. Ctrl-C
        and a `time_limit` end the analysis with an exception; the last argument of `on_result` then has all completed
        steps.

    Raises:
        InputError: for eps = 0, unknown symbols, and an effort that is no integer from -20 to 40.

    >>> from kahanmaps.documents.catalog import load
    >>> analysis = analyze(load("nahm_tetrahedral"))
    >>> analysis.conclusion.kind, analysis.conclusion.integrals, analysis.conclusion.growth
    ('integrable', 1, 'quadratic')
    """
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    laboratory = Laboratory(file, symbols, eps, seed, algebraic=True)  # refuses wrong arguments before any work
    units = units_at(effort, _UNITS.get(file.dim, _MAX_UNITS))
    analysis = Analysis(file, laboratory.eps, effort, seed, laboratory.free_symbols, analyses=tuple(analyses))
    analysis.defect = laboratory.defect if file.is_quadratic else ""
    context = AnalysisContext(analysis, laboratory, symbols, progress)
    steps = sorted(filter(context.applies, analyses), key=lambda step: context.dim > step.slow_above)
    analysis.pending = [step.name for step in steps]
    on_result(analysis)
    can_fork = processes > 1 and processors() > 1 and sys.platform == "linux"
    forked = [step for step in steps if step.is_independent and can_fork]
    skipped: dict[str, str] = {}
    # Independent steps have a budget of their own, so that it is the same with one process and with two.
    accounts = {
        is_independent: _Account(context, [step for step in steps if step.is_independent is is_independent], units)
        for is_independent in (False, True)
    }
    with _second_process(context, forked, accounts[True]) as outcomes:
        own, in_fork = [step for step in steps if step not in forked], list(forked)
        while own or in_fork:
            has_arrived = bool(in_fork) and (not own or outcomes.poll())
            step, outcome = (in_fork if has_arrived else own).pop(0), None
            progress(step.name)
            if has_arrived:
                # The process was killed, or met an error, which this process meets again.
                with suppress(EOFError, OSError):
                    outcome = outcomes.recv()
            account = accounts[step.is_independent]
            result, reason, spent = outcome or account.run(step)
            account.book(step, spent)  # also the work of the other process, as this one may have to take over from it
            analysis.units += spent
            if reason:
                skipped[step.name] = f"{step.name}: {reason}"
                analysis.skipped = [skipped[step.name] for step in steps if step.name in skipped]
            else:
                analysis[step.key] = result
            analysis.pending.remove(step.name)
            on_result(analysis)
    if inapplicable := ", ".join(step.name for step in analyses if not context.applies(step)):
        if context.root is not None:
            analysis.skipped.append(
                f"over the number field {context.root.number_field}: {inapplicable}, integrals in iterates"
            )
        else:
            analysis.skipped.append(f"{inapplicable}: for vector fields only")
    return analysis


class _Account:
    """The units of work of several successive steps: units that one step does not use go to the later ones."""

    def __init__(self, context: AnalysisContext, steps: Sequence[AnalysisStep], units: float) -> None:
        self.context, self.waiting, self.units = context, list(steps), units

    def run(self, step: AnalysisStep) -> tuple[Any, str, int]:
        """Run a step; return its result or None, the reason if there is none, and the units that it took."""
        if self.units <= 0:
            return None, SPENT, 0
        budget = Budget(self.units * self.context.weight(step) / sum(map(self.context.weight, self.waiting)))
        try:
            result, reason = self.context.run(step, budget), ""
        except KahanmapsError as error:
            result, reason = None, str(error)
        return result, reason, budget.spent

    def book(self, step: AnalysisStep, spent: int) -> None:
        """Remove a step that has run, and subtract the units that it took."""
        self.waiting.remove(step)
        self.units -= spent


@contextmanager
def _second_process(context: AnalysisContext, steps: Sequence[AnalysisStep], account: _Account) -> Iterator[Connection]:
    """Run steps in a forked process, if there are any, and yield the connection for their outcomes.

    The fork inherits the map and all functions; results are returned as pickles. The process ends with the block.
    """
    parent, (receiver, sender) = os.getpid(), Pipe(duplex=False)
    if not steps:
        yield receiver
        return

    def work() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the first process
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        end_with_parent(parent)
        context.progress = lambda _: None
        with suppress(Exception):
            for step in steps:
                result, reason, spent = account.run(step)
                account.book(step, spent)
                if not reason:
                    context.result[step.key] = result
                sender.send((result, reason, spent))

    process = get_context("fork").Process(target=work, daemon=True)
    with suppress(OSError):  # too little memory, or too many processes: then the first process does all
        process.start()
    try:
        sender.close()  # so that the end of the process is the end of the pipe
        yield receiver
    finally:
        if process.pid is not None:
            process.kill()
            process.join()
