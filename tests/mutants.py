"""Do the tests bite?  Single changes to the mathematics at random, and whether a test sees each one (`make mutants`).

    python tests/mutants.py [--count 100] [--seed 0] [--only kahanmaps/maps/] [--jobs 2] [--list]

A mutant is one change to one line: another operator, a sign or `not` or transpose dropped, a number one larger or
smaller, a comparison turned round or moved by its boundary, and for or, indices swapped, a guard that never closes. It
is written into a copy of the project in a temporary folder, and the tests that execute the line run there: those that
saw another change to the function, those of its own folder, quick ones first, no slow ones but those marked thorough.
One that fails, or takes far too long, has seen the change. Which test executes what is measured once, which takes a
quarter of an hour, and kept in .mutants: it is done again where the code has changed, and for new tests by
--measure tests/NEW.py.

Lines are drawn first, then one of the changes to each. Changes that no test can see, for they change nothing that is
promised, are listed with their reasons in tests/mutants.toml. The exit status is 1 if tests see fewer than 95 of 100 of
the others. Docstrings, annotations, messages, seeds, times and what only prints are left as they are.
"""

import argparse
import ast
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import coverage
import pytest
from trials import ROOT, Copy, is_compiled

KEPT = ROOT / ".mutants"
FOLDERS = ("algebra", "maps", "invariants", "checks", "laboratory", "paper", "family", "systems", "documents")
LIMITS = "tests/test_limits.py"
TESTS = [*(f"tests/{folder}" for folder in FOLDERS), "kahanmaps", "tests/cli", "tests/frozen", LIMITS]
ENOUGH = 0.95

SWAPPED: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "+"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "//"),
    ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
}
TURNED: dict[type[ast.AST], list[tuple[str, str]]] = {
    ast.Lt: [("<", "<="), ("<", ">=")],
    ast.LtE: [("<=", "<"), ("<=", ">")],
    ast.Gt: [(">", ">="), (">", "<=")],
    ast.GtE: [(">=", ">"), (">=", "<")],
    ast.Eq: [("==", "!=")],
    ast.NotEq: [("!=", "==")],
    ast.Is: [("is", "is not")],
    ast.IsNot: [("is not", "is")],
    ast.In: [("in", "not in")],
    ast.NotIn: [("not in", "in")],
}
PRINTS = re.compile(r"__repr__|__str__|_repr_\w+_|to_json|\w*_html")
NO_MATHEMATICS = {"seed", "seconds", "progress", "maxsize", "strict", "repr", "init", "kw_only"}  # names of arguments
NO_MATHEMATICS_IN = re.compile(
    r"\b(seconds|_SECONDS|deadline|monotonic|get_close_matches|progress|randint|randrange|Random|spend)\b"
)
LIKE = {
    "context",
    "dim",
    "nrows",
    "ncols",
}  # the same for all of a list: any X[0] will do
TYPES = {"tuple", "dict", "list", "Callable", "Mapping"}


@dataclass(frozen=True)
class Mutant:
    """One change: `old`, which stands from `begin` to `end` in the file, becomes `new`."""

    path: str
    function: str
    line: int
    last: int
    text: str
    kind: str
    old: str
    new: str
    begin: int
    end: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line}  {self.kind}  {self.text.strip()[:100]}"

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What it is called in tests/mutants.toml: no line number, for these move."""
        return (self.path, self.function, self.text.strip(), self.kind)


class Changes(ast.NodeVisitor):
    """All mutants of one file."""

    def __init__(self, path: str, source: str) -> None:
        self.path, self.source = path, source
        self.lines = source.splitlines(keepends=True)
        self.bytes = [line.encode() for line in self.lines]
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line))
        self.names: list[str] = []
        self.skipped: set[int] = set()
        self.found: list[Mutant] = []
        self.visit(ast.parse(source))
        seen: Counter[tuple[str, ...]] = Counter()
        for k, mutant in enumerate(self.found):
            seen[mutant.key] += 1
            if seen[mutant.key] > 1:
                self.found[k] = replace(mutant, kind=f"{mutant.kind} #{seen[mutant.key]}")

    def place(self, line: int, column: int) -> int:
        """The index in the source; ast counts columns in bytes."""
        return self.starts[line - 1] + len(self.bytes[line - 1][:column].decode())

    def span(self, node: ast.AST) -> tuple[int, int]:
        return self.place(node.lineno, node.col_offset), self.place(node.end_lineno, node.end_col_offset)  # type: ignore

    def code(self, node: ast.AST) -> str:
        begin, end = self.span(node)
        return self.source[begin:end]

    def add(self, node: ast.AST, kind: str, new: str) -> None:
        begin, end = self.span(node)
        line, last = node.lineno, node.end_lineno  # type: ignore[attr-defined]
        text, old = self.lines[line - 1], self.source[begin:end]
        self.found.append(Mutant(self.path, ".".join(self.names), line, last, text, kind, old, new, begin, end))

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            if PRINTS.fullmatch(node.name):
                return
            self.names.append(node.name)
            self.inside(node)
            self.names.pop()
        elif not self.is_no_mathematics(node):
            if isinstance(node, ast.arguments):
                named = [*zip(reversed([*node.posonlyargs, *node.args]), reversed(node.defaults), strict=False)]
                named += zip(node.kwonlyargs, node.kw_defaults, strict=True)  # type: ignore[arg-type]
                self.skipped |= {id(default) for argument, default in named if argument.arg in NO_MATHEMATICS}
            if isinstance(node, ast.Attribute) and node.attr in LIKE and isinstance(node.value, ast.Subscript):
                self.skipped |= {id(node.value.slice)} if isinstance(node.value.slice, ast.Constant) else set()
            self.change(node)
            self.inside(node)

    def is_no_mathematics(self, node: ast.AST) -> bool:
        """Clocks, work, random numbers, words; private numbers of a module and MAX_..., limits of effort and sizes."""
        if isinstance(node, ast.Assign) and not self.names and isinstance(node.targets[0], ast.Name):
            limit = node.targets[0].id.startswith(("_", "DEFAULT_", "MAX_")) and _is_number(node.value)
            return limit or bool(NO_MATHEMATICS_IN.search(self.code(node)))
        kinds = (ast.BinOp, ast.Compare, ast.Assign, ast.Expr)
        return isinstance(node, kinds) and bool(NO_MATHEMATICS_IN.search(self.code(node)))

    def inside(self, node: ast.AST) -> None:
        """Go on to what belongs to the mathematics."""
        for field, value in ast.iter_fields(node):
            if field in ("annotation", "returns", "decorator_list") or isinstance(node, (ast.JoinedStr, ast.Raise)):
                continue
            for part in value if isinstance(value, list) else [value]:
                if isinstance(part, ast.keyword) and part.arg in NO_MATHEMATICS:
                    continue
                if isinstance(part, ast.AST) and id(part) not in self.skipped:
                    self.visit(part)

    def change(self, node: ast.AST) -> None:
        """The changes to this node itself."""
        if isinstance(node, ast.BinOp) and type(node.op) in SWAPPED and not _is_text(node):
            old, new = SWAPPED[type(node.op)]
            self.add(node, f"{old} -> {new}", f"(({self.code(node.left)}) {new} ({self.code(node.right)}))")
        elif isinstance(node, ast.AugAssign) and type(node.op) in SWAPPED and not _is_text(node):
            old, new = SWAPPED[type(node.op)]
            self.add(node, f"{old}= -> {new}=", f"{self.code(node.target)} {new}= {self.code(node.value)}")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
            what = "sign dropped" if isinstance(node.op, ast.USub) else "not dropped"
            self.add(node, what, f"({self.code(node.operand)})")
        elif isinstance(node, ast.BoolOp):
            old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
            self.add(node, f"{old} -> {new}", "(" + f" {new} ".join(f"({self.code(v)})" for v in node.values) + ")")
        elif isinstance(node, ast.Compare):
            pieces = [self.code(node.left), *(self.code(other) for other in node.comparators)]
            for k, operator in enumerate(node.ops):
                for old, new in TURNED[type(operator)]:
                    words = [SIGN[type(op)] for op in node.ops]
                    words[k] = new
                    text = pieces[0] + "".join(f" {w} {p}" for w, p in zip(words, pieces[1:], strict=True))
                    self.add(node, f"{old} -> {new}", f"({text})")
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            self.add(node, f"{node.value} -> {not node.value}", str(not node.value))
        elif isinstance(node, ast.Constant) and isinstance(node.value, int):
            for new in (node.value + 1, node.value - 1):
                self.add(node, f"{node.value} -> {new}", str(new) if new >= 0 else f"({new})")
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple) and len(node.slice.elts) > 1:
            first, second, *rest = [self.code(part) for part in node.slice.elts]
            known = isinstance(node.value, (ast.Name, ast.Attribute, ast.Subscript, ast.Call))
            if first != second and known and self.code(node.value) not in TYPES:
                new = ", ".join([second, first, *rest])
                self.add(node, "indices swapped", f"{self.code(node.value)}[{new}]")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "transpose":
            self.add(node, "transpose dropped", self.code(node.func.value))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("min", "max"):
            old, new = ("min", "max") if node.func.id == "min" else ("max", "min")
            self.add(node.func, f"{old} -> {new}", new)
        leaves = isinstance(node, ast.If) and not node.orelse and isinstance(node.body[-1], LEAVES)
        if leaves and not NO_MATHEMATICS_IN.search(self.code(node.test)):
            self.add(node.test, "guard dropped", "False")


SIGN = {kind: changes[0][0] for kind, changes in TURNED.items()}
LEAVES = (ast.Raise, ast.Return, ast.Continue, ast.Break)


def _end(node: ast.stmt) -> int:
    return node.end_lineno or node.lineno


def _is_number(node: ast.AST) -> bool:
    """Whether it is a positive number, also written as a power or a product."""
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, (ast.Pow, ast.Mult, ast.LShift)) and _is_number(node.left) and _is_number(node.right)
    return isinstance(node, ast.Constant) and not isinstance(node.value, bool)


def _is_text(node: ast.AST) -> bool:
    return any(isinstance(n, ast.JoinedStr) or isinstance(getattr(n, "value", 0), str) for n in ast.walk(node))


def all_mutants() -> list[Mutant]:
    """Every mutant of the folders, in a fixed order."""
    found: list[Mutant] = []
    for folder in FOLDERS:
        for path in sorted((ROOT / "kahanmaps" / folder).rglob("*.py")):
            found += Changes(str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")).found
    return found


def sample(mutants: list[Mutant], count: int, seed: int) -> list[Mutant]:
    """Lines at random, and of each line one of its mutants."""
    rng = random.Random(f"mutants {seed}")
    lines: dict[tuple[str, int], list[Mutant]] = defaultdict(list)
    for mutant in mutants:
        lines[mutant.path, mutant.line].append(mutant)
    chosen = rng.sample(sorted(lines), min(count, len(lines)))
    return [rng.choice(lines[place]) for place in chosen]


class Coverage:
    """Which tests execute a line, and how long they take."""

    def __init__(self) -> None:
        self.data = coverage.CoverageData(str(KEPT / "coverage"))
        self.data.read()
        self.seconds: dict[str, float] = json.loads((KEPT / "seconds.json").read_text())
        self.by_file: dict[str, list[str]] = defaultdict(list)
        for test in self.seconds:
            self.by_file[test.partition("::")[0]].append(test)

    def tests(self, mutant: Mutant) -> list[str]:
        """The tests that execute the line, in the order in which they are to run; [] where none does."""
        lines = self.data.contexts_by_lineno(str(ROOT / mutant.path))
        wanted = self.lines(mutant, lines)
        contexts = {c for line in wanted for c in lines.get(line, [])} - {""}
        if is_compiled(mutant.path):  # its lines are seen only where a test runs them uncompiled
            own = "floats" if "floats" in mutant.path else "residues"
            lines = self.data.contexts_by_lineno(str(ROOT / f"kahanmaps/maps/{own}/numba_kernel.py"))
            contexts |= {c for line in lines for c in lines[line]} - {""}
        tests = set()
        for context in contexts:
            tests |= {context} if context in self.seconds else set(self.by_file.get(context, ()))
        own = f"tests/{mutant.path.split('/')[1]}/", mutant.path, LIMITS  # its folder of tests, its own docstrings
        order = sorted(tests, key=lambda test: (not test.startswith(own), self.seconds[test]))
        # What one test computed and another finds in a cache is on record for the first alone.
        files = {LIMITS} | {test.partition("::")[0] for test in order if test.startswith(own)}
        others = sorted((t for file in files for t in self.by_file[file] if t not in tests), key=self.seconds.get)
        return order + others

    def is_run_before(self, mutant: Mutant) -> bool:
        """Is the line executed while tests are collected?"""
        lines = self.data.contexts_by_lineno(str(ROOT / mutant.path))
        return any("" in lines.get(line, []) for line in self.lines(mutant, lines))

    def lines(self, mutant: Mutant, lines: dict[int, list[str]]) -> set[int]:
        """The lines to look up: of the expression, or for a constant of a module those that name it."""
        own = set(range(mutant.line, mutant.last + 1))
        if any(set(lines.get(line, [])) - {""} for line in own):
            return own
        tree = ast.parse((ROOT / mutant.path).read_text(encoding="utf-8"))
        around = [n for n in ast.walk(tree) if isinstance(n, ast.stmt) and n.lineno <= mutant.line <= _end(n)]
        for node in around:  # the statement that holds it, whose line is the one on record
            if not hasattr(node, "body") and set(lines.get(node.lineno, [])) - {""}:
                return {node.lineno}
        top, inner = around[0], around[-1]
        if isinstance(top, (ast.Assign, ast.AnnAssign)):
            names = {n.id for n in ast.walk(top) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
            uses = {n.lineno for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id in names}
            own = uses
        else:
            holder = inner if isinstance(inner, ast.FunctionDef) else top  # defaults; attributes of a class
            own = set(range(holder.lineno, _end(holder) + 1))
        return own if any(set(lines.get(line, [])) - {""} for line in own) else set(lines)


def measure(tests: list[str]) -> None:
    """Run all tests once, or some of them again, and write down which lines each executes."""
    if not tests:
        shutil.rmtree(KEPT, ignore_errors=True)
    KEPT.mkdir(exist_ok=True)
    environment = {**os.environ, "COVERAGE_FILE": str(KEPT / "coverage"), "PYTHONPATH": str(ROOT / "tests")}
    command = [sys.executable, "-m", "coverage", "run", "--append", "--source=kahanmaps", "-m", "pytest"]
    command += [
        "-p",
        "mutants",
        "-m",
        "not slow or thorough",
        "-q",
        "-n",
        "0",
        "--timeout",
        "900",
        "--hypothesis-seed=0",
    ]
    subprocess.run([*command, *(tests or TESTS)], cwd=ROOT, env=environment, check=True)
    (KEPT / "measured").write_text(state())


def state() -> str:
    """What has to be the same for a record to be right: the place and the code."""
    code = hashlib.sha256(str(ROOT).encode())
    for path in sorted((ROOT / "kahanmaps").rglob("*.py")):
        code.update(path.read_bytes())
    return code.hexdigest()


def within(tests: list[str], seconds: dict[str, float], most: float) -> list[str]:
    """The first of the tests that take about `most` seconds in all."""
    before = accumulate((seconds[test] for test in tests), initial=0.0)
    return [test for test, total in zip(tests, before, strict=False) if total < most]


def main() -> int:
    """Try a sample; print a line for each and the ratio."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=100, help="how many mutants")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--only", default="", help="only mutants whose FILE:LINE: has this pattern")
    parser.add_argument("--jobs", type=int, default=2, help="how many at once")
    parser.add_argument("--most", type=float, default=300.0, help="seconds of tests for a mutant")
    parser.add_argument("--list", action="store_true", help="print the sample and try nothing")
    parser.add_argument("--measure", nargs="*", metavar="FILE", help="run all tests, or new ones, to see their lines")
    options = parser.parse_args()
    every = all_mutants()
    chosen = sample([m for m in every if re.search(options.only, f"{m.path}:{m.line}:")], options.count, options.seed)
    if options.list:
        print(*chosen, sep="\n")
        return 0
    measured = KEPT / "measured"
    if options.measure is not None or not measured.exists() or measured.read_text() != state():
        measure(options.measure or [])
    record = Coverage()
    listed = tomllib.loads((ROOT / "tests" / "mutants.toml").read_text(encoding="utf-8"))["equivalent"]
    equivalent = {(one["file"], one["function"], one["line"], one["kind"]): one["reason"] for one in listed}
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        made = [Copy(Path(folder) / str(k), TESTS) for k in range(options.jobs)]
        copies: SimpleQueue[Copy] = SimpleQueue()
        for copy in made:
            copies.put(copy)

        seen_by: set[str] = set()
        kills: Counter[tuple[str, str, str]] = Counter()

        def outcome(mutant: Mutant) -> tuple[str, str]:
            if mutant.key in equivalent:
                return "equivalent", equivalent[mutant.key]
            tests = within(record.tests(mutant), record.seconds, options.most)
            if not tests:
                return "SURVIVED", "no test executes it"
            place = mutant.path, mutant.function
            tests.sort(key=lambda test: -kills[*place, test] / record.seconds[test])
            source = (ROOT / mutant.path).read_text(encoding="utf-8")
            source = source[: mutant.begin] + mutant.new + source[mutant.end :]
            before = record.is_run_before(mutant)
            copy, start = copies.get(), time.monotonic()
            try:
                seen = copy.tried(mutant.path, source, mutant.line, tests, record.seconds, again=before)
            finally:
                copies.put(copy)
            seen_by.add(seen)
            kills[*place, seen] += 1
            took = f"{time.monotonic() - start:.0f} s"
            return ("killed", f"by {seen}, {took}") if seen else ("SURVIVED", f"{len(tests)} tests, {took}")

        counts: dict[str, int] = defaultdict(int)
        for mutant, (result, why) in zip(chosen, pool.map(outcome, chosen), strict=True):
            counts[result] += 1
            print(f"{result:10}  {mutant}\n{'':12}{mutant.old!r} -> {mutant.new!r}  {why}", flush=True)
        witnesses = sorted(seen_by & set(record.seconds))
        file, line = chosen[0].path, chosen[0].line
        unchanged = (ROOT / file).read_text(encoding="utf-8")
        if witnesses and (fails := made[0].tried(file, unchanged, line, witnesses, record.seconds, again=True)):
            raise SystemExit(f"{fails} fails without any change, so that it tells nothing")
        for copy in made:
            copy.close()
    for key in sorted(set(equivalent) - {mutant.key for mutant in every}):
        print("listed as equivalent, and not in the code any more:", *key)
    alive = counts["SURVIVED"]
    ratio = counts["killed"] / max(1, counts["killed"] + alive)
    print(f"{counts['killed']} killed, {alive} survived, {counts['equivalent']} equivalent: {100 * ratio:.1f} % seen")
    return 0 if ratio >= ENOUGH else 1


# What `measure` loads into pytest ------------------------------------------------------------------------------------

_seconds: dict[str, float] = {}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Lines that run from here on are this test's."""
    _switch(item.nodeid)
    start = time.perf_counter()
    yield
    _seconds[item.nodeid] = time.perf_counter() - start
    _switch("")
    return True


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: Any, request: pytest.FixtureRequest) -> Iterator[None]:
    """What tests of a file share is run for all of them."""
    if fixturedef.scope == "function":
        return (yield)
    _switch(request.node.nodeid)
    try:
        return (yield)
    finally:
        _switch(request._pyfuncitem.nodeid)


def pytest_sessionfinish() -> None:
    """Write down how long each test took, beside what is known of others."""
    known = KEPT / "seconds.json"
    files = {test.partition("::")[0] for test in _seconds}
    before = json.loads(known.read_text()) if known.exists() else {}
    kept = {test: seconds for test, seconds in before.items() if test.partition("::")[0] not in files}
    known.write_text(json.dumps(kept | _seconds))


def _switch(context: str) -> None:
    current = coverage.Coverage.current()
    if current is not None:
        current.switch_context(context)


if __name__ == "__main__":
    sys.exit(main())
