"""Everything about one map as one report: what is preserved, how it grows, what it belongs to, and a verdict.

The analysis is given the map only; what a file claims of its system is not read. Every statement carries
how it is known: proved or supported (formulas, as identities in x and eps), or measured (modulo primes, or on orbits).
The number of integrals and the growth are two separate findings: a map may have many integrals and grow exponentially.
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
from kahanmaps.laboratory.analyses.part import Part, Run
from kahanmaps.laboratory.analyses.table import ANALYSES, TITLES
from kahanmaps.laboratory.conclusion import Conclusion, conclude
from kahanmaps.laboratory.findings import Findings, Statement
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.processes import end_with_parent, processors

# Units of work at effort 1 by dimension, for the parts that read integrals, and once more for the others.
# Most maps take a small part of them.
_UNITS = {1: 16e6, 2: 16e6, 3: 30e6, 4: 60e6, 5: 110e6}
_MOST_UNITS = 150e6


@dataclass
class Analysis(Findings, PrintableResult):
    """What `analyze` found, and statements about it."""

    parts: tuple[Part, ...] = ANALYSES
    interrupted: bool = False

    def __getstate__(self) -> dict[str, Any]:
        """For `pickle`, which has no names for the functions of the table: there the class says which parts."""
        return {name: value for name, value in vars(self).items() if value is not ANALYSES}

    @property
    def work(self) -> str:
        """How much was to be done and was: effort 1, 12.3 million units."""
        return f"effort {self.effort}, {self.units / 1e6:.1f} million units"

    def interrupt(self, reason: str = "interrupted") -> None:
        """Leave out the parts that are pending, for this reason: Ctrl-C, or that the time of a `time_limit` is over."""
        self.skipped += [f"{part}: {reason}" for part in self.pending]
        self.pending.clear()
        self.interrupted = True

    @property
    def conclusion(self) -> Conclusion:
        """The verdict; integrability and the number of integrals are told apart."""
        return conclude(self)

    @property
    def sections(self) -> list[tuple[str, list[Statement]]]:
        """The report: titles and their statements, those that have some."""
        return self._sections(self._titled)

    @property
    def final_sections(self) -> list[tuple[str, list[Statement]]]:
        """The first of them, up to the one that is not complete yet."""
        waiting = (k for k, part in enumerate(self._titled) if {part.name, *part.reads}.intersection(self.pending))
        return self._sections(self._titled[: next(waiting, None)])

    @property
    def _titled(self) -> list[Part]:
        """The parts with statements, in the order of the report."""
        titled = [part for part in self.parts if part.statements is not None]
        return sorted(titled, key=lambda part: TITLES.index(part.title) if part.title in TITLES else len(TITLES))

    def _sections(self, parts: Sequence[Part]) -> list[tuple[str, list[Statement]]]:
        told = [(part.title, list(part.statements(self))) for part in parts if part.statements is not None]
        skipped = [] if self.pending else [Statement(Certainty.NOTE, text) for text in self.skipped]
        return [(title, lines) for title, lines in (*told, ("not done", skipped)) if lines]

    def rows(self) -> list[dict[str, str]]:
        """A row for each statement, for `pandas.DataFrame(found.rows())` and the like."""
        told = ((name, line) for name, lines in self.sections for line in lines)
        return [{"section": name, "status": line.status, "text": line.text} for name, line in told]

    def to_json(self) -> dict[str, Any]:
        """Plain data: the verdict, the statements, and all results."""
        from kahanmaps.maps.convention import eps_record
        from kahanmaps.version import __version__

        final = self.conclusion
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
                "integrability": final.kind,
                "integrals": final.integrals if self.integrals_were_counted else None,
                "integrals_exact": self.count_is_exact,
                "growth": final.growth,
                **attributes(final, "sense", "ground", "sentence"),
            },
            "statements": [
                {"section": title, **attributes(line, "status", "text")}
                for title, lines in self.sections
                for line in lines
            ],
            "divergence": format_polynomial(self.file.system.divergence) if self.file.is_quadratic else None,
            **{key: value for part in self.parts for key, value in part.to_json(self).items()},
            "skipped": self.skipped,
            "document": dict(self.file.document),
        }


def analyze(
    system: SystemLike,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    effort: int = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    reached: Callable[[Analysis], None] = lambda _: None,
    parts: Sequence[Part] = ANALYSES,
    processes: int = 1,
) -> Analysis:
    """What a map preserves and how it grows, within a budget of counted work.

    Args:
        system: the map, of a differential equation its Kahan map; its claims and facts are not looked at. With an
            algebraic parameter what is not done over a number field is named in `skipped`.
        symbols: names of parameters that integrals and densities are to contain; all else is for the given values.
        eps: an exact number, to analyse the map at that eps only; None for every eps.
        time_step: 2 eps, in its place.
        effort: 1, or more: each more doubles the work that searches may take, each less halves it.
        seed: of everything random.
        progress: is told what is being done.
        reached: gets what is known, at the beginning and after each part.
        parts: the analyses to do, in this order; the verdict rests on these.
        processes: 1, or more: then a forked copy of this process does those that need no integrals, where there is a
            second processor (on Linux only; what runs in other threads should bear a fork). The answers are the same.

    Returns:
        An `Analysis`, the same on any machine at any load. Parts that could not be done are named in `skipped`.
        Ctrl-C and a `time_limit` end it with an exception; what `reached` got last is then all that was completed.

    Raises:
        InputError: for eps = 0, unknown symbols, and an effort that is no integer from -20 to 40.

    >>> from kahanmaps.documents.catalog import load
    >>> found = analyze(load("nahm_tetrahedral"))
    >>> found.conclusion.kind, found.conclusion.integrals, found.conclusion.growth
    ('integrable', 1, 'quadratic')
    """
    file, eps = as_file(system), resolve_eps(eps, time_step)
    laboratory = Laboratory(file, symbols, eps, seed, algebraic=True)  # refuses what is wrong before any work
    units = units_at(effort, _UNITS.get(file.dim, _MOST_UNITS))
    found = Analysis(file, laboratory.eps, effort, seed, laboratory.free_symbols, parts=tuple(parts))
    found.defect = laboratory.defect if file.is_quadratic else ""
    run = Run(found, laboratory, symbols, progress)
    todo = sorted(filter(run.applies, parts), key=lambda part: run.dim > part.slow_above)
    found.pending = [part.name for part in todo]
    reached(found)
    can_fork = processes > 1 and processors() > 1 and sys.platform == "linux"
    apart = [part for part in todo if part.is_apart and can_fork]
    skipped: dict[str, str] = {}
    # Parts that may be done apart have a budget of their own, so that it is the same with one process and with two.
    accounts = {
        is_apart: _Account(run, [part for part in todo if part.is_apart is is_apart], units)
        for is_apart in (False, True)
    }
    with _second_process(run, apart, accounts[True]) as outcomes:
        here, there = [part for part in todo if part not in apart], list(apart)
        while here or there:
            has_come = bool(there) and (not here or outcomes.poll())
            part, outcome = (there if has_come else here).pop(0), None
            progress(part.name)
            if has_come:
                with suppress(EOFError, OSError):  # the process was killed, or met an error, which it meets here again
                    outcome = outcomes.recv()
            account = accounts[part.is_apart]
            result, reason, spent = outcome or account.outcome(part)
            account.book(part, spent)  # what the other process spent as well: this one may have to go on in its place
            found.units += spent
            if reason:
                skipped[part.name] = f"{part.name}: {reason}"
                found.skipped = [skipped[one.name] for one in todo if one.name in skipped]
            else:
                found[part.result] = result
            found.pending.remove(part.name)
            reached(found)
    if others := ", ".join(part.name for part in parts if not run.applies(part)):
        if run.root is not None:
            found.skipped.append(f"over the number field {run.root.number_field}: {others}, integrals in iterates")
        else:
            found.skipped.append(f"{others}: for fields only")
    return found


class _Account:
    """The units that parts share, one after the other: what one leaves goes to those after it."""

    def __init__(self, run: Run, parts: Sequence[Part], units: float) -> None:
        self.run, self.waiting, self.units = run, list(parts), units

    def outcome(self, part: Part) -> tuple[Any, str, int]:
        """What a part found; or None, and why it was not done; and the units that it took."""
        if self.units <= 0:
            return None, SPENT, 0
        budget = Budget(self.units * self.run.weight(part) / sum(map(self.run.weight, self.waiting)))
        try:
            result, reason = part.look(self.run, **self.run.given(part, budget)), ""
        except KahanmapsError as error:
            result, reason = None, str(error)
        return result, reason, budget.spent

    def book(self, part: Part, spent: int) -> None:
        """The part is done, and this is what it took."""
        self.waiting.remove(part)
        self.units -= spent


@contextmanager
def _second_process(run: Run, parts: Sequence[Part], account: _Account) -> Iterator[Connection]:
    """A copy of this process that does the parts, if there are any, and sends their outcomes; it ends with the block.

    As a copy it has the map and all functions without being told; what it finds comes back as pickles.
    """
    parent, (receiver, sender) = os.getpid(), Pipe(duplex=False)
    if not parts:
        yield receiver
        return

    def work() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the first process
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        end_with_parent(parent)
        run.progress = lambda _: None
        with suppress(Exception):
            for part in parts:
                result, reason, spent = account.outcome(part)
                account.book(part, spent)
                if not reason:
                    run.found[part.result] = result
                sender.send((result, reason, spent))

    process = get_context("fork").Process(target=work, daemon=True)
    with suppress(OSError):  # no memory for one more process, or too many: then all is done here
        process.start()
    try:
        sender.close()  # so that the end of the process is the end of the pipe
        yield receiver
    finally:
        if process.pid is not None:
            process.kill()
            process.join()
