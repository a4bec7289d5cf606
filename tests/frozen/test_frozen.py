"""What the library says, frozen: answers to many commands, as they were, and as they have to be after any rebuilding.

A file of this folder is one system: `system` is what @ stands for in the command lines below it, `files` are files that
the commands read, `fast` and `slow` map command lines to what they answered. An answer has the exit status, what was
printed without times, versions, primes drawn and the echo of the input, and `bounds` apart from it: sizes, how many
random points, and what follows of the probability of an error. These are compared by tests of their own, which
`-k "not bounds"` leaves out. Numbers of such kinds within sentences are N; of long texts, and of the claims of the
paper but in paper_m2 (`in_full`), there is a digest.

Searches get a time that they never use up, so that no answer depends on the machine; `left_out` says what is missing
and why. The answers are right as far as the other tests know: here they need not be right, but the same.

    python tests/frozen/test_frozen.py [NAME...]        # writes anew what has changed; git diff shows it
    {"fast": {"degrees @ --terms 5 --json": null}}      # a new answer: null, and then the same
"""

import hashlib
import io
import json
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest

from kahanmaps_cli.main import main

FOLDER = Path(__file__).parent
# Of longer texts, and of numbers with more digits, the length and a part of the SHA-256 are kept; lines of WIDTH.
LONGEST, MOST_DIGITS, WIDTH = 400, 50, 150
NUMBER = re.compile(r"-?\d+(/\d+)?")

# Of the input, of the machine, or told elsewhere: `text` says what S and r are, B what g is, `summary` what theorem it
# is, and parts of an analysis have commands of their own. Null, false and empty is the same here as not there.
DROPPED = {"version", "seconds", "convention", "time_step", "command", "check", "seed", "error_bits", "latex"}
DROPPED |= {"system", "document", "other_document", "primes", "lines", "arithmetic"}
TOLD_BY = {"text": {"S", "r"}, "B": {"rhs"}, "key": {"section", "section_title", "place", "label", "source"}}
TOLD_BY["error_bound"] = {"summary"}  # which is about nothing else
TOLD_BY["record"] = {"variables", "rhs"}
TOLD_BY["summary"] = {"theorem", "hypotheses", "hypotheses_verified", "eps"}
TOLD_BY["statements"] = {"integrals", "densities", "degrees", "heights", "symmetries", "commuting", "singularities"}
TOLD_BY["statements"] |= {"poisson", "flow", "invariant_curves", "divergence", "fixed_points", "equivalent"}

# The keys of what is written as one line, there being much of it.
LINES = {"method", "method summary", "step bits", "section status text", "kind text verdict"}

# How sure, and how much work. `points` counts random points where a method is named, and is an answer elsewhere.
BOUNDS = {"error_bound", "degree_bound", "coefficient_bits_bound", "pole_degree_bound", "splitting_field_degree_bound"}
BOUNDS |= {"products_of_terms", "indeterminates", "blocks", "poles_met", "undefined_at"}
COUNTED = re.compile(r"(?<=2\^-)\d+|(?<=random of )\d+(?= bits)|\b\d+ (random points?|blocks?)\b|GF\(\d{12,}\)")


def sha(text: str) -> str:
    """What tells a text from others."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def split(value: Any, path: str, bounds: dict[str, Any], in_full: bool) -> Any:
    """What is kept of a value; what belongs to the bounds is put there, under the path of what it belongs to."""
    if isinstance(value, dict):
        told = set().union(*(TOLD_BY[key] for key in TOLD_BY if value.get(key)))
        apart = BOUNDS | ({"points"} if "method" in value else set())
        if found := {key: value[key] for key in value if key in apart and value[key]}:
            bounds[path] = found
        rest = {key: entry for key, entry in value.items() if key not in DROPPED | told | apart}
        kept = {key: split(entry, f"{path}/{key}".lstrip("/"), bounds, in_full) for key, entry in rest.items()}
        kept = {key: entry for key, entry in kept.items() if entry not in (None, "", [], {}) and entry is not False}
        return in_a_line(kept, in_full)
    if isinstance(value, list):
        entries = [split(entry, f"{path}/{k}".lstrip("/"), bounds, in_full) for k, entry in enumerate(value)]
        numbers = all(isinstance(entry, str) and NUMBER.fullmatch(entry) for entry in entries)
        return ", ".join(entries) if entries and numbers else entries
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, str):
        text = COUNTED.sub("N", value)
        most = MOST_DIGITS if NUMBER.fullmatch(text) else LONGEST
        return text if len(text) <= most else f"{len(text)} characters, {sha(text)}"
    return value


def in_a_line(kept: dict[str, Any], in_full: bool) -> Any:
    """The same, shorter where there is much of its kind."""
    if "key" in kept:  # a claim of the paper, with a digest of all that is said of it
        everything = sha(json.dumps(kept, sort_keys=True))[:8]
        broken = f" without {kept['breaks']}" if "breaks" in kept else ""
        texts = [kept["claim"], kept["formula"]] if in_full else []
        return " | ".join([f"{kept['key']}{broken}: {kept['verdict']} {everything}", *texts])
    return ": ".join(map(str, kept.values())) if " ".join(kept) in LINES else kept


@lru_cache(maxsize=8)  # the answer and its bounds are compared by two tests, one after the other
def said(name: str, line: str) -> dict[str, Any]:
    """What the library says now: the exit status, the answer or the error, the bounds."""
    given = read(name)
    words = [given["system"] if word == "@" else [word] for word in shlex.split(line)]
    out, err = io.StringIO(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder, chdir(folder), redirect_stdout(out), redirect_stderr(err):
        for file, lines in given.get("files", {}).items():
            Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")
        status = main([piece for word in words for piece in word])
    if status == 2:
        return {"status": status, "error": err.getvalue().rstrip()}
    printed = out.getvalue().splitlines()
    answer = [json.loads(each) for each in printed] if "json" in line else printed
    bounds: dict[str, Any] = {}
    kept = split(answer[0] if len(answer) == 1 else answer, "", bounds, line in given.get("in_full", ()))
    with_bounds = bounds and not line.startswith("verify")  # of hundreds of claims
    return {"status": status, "answer": kept} | ({"bounds": bounds} if with_bounds else {})


def differences(was: Any, now: Any, path: str = "") -> Iterator[str]:
    """Where two answers differ, a line each."""
    if isinstance(was, dict) and isinstance(now, dict):
        for key in dict.fromkeys((*was, *now)):
            yield from differences(was.get(key, "(nothing)"), now.get(key, "(nothing)"), f"{path}/{key}")
    elif isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        for k, (old, new) in enumerate(zip(was, now, strict=True)):
            yield from differences(old, new, f"{path}/{k}")
    elif was != now:
        yield f"{path}\n    was {json.dumps(was)}\n    is  {json.dumps(now)}"


@lru_cache(maxsize=2)
def read(name: str) -> dict[str, Any]:
    """The file of a system."""
    return dict(json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")))


def pretty(value: Any, indent: str = "") -> str:
    """JSON with everything in one line that fits into it, so that a difference shows as one."""
    flat = json.dumps(value, ensure_ascii=False)
    if not isinstance(value, dict | list) or len(indent) + len(flat) <= WIDTH or not set(flat) & set('{"'):
        return flat
    inner = indent + " "
    if isinstance(value, dict):
        lines = [f"{inner}{json.dumps(key)}: {pretty(entry, inner)}" for key, entry in value.items()]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    return "[\n" + ",\n".join(inner + pretty(entry, inner) for entry in value) + f"\n{indent}]"


def write(name: str) -> None:
    """Put what the library says now into the file of a system."""
    given = read(name)
    given |= {speed: {line: said(name, line) for line in given.get(speed, {})} for speed in ("fast", "slow")}
    (FOLDER / f"{name}.json").write_text(pretty(given) + "\n", encoding="utf-8")


NAMES = sorted(path.stem for path in FOLDER.glob("*.json"))

# One system or two of each kind; the others are for thorough runs.
EVERY_DAY = {
    "collapse_at_half",
    "dim1_quadratic",
    "euler_top",
    "harmonic",
    "henon_heiles",
    "ishii",
    "kirchhoff_case",
    "lagrange_top",
    "linear_rotation",
    "lorenz",
    "lotka_volterra",
    "member_m1",
    "member_m2_complex",
    "member_m3_mixed",
    "nahm_tetrahedral",
    "paper_m3_irreducible",
    "planar_cubic_hamiltonian",
    "polynomial_map",
    "riccati",
    "riccati_pair",
    "so4_euler_manakov",
    "three_wave",
    "two_planar_cubics",
    "volterra_periodic_5",
    "weierstrass",
    "zander_111",
}


def frozen() -> Iterator[Any]:
    """All that is frozen, as parameters of a test."""
    for name in NAMES:
        given = read(name)
        for speed in ("fast", "slow"):
            for line, was in given.get(speed, {}).items():
                seldom = speed == "fast" and name not in EVERY_DAY
                marks = [pytest.mark.slow] * (seldom or speed == "slow") + [pytest.mark.thorough] * seldom
                yield pytest.param(name, line, ("status", "answer", "error"), marks=marks, id=f"{name}: {line}")
                if was and "bounds" in was:
                    yield pytest.param(name, line, ("bounds",), marks=marks, id=f"{name}: {line} (bounds)")


@pytest.mark.parametrize(("name", "line", "parts"), list(frozen()))
def test_what_the_library_says_is_what_it_said(name: str, line: str, parts: tuple[str, ...]):
    given = read(name)
    was, now = (given.get("fast", {}) | given.get("slow", {}))[line], said(name, line)
    found = list(differences(*({part: each.get(part) for part in parts} for each in (was or {}, now))))
    assert not found, f"kahanmaps {line}, @ = {shlex.join(given['system'])}\n" + "\n".join(found)


def test_the_systems_of_every_day_are_there():
    assert set(NAMES) >= EVERY_DAY


def test_a_difference_is_told_with_its_place():
    was = {"degrees": [1, 2, 4], "verdict": "proved", "witness": None}
    now = {"degrees": [1, 2, 3], "verdict": "proved", "note": "new"}
    assert [line.splitlines()[0] for line in differences(was, now)] == ["/degrees/2", "/witness", "/note"]
    assert list(differences(was, dict(was))) == []


if __name__ == "__main__":
    for each in sys.argv[1:] or NAMES:
        write(each)
