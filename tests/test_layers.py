"""The layers of the library: imports point down, never up and never in circles, and loading a file loads nothing heavy.

`violations` reads one file without running it, so an import inside a function counts for the layers too. Heavy
packages may be imported inside functions, where they cost only those who call them.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections import deque
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from helpers import parsed

import kahanmaps_cli
from kahanmaps import internals
from kahanmaps.experiments.results.store import Store

ROOT = Path(__file__).resolve().parent.parent

# The layers from the lowest on, one folder or file of kahanmaps/ each.
LAYERS = [
    *("errors", "hints", "version", "sources", "display_protocols", "atomic_files", "processes", "hard_stop"),
    *("algebra", "function_calls", "systems", "family", "maps", "documents", "invariants"),
    *("checks", "paper", "laboratory", "experiments"),
    *("display", "languages", "certificates", "plots", "reports"),
    "internals",
]

NEVER_IN_THE_LIBRARY = {"click", "rich", "kahanmaps_cli"}
NEVER_WHILE_LOADING = {"matplotlib", "numba", "llvmlite", "distributed"}
NUMPY_WHILE_LOADING = (
    "kahanmaps/maps/floats/float_orbit.py",
    "kahanmaps/maps/floats/",
    "kahanmaps/maps/residues/",
    "kahanmaps/plots/",
)
# Whoever reads a clock: those who run batches, and a kind of value in files (a date); never what finds an answer.
CLOCKS = {"time", "datetime", "timeit", "sched"}
WITH_A_CLOCK = ("kahanmaps/errors.py", "kahanmaps/experiments/running/")
# A file of compiled kernels may import numba or llvmlite at its top if nobody imports the file while being loaded.
KERNELS = ("kahanmaps/maps/floats/machine_code.py", "kahanmaps/maps/numba_cache.py")


_PARTS = ("body", "orelse", "finalbody", "handlers", "cases")  # of statements, where statements stand


def python_files() -> list[Path]:
    """The files of both packages."""
    return sorted([*(ROOT / "kahanmaps").rglob("*.py"), *(ROOT / "cli" / "kahanmaps_cli").rglob("*.py")])


def violations(path: str, source: str) -> list[str]:
    """What the file `path` (from the top folder, with slashes) imports and should not, one sentence each."""
    tree = parsed(source)
    module = path.removeprefix("cli/").removesuffix(".py").split("/")
    package = module[:-1]
    results = []
    for line, target in _imports(tree.body, package):
        results += [f"{path}:{line}: {what}" for what in _off_layer(module, target.split("."))]
        if target.split(".")[0] in CLOCKS and path.startswith("kahanmaps/") and not path.startswith(WITH_A_CLOCK):
            results.append(f"{path}:{line}: reads a clock: answers would depend on the machine, count work instead")
    for line, target in _imports(tree.body, package, only_while_loading=True):
        top = target.split(".")[0]
        is_kernel = target.startswith(tuple(kernels.removesuffix(".py").replace("/", ".") for kernels in KERNELS))
        if is_kernel and path not in KERNELS:
            results.append(f"{path}:{line}: imports {target} while it is loaded: import it inside the function")
        if top in NEVER_WHILE_LOADING and not (top in ("numba", "llvmlite") and path in KERNELS):
            results.append(f"{path}:{line}: imports {top} while it is loaded: import it inside the function")
        if top == "numpy" and not path.startswith(NUMPY_WHILE_LOADING):
            results.append(f"{path}:{line}: imports numpy while it is loaded: only {NUMPY_WHILE_LOADING} may")
    return list(dict.fromkeys(results))


def _off_layer(importer: list[str], target: list[str]) -> list[str]:
    if importer[0] == "kahanmaps" and target[0] in NEVER_IN_THE_LIBRARY:
        return [f"the library imports {target[0]}"]
    if importer[0] == "kahanmaps_cli" or target[0] != "kahanmaps" or importer == ["kahanmaps", "__init__"]:
        return []
    if importer[1] not in LAYERS:
        return [f"kahanmaps/{importer[1]} has no layer in LAYERS"]
    if target[1:] == ["__version__"]:  # set in kahanmaps/__init__.py before anything else; records carry it
        return []
    if len(target) == 1 or target[1] not in LAYERS:
        return [f"imports {'.'.join(target)}, which stands above all layers: import the module that defines it"]
    if LAYERS.index(target[1]) > LAYERS.index(importer[1]):
        return [f"{importer[1]} imports {target[1]}, a layer above"]
    return []


def _imports(body: list[ast.stmt], package: list[str], only_while_loading: bool = False) -> Iterator[tuple[int, str]]:
    """Line and full dotted name of every import; `from a import b` gives a.b.

    With `only_while_loading`, leaves out what loading the file does not run: functions and `if TYPE_CHECKING`.
    """
    for node in _statements(body, only_while_loading):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = [*above, *(node.module.split(".") if node.module else [])]
            for name in node.names:
                yield node.lineno, ".".join([*base, name.name])


def _statements(body: list[ast.stmt], only_while_loading: bool = False) -> Iterator[ast.AST]:
    """All statements, and those within them."""
    waiting: deque[ast.AST] = deque(body)
    while waiting:
        node = waiting.popleft()
        yield node
        if only_while_loading and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if only_while_loading and isinstance(node, ast.If) and _is_type_checking(node.test):
            waiting += node.orelse
        else:
            waiting += (entry for part in _PARTS for entry in getattr(node, part, ()))


def _is_type_checking(test: ast.expr) -> bool:
    return ast.unparse(test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")


def test_every_file_imports_its_own_layer_and_those_below():
    results = []
    for path in python_files():
        results += violations(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"))
    assert not results, "\n" + "\n".join(results)


def circle(files: dict[str, str]) -> list[str]:
    """Modules of kahanmaps that import each other in a circle, [] where there is none; `files` has path and source.

    Imports inside functions and those for types alone count: who reads the one file has to read the other.
    """
    modules = {path.removesuffix(".py").removesuffix("/__init__").replace("/", "."): path for path in files}
    graph = {}
    for module, path in modules.items():
        package = path.split("/")[:-1]
        named = {target for _, target in _imports(parsed(files[path]).body, package)}
        named |= {target.rpartition(".")[0] for target in named if target not in modules}
        graph[module] = named & modules.keys() - {"kahanmaps", module}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_files_import_each_other_in_a_circle():
    library = (path for path in python_files() if path.is_relative_to(ROOT / "kahanmaps"))
    assert circle({path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in library}) == []


@pytest.mark.parametrize(
    "back", ["from kahanmaps.a.two import f", "from .two import f", "def g():\n    from kahanmaps.a import two"]
)
def test_a_circle_is_found_whatever_hides_it(back):
    files = {"kahanmaps/a/one.py": back, "kahanmaps/a/two.py": "if TYPE_CHECKING:\n    from kahanmaps.a.one import g"}
    assert set(circle(files)) == {"kahanmaps.a.one", "kahanmaps.a.two"}
    assert circle(files | {"kahanmaps/a/two.py": "from kahanmaps import three"}) == []


MAPS, FLOATS = "kahanmaps/maps/kahan.py", "kahanmaps/maps/floats"
KERNEL = "from kahanmaps.maps.floats.machine_code import MachineCode"

# A path, a source, and what is said of it, if anything.
SOURCES = [
    ("kahanmaps/algebra/fields.py", "from kahanmaps.maps.kahan import step", "imports maps, a layer above"),
    ("kahanmaps/errors.py", "from .algebra import fields", "imports algebra, a layer above"),
    (MAPS, "def f():\n    from kahanmaps.plots import draw", "imports plots, a layer above"),
    (MAPS, "if TYPE_CHECKING:\n    from kahanmaps.checks import Claim", "imports checks, a layer above"),
    (MAPS, "from kahanmaps import QuadraticSystem", "above all layers"),
    ("kahanmaps/helpers.py", "from kahanmaps import errors", "has no layer"),
    (MAPS, "def f():\n    import click", "the library imports click"),
    (MAPS, "import numpy as np", "imports numpy while it is loaded"),
    (MAPS, "def f():\n    from time import monotonic", "reads a clock"),
    (f"{FLOATS}/float_orbit.py", "try:\n    import numba\nexcept ImportError:\n    pass", "imports numba while"),
    (f"{FLOATS}/ensemble.py", KERNEL, "machine_code.MachineCode while"),
    (MAPS, "def f():\n    import numpy", ""),
    ("kahanmaps/experiments/results/store.py", "from kahanmaps import __version__", ""),
    (f"{FLOATS}/machine_code.py", "import llvmlite\nimport numpy as np", ""),
    (f"{FLOATS}/ensemble.py", f"def f():\n    {KERNEL}", ""),
    ("kahanmaps/plots/figures.py", "import numpy as np\ndef f():\n    from matplotlib.figure import Figure", ""),
    ("cli/kahanmaps_cli/main.py", "import click\nimport kahanmaps\nfrom kahanmaps.plots import draw", ""),
]


@pytest.mark.parametrize(("path", "source", "sentence"), SOURCES)
def test_a_file_that_breaks_the_rule_is_reported_with_its_line(path, source, sentence):
    line = next(number for number, text in enumerate(source.splitlines(), 1) if "import " in text)
    results = violations(path, source)
    assert len(results) == bool(sentence)
    assert all(sentence in result and result.startswith(f"{path}:{line}: ") for result in results)


FOLDER = Path(kahanmaps_cli.__file__).parent


def test_the_name_of_a_class_has_one_meaning():
    names = [
        node.name
        for path in python_files()
        for node in parsed(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]
    assert len(names) > 400
    assert sorted({name for name in names if names.count(name) > 1}) == []


def test_each_name_is_one_of_the_library_and_is_used():
    used = re.findall(r"(?<![\w.])lib\.(\w+)", "\n".join(path.read_text() for path in FOLDER.rglob("*.py")))
    assert sorted(internals.__all__) == sorted(set(used))
    assert [name for name in used if getattr(internals, name) is None] == []


HEAVY = {"numpy", "flint", "rich", "numba", "llvmlite", "matplotlib", "distributed"}


def modules_loaded_by(line: str) -> set[str]:
    """The modules in memory after a command has run in a fresh interpreter."""
    code = f"from kahanmaps_cli.main import main\nassert main({line.split()!r}) == 0"
    report = "\nimport json, sys\nprint('\\n' + json.dumps(sorted(sys.modules)), file=sys.stderr)\n"
    done = subprocess.run([sys.executable, "-c", code + report], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stderr.splitlines()[-1]))


NORMAL_FORMS = {"kahanmaps.family.recognition", "kahanmaps.maps.normal_form.rational_iterate"}


@pytest.mark.parametrize(
    ("line", "some", "heavy"),
    [
        ("--help", set(), HEAVY),
        ("batch status --db DB", set(), HEAVY),
        ("orbit harmonic --start 1,2 --eps 1/10 --steps 1", {"flint"}, {*HEAVY, *NORMAL_FORMS} - {"flint", "rich"}),
        ("orbit paper_m2 --start 1,2,3,4 --eps 1/10 --at 100", NORMAL_FORMS, set()),
        ("lyapunov harmonic --random 1 --eps 1/10 --steps 100", {"numpy"}, set()),
    ],
)
def test_a_command_loads_what_it_needs_and_nothing_heavy(tmp_path, line, some, heavy):
    Store.open(tmp_path / "results.db", create=True).close()
    loaded = modules_loaded_by(line.replace("DB", str(tmp_path / "results.db")))
    assert (loaded & heavy, some - loaded) == (set(), set())
