"""How orbits side by side are advanced, whatever the kernel: on ranges of lanes, by threads, with records kept.

Kernels take many lanes through many steps that are only watched for anything unusual. Lanes that met it are taken again
from where they were, step by step and with all tests: a step may be near-singular, or the last one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import RUNNING, Lanes

_SHARES = 8  # of the lanes for each thread: other programs run too
_MULTIPLE = 256  # lanes that compiled kernels take together


class Kept(NamedTuple):
    """The states at multiples of `every` (0: none) go to the rows of a table, the first `before` of them elsewhere."""

    every: int
    table: FloatArray
    before: int = 0

    def keep(self, index: int, which: Any, z: Any) -> None:
        """Write the states of some lanes at an index, if they are wanted."""
        if self.every and index % self.every == 0:
            self.table[index // self.every - self.before - 1][:, which] = z


NOTHING = Kept(0, np.empty((0, 0, 0)))


class Engine(ABC):
    """Takes states (rows, n) to their images."""

    group = 4096  # lanes that are taken together by a single thread
    threads = 1

    @abstractmethod
    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        """Take the lanes lo, ..., hi - 1 through the steps; what is kept of an orbit that has ended does not count."""

    def advance(self, lanes: Lanes, first: int, steps: int, kept: Kept, sampled: int) -> None:
        """Take all lanes `steps` steps from the index `first`; states after the end of an orbit become NaN.

        In normal form the integrals are looked at at multiples of `sampled`.
        """
        in_ranges(
            lambda lo, hi: self.run(lanes, lo, hi, first, steps, kept, sampled),
            lanes.z.shape[1],
            self.threads,
            self.group,
        )
        if len(kept.table) and (lanes.status != RUNNING).any():
            at = (first // kept.every + 1 + np.arange(len(kept.table))) * kept.every
            gone = (lanes.failed_at >= 0) & (at[:, None] >= lanes.failed_at)
            kept.table.transpose(0, 2, 1)[gone] = np.nan


class Word(Engine):
    """Several engines one after the other, each for a step."""

    def __init__(self, engines: Sequence[Engine]) -> None:
        self.engines = engines

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        for index in range(first, first + steps):
            for engine in self.engines:
                engine.run(lanes, lo, hi, index, 1, NOTHING, 0)
            kept.keep(index + 1, slice(lo, hi), lanes.z[:, lo:hi])


def segments(first: int, count: int, *intervals: int) -> Iterator[tuple[int, int]]:
    """Index and number of steps of segments that end at every multiple of the intervals (0: none)."""
    index = first
    while index < first + count:
        end = min([first + count, *(index - index % interval + interval for interval in intervals if interval)])
        yield index, end - index
        index = end


def in_ranges(run: Callable[[int, int], None], lanes: int, threads: int, width: int) -> None:
    """Run on ranges of at most `width` lanes, or on several threads on several for each."""
    share = -(-lanes // (threads * _SHARES * _MULTIPLE)) * _MULTIPLE if threads > 1 else width
    ranges = [(lo, min(lanes, lo + share)) for lo in range(0, lanes, share)]
    if threads == 1 or len(ranges) == 1:
        for lo, hi in ranges:
            run(lo, hi)
        return
    with ThreadPoolExecutor(min(threads, len(ranges))) as pool:
        for done in [pool.submit(run, lo, hi) for lo, hi in ranges]:
            done.result()
