"""Trying one change at a time (`make mutants`): a copy of the project, and tests that start at once.

A pytest that has collected everything waits in the copy; for each mutant it forks, and the child gives the function
that is changed its new code and runs the tests that are asked for. What is no function's (a constant of a module, a
default) and what is compiled to machine code is tried by a new pytest instead, and so is once more what nothing saw
though some of it had run before the fork.
"""

import ast
import contextlib
import functools
import gc
import json
import os
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import pytest
from hypothesis import Phase, settings

ROOT = Path(__file__).resolve().parent.parent
MEMORY = 8 << 30  # bytes that a mutant may take
Seconds = dict[str, float]  # what each test takes
OPTIONS = ["-q", "-n", "0", "-p", "no:cacheprovider", "--no-header", "--tb=no", "--hypothesis-seed=0"]


class Copy:
    """A copy of the project in which one mutant at a time is tried; `collected` is what the waiting pytest collects."""

    def __init__(self, folder: Path, collected: list[str]) -> None:
        self.root = folder / "project"
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in filter(None, listed.split("\0")):
            if (ROOT / name).is_file():
                (self.root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.root / name)
        self.environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(str(self.root / part) for part in (".", "cli", "tests")),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTHONHASHSEED": "0",
            "NUMBA_CACHE_DIR": str(folder / "numba"),
        }
        subprocess.run([sys.executable, "-m", "compileall", "-q", "kahanmaps", "cli", "tests"], cwd=self.root)
        asked, answer = os.pipe(), os.pipe()
        command = [sys.executable, "-m", "pytest", "-p", "trials", *OPTIONS, f"--basetemp={folder / 'tmp'}"]
        self.waiting = subprocess.Popen(
            [*command, "-m", "not slow or thorough", *collected],
            cwd=self.root,
            env={**self.environment, "TRIALS": f"{asked[0]} {answer[1]}"},
            pass_fds=(asked[0], answer[1]),
            stdout=subprocess.DEVNULL,
        )
        os.close(asked[0])
        os.close(answer[1])
        self.ask, self.answers = os.fdopen(asked[1], "w"), os.fdopen(answer[0])
        self.has_collected = False

    def close(self) -> None:
        """Let the waiting pytest end."""
        self.ask.close()
        self.waiting.wait()
        self.answers.close()

    def tried(self, file: str, source: str, line: int, tests: list[str], seconds: Seconds, again: bool) -> str:
        """What saw the mutant, "" for nothing; `again` where a new pytest is to try what nothing has seen."""
        if not self.has_collected:  # what it collects has to be the unchanged project
            self.answers.readline()
            self.has_collected = True
        path = self.root / file
        times = path.stat()
        try:
            path.write_text(source, encoding="utf-8")
            seen = None if is_compiled(file) else self.run_here(file, line, tests, seconds)
            return self.run_anew(file, tests, seconds) if seen is None or (again and not seen) else seen
        finally:
            shutil.copy2(ROOT / file, path)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            shutil.rmtree(self.root / ".hypothesis", ignore_errors=True)

    def run_here(self, file: str, line: int, tests: list[str], seconds: Seconds) -> str | None:
        """The first test that fails with what is written, None where the change is of no function."""
        patience = [20 + 10 * seconds[test] for test in tests]
        print(json.dumps([file, line, tests, patience]), file=self.ask, flush=True)
        answer = self.answers.readline()
        if not answer:
            raise SystemExit("the waiting pytest has ended; is a test on record not there any more: --measure")
        found: str | None = json.loads(answer)
        return found

    def run_anew(self, file: str, tests: list[str], seconds: Seconds) -> str:
        """The same by a new pytest, a few tests first."""
        environment, compiling = dict(self.environment), is_compiled(file)
        if compiling:  # what is kept is machine code of the unchanged source
            environment["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(dir=self.root.parent)
        return next(filter(None, (self.batch(some, seconds, environment, compiling) for some in batches(tests))), "")

    def batch(self, tests: list[str], seconds: Seconds, environment: dict[str, str], compiling: bool) -> str:
        """The first of these tests that fails, "" for none."""
        patience = 30 + 10 * max(seconds[test] for test in tests) + 300 * compiling
        with subprocess.Popen(
            [sys.executable, "-m", "pytest", "-x", *OPTIONS, "--timeout", str(patience), *tests],
            cwd=self.root,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
        ) as process:
            try:
                told = process.communicate(timeout=2 * patience + 5 * sum(seconds[test] for test in tests))[0]
            except subprocess.TimeoutExpired:
                return "time"
            finally:
                with contextlib.suppress(ProcessLookupError):  # what its tests started and left
                    os.killpg(process.pid, signal.SIGKILL)
        if process.returncode == 0:
            return ""
        if "not found: " in told:
            raise SystemExit("a test on record is not there any more: --measure")
        failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", told, re.MULTILINE)
        return failed.group(1) if failed else f"status {process.returncode}"


def is_compiled(path: str) -> bool:
    return "numba" in path or path.endswith("float_steps.py")


def batches(tests: list[str]) -> Iterator[list[str]]:
    """First a few tests, then ever more of them."""
    size = 15
    while tests:
        yield tests[:size]
        tests, size = tests[size:], 6 * size


# The pytest that waits ------------------------------------------------------------------------------------------------

_failed: list[str] = []


@pytest.hookimpl(tryfirst=True)
def pytest_collection() -> None:
    """Hypothesis is not to look for the smallest example, nor to keep it for the next mutant."""
    phases = (Phase.explicit, Phase.generate)
    settings.register_profile("trials", settings(), phases=phases, database=None)
    settings.load_profile("trials")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        _failed.append(report.nodeid)


def pytest_runtestloop(session: pytest.Session) -> bool:
    """Answer requests until there are no more."""
    asked, answer = (int(end) for end in os.environ["TRIALS"].split())
    items = {item.nodeid: item for item in session.items}
    gc.unfreeze()
    known = gc.get_objects()
    functions: dict[tuple[str, str, int], list[FunctionType]] = {}
    for one in known:
        if isinstance(one, FunctionType):
            functions.setdefault(_place(one.__code__), []).append(one)
    caches = [one for one in known if isinstance(one, functools._lru_cache_wrapper)]
    del known
    gc.freeze()
    with os.fdopen(asked) as requests, os.fdopen(answer, "w") as answers:
        print("collected", file=answers, flush=True)
        for request in requests:
            file, line, tests, patience = json.loads(request)
            code = changed(Path(file), line)
            live = functions.get(_place(code), []) if code else []
            if live or (code and not any(place[0] == code.co_filename for place in functions)):
                found = _forked(live, code, caches, [items[test] for test in tests], patience)
            else:
                found = None
            print(json.dumps(found), file=answers, flush=True)
    return True


def changed(path: Path, line: int) -> CodeType | None:
    """The code of the function around a line, one that stands in no other function; None where it is of none."""
    text = path.read_text(encoding="utf-8")

    def around(node: ast.AST) -> ast.AST | None:
        for inner in ast.iter_child_nodes(node):
            if isinstance(inner, ast.FunctionDef):
                if inner.body[0].lineno <= line <= (inner.end_lineno or line):
                    return inner
            elif (found := around(inner)) is not None:
                return found
        return None

    function = around(ast.parse(text))
    if not isinstance(function, ast.FunctionDef):
        return None
    first = min([function.lineno, *(decorator.lineno for decorator in function.decorator_list)])
    codes = [compile(text, str(path.resolve()), "exec")]
    while codes:
        code = codes.pop()
        if code.co_firstlineno == first and code.co_name == function.name:
            return code
        codes += [inner for inner in code.co_consts if isinstance(inner, CodeType)]
    return None


def _place(code: CodeType) -> tuple[str, str, int]:
    return code.co_filename, code.co_qualname, code.co_firstlineno


def _forked(
    live: list[FunctionType],
    code: CodeType,
    caches: list[Any],
    items: list[pytest.Item],
    patience: list[float],
) -> str:
    """The first of the tests that fails in a process of their own, where the functions have the new code."""
    told, tell = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setsid()
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            for function in live:
                function.__code__ = code
            for cache in caches:
                cache.cache_clear()
            for item, following in zip(items, [*items[1:], None], strict=True):
                item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
                os.write(tell, b"x" if _failed else b".")
        finally:
            os._exit(0)
    os.close(tell)
    try:
        for item, most in zip(items, patience, strict=True):
            if not select.select([told], [], [], most)[0]:
                return "time"
            if (one := os.read(told, 1)) != b".":
                return item.nodeid if one else f"the end of {item.nodeid}"
        return ""
    finally:
        os.close(told)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
