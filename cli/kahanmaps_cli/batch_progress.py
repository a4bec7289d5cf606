"""How a batch is coming along, on standard error: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any

from kahanmaps_cli.progress import say
from kahanmaps_cli.terminal import is_coloured

if TYPE_CHECKING:
    from kahanmaps.experiments.records import Record

_LINE_EVERY = 10.0  # seconds, where there is no terminal
_SHOW_EVERY = 0.1


class BatchProgress:
    """A context that is told of records; `todo` of them are expected."""

    def __init__(self, todo: int, quiet: bool) -> None:
        self.todo = todo
        self.outcomes: Counter[str] = Counter()
        self.why_lost = ""  # the last of them
        self._quiet = quiet
        self._in_flight = 0
        self._begin = self._last = time.monotonic()
        self._bar: Any = None
        self._bar_task: Any = None
        if not quiet and sys.stderr.isatty():
            self._bar = _bar()
            self._bar_task = self._bar.add_task("", total=todo, text="")

    @property
    def done(self) -> int:
        """How many tasks have come to a result."""
        return sum(self.outcomes.values()) - self.lost

    @property
    def lost(self) -> int:
        """How many were given up without a result."""
        return self.outcomes["lost"]

    @property
    def seconds(self) -> float:
        """Since the beginning."""
        return time.monotonic() - self._begin

    def tell(self, records: Sequence[Record], in_flight: int) -> None:
        """Some more records, or none for a while; how many tasks are being done."""
        self._in_flight = in_flight
        for record in records:
            self.outcomes[str(record.outcome)] += 1
            if record.outcome == "lost":
                self.why_lost = record.message
        now = time.monotonic()
        if self._quiet or now - self._last < (_SHOW_EVERY if self._bar is not None else _LINE_EVERY):
            return
        self._last = now
        if self._bar is not None:
            self._bar.update(self._bar_task, completed=self.done, text=self.text())
        else:
            say(f"{self.done} of {self.todo} tasks, {self.text()}")

    def text(self) -> str:
        """Rate, remaining time, failures."""
        rate = self.done / max(self.seconds, 1e-9)
        pieces = [f"{rate:.3g} a second"]
        if self.done and self.done < self.todo:
            pieces.append(f"about {duration((self.todo - self.done) / rate)} left")
        if self._in_flight:
            pieces.append(f"{self._in_flight} running")
        bad = self.done - self.outcomes["ok"]
        if bad:
            pieces.append(f"{bad} failed")
        if self.lost:
            pieces.append(f"{self.lost} lost")
        return ", ".join(pieces)

    def __enter__(self) -> BatchProgress:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.update(self._bar_task, completed=self.done, text=self.text())
            self._bar.stop()


def duration(seconds: float) -> str:
    """A time for people: 8 s, 3 min, 2 h 5 min, 3 d 4 h.

    >>> duration(8.2), duration(200), duration(7500), duration(273_000)
    ('8 s', '3 min 20 s', '2 h 5 min', '3 d 4 h')
    """
    whole = round(seconds)
    parts = [(whole // 86400, "d"), (whole // 3600 % 24, "h"), (whole // 60 % 60, "min"), (whole % 60, "s")]
    first = next((k for k, (number, _) in enumerate(parts) if number), 3)
    return " ".join(f"{number} {unit}" for number, unit in parts[first : first + 2] if number) or "0 s"


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    return Progress(
        BarColumn(bar_width=None, style="default", complete_style="cyan", finished_style="green"),
        MofNCompleteColumn(),
        TextColumn("{task.fields[text]}", markup=False),
        console=Console(
            stderr=True,
            markup=False,
            emoji=False,
            highlight=False,
            color_system="standard" if is_coloured(sys.stderr) else None,
        ),
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    )
