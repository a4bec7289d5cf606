"""What all benchmarks share: the work, the clock, the comparison of results, PARI/GP as a peer, tables.

The work is a member of the family in an integer symplectic disguise, drawn from a seed, with eps = 1/10 and a small
rational start whose orbit meets no pole. Contestants get the same data and have to deliver the same exact numbers.
"""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import Any

from flint import fmpq

from kahanmaps import QuadraticSystem, random_member_with_eigenvalues
from kahanmaps.family.random_members import parse_chi, random_member_with_chi
from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form

Row = dict[str, Any]  # contestant, work, seconds, ratio, note; `group` names the table

EIGENVALUES = (1, -2, 3, -4)
START = ("1/2", "-1/3", "1/4", "1", "2/5", "-1", "1/3", "-1/2")
SEED = 5
EPS = fmpq(1, 10)


class Absent(Exception):
    """The contestant cannot take part on this machine, with the reason."""


class Disagreement(Exception):
    """Two contestants have computed different numbers: neither time counts."""


@dataclass(frozen=True, eq=False)
class Work:
    """A system in dimension 2m with its normal form (finding it is in no time), a start and eps."""

    m: int
    system: QuadraticSystem
    normal_form: SystemNormalForm
    start: tuple[fmpq, ...]
    eps: fmpq

    def __str__(self) -> str:
        return f"m = {self.m}"


@lru_cache
def work(m: int = 3) -> Work:
    """The common work. For m = 3 numerators and denominators of the 80th iterate have 35,128 digits."""
    member = random_member_with_eigenvalues(EIGENVALUES[:m], seed=SEED)
    system = member.chosen.system
    normal_form = system_normal_form(system, member=member)
    assert isinstance(normal_form, SystemNormalForm)
    return Work(m, system, normal_form, tuple(fmpq(*map(int, s.split("/"))) for s in START[: 2 * m]), EPS)


@lru_cache
def with_chi(chi: str) -> Work:
    """The same for a member with this chi, any polynomial."""
    member = random_member_with_chi(parse_chi(chi), seed=SEED)
    system = member.chosen.system
    normal_form = system_normal_form(system, member=member)
    assert isinstance(normal_form, SystemNormalForm)
    return Work(system.dim // 2, system, normal_form, work(system.dim // 2).start, EPS)


def peer(module: str) -> ModuleType:
    """An optional package. Raises Absent."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise Absent(f"{module} is not installed") from None


def timed(function: Callable[[], Any], enough: float = 3.0, most: int = 7) -> tuple[float, Any]:
    """The best time of up to `most` runs, fewer once `enough` seconds are spent, and the last result.

    It is processor time: nothing here waits or runs in parallel, and GP's `gettime` is that as well.
    """
    best, spent, result = float("inf"), 0.0, None
    for _ in range(most):
        begin = time.process_time()
        result = function()
        seconds = time.process_time() - begin
        best, spent = min(best, seconds), spent + seconds
        if spent >= enough:
            break
    return best, result


def require_equal(name: str, found: Any, expected: Any) -> None:
    """Raises Disagreement unless the results are equal."""
    if found != expected:
        raise Disagreement(f"{name} has computed something else than kahanmaps")


def row(group: str, contestant: str, work: object, seconds: float | None, ratio: float | None, note: str = "") -> Row:
    """One line of a table. `ratio` is None for a figure that is no comparison, `seconds` for one that is no time."""
    return {
        "group": group,
        "contestant": contestant,
        "work": str(work),
        "seconds": seconds,
        "ratio": ratio,
        "note": note,
    }


def say(text: str) -> None:
    """Progress, on standard error."""
    print(text, file=sys.stderr, flush=True)


# PARI/GP -------------------------------------------------------------------------------------------------------------


def gp_version() -> str:
    """What runs GP programs here. Raises Absent."""
    program = shutil.which("gp")
    if program:
        command = [program, "-q", "-f"]
        answer = subprocess.run(command, input="print(version())\n", capture_output=True, text=True, check=True)
        return "gp " + answer.stdout.strip(" []\n").replace(", ", ".")
    version = peer("cypari").pari("version()")
    return f"cypari with PARI {'.'.join(str(part) for part in version)}"


def run_gp(lines: Sequence[str]) -> list[str]:
    """Run a GP program, one statement a line, and give the lines of its last statement, a vector of printable things.

    Debian's gp if there is one, otherwise the package cypari. GP itself takes the times. Raises Absent.
    """
    program = shutil.which("gp")
    if program:
        text = "\n".join([*(line + ";" for line in lines[:-1]), f"foreach({lines[-1]}, entry, print(entry))", ""])
        answer = subprocess.run(
            [program, "-q", "-f", "-s", "1G"], input=text, capture_output=True, text=True, check=True
        )
        if "***" in answer.stderr:
            raise RuntimeError(answer.stderr.strip())
        return answer.stdout.split("\n")[:-1]
    pari = peer("cypari").pari
    if pari.stacksize() < 10**9:
        pari.allocatemem(10**9)
    for line in lines[:-1]:
        pari(line)
    return [str(entry) for entry in pari(lines[-1])]


# Tables --------------------------------------------------------------------------------------------------------------


def format_ratio(ratio: float | None) -> str:
    """Three digits: 0.412, 2.81, 38.4, 1,230."""
    if ratio is None:
        return ""
    if ratio >= 1000:
        digits = len(str(int(ratio))) - 3
        return f"{round(ratio / 10**digits) * 10**digits:,}"
    return f"{ratio:.3g}" if ratio < 100 else f"{ratio:.0f}"


def format_seconds(seconds: float | None) -> str:
    """Three digits and a unit."""
    if seconds is None:
        return ""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def table(rows: Iterable[Row]) -> str:
    """The rows as plain text, one block a group."""
    lines: list[str] = []
    group, last_work = None, None
    for entry in rows:
        if entry.get("group") != group:
            group = entry.get("group")
            lines += ["", str(group)]
            last_work = None
        if entry["work"] != last_work:
            last_work = entry["work"]
            lines.append(f"  {last_work}")
        ratio, seconds = format_ratio(entry.get("ratio")), format_seconds(entry.get("seconds"))
        lines.append(f"    {entry['contestant']:<66} {ratio:>8}  {seconds:>8}  {entry.get('note', '')}".rstrip())
    return "\n".join(lines).lstrip("\n")
