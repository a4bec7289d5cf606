"""The changes that `make mutants` tries: which ones there are, where there are none, and that samples come again."""

import ast
import tomllib
from pathlib import Path

import pytest
from mutants import ROOT, Changes, sample, within
from trials import batches
from trials import changed as changed_code

from kahanmaps.maps import kahan


def changed(source: str) -> list[str]:
    """The sources that differ from this one by one change."""
    found = Changes("example.py", source).found
    texts = [source[: one.begin] + one.new + source[one.end :] for one in found]
    for text in texts:
        ast.parse(text)
    return texts


@pytest.mark.parametrize(
    ("source", "mutants"),
    [
        ("a - b*c", ["((a) + (b*c))", "a - ((b) + (c))"]),
        ("x = -y", ["x = (y)"]),
        ("a <= b", ["(a < b)", "(a > b)"]),
        ("a < b == c", ["(a <= b == c)", "(a >= b == c)", "(a < b != c)"]),
        ("a is None and not b", ["((a is None) or (not b))", "(a is not None) and not b", "a is None and (b)"]),
        ("Q[i][j, k]", ["Q[i][k, j]"]),
        ("S.transpose()", ["S"]),
        ("min(a, b)", ["max(a, b)"]),
        ("f(7)", ["f(8)", "f(6)"]),
        ("x[0].value", ["x[1].value", "x[(-1)].value"]),
        ("x = True", ["x = False"]),
        ("n += k", ["n -= k"]),
        ("if a:\n    return\n", ["if False:\n    return\n"]),
        ("d = a + é*b", ["d = ((a) - (é*b))", "d = a + ((é) + (b))"]),
    ],
)
def test_a_change_is_one_of_the_mathematics(source: str, mutants: list[str]) -> None:
    inside = source.startswith("if")
    texts = changed(f"def f():\n    {source}".replace("\n    return", "\n        return") if inside else source)
    assert [text.removeprefix("def f():\n    ").replace("\n        ", "\n    ") for text in texts] == mutants


@pytest.mark.parametrize(
    "source",
    [
        '"""One, 1 + 1."""',
        "def f(x: Array[1, 2]) -> Matrix[3]: ...",
        "def f(x, seed=0, *, seconds=60): ...",
        "raise ValueError(1 + x)",
        'text = f"{x + 1}"',
        'text = "a" + b',
        "zip(a, b, strict=True)",
        "def __repr__(self):\n    return self.x + 1",
        "deadline = monotonic() + seconds",
        "progress(k + 1)",
        "self.spend(2 * bits, column)",
        "x: int = field(repr=False)",
        "zero = terms[0].context()",
        "Pattern = tuple[bool, ...]",
        "@cache(maxsize=3)\ndef f(): ...",
        "_MOST_TERMS = 2000",
        "_CYCLE = 2 * 10**6",
        "_SECONDS = {2: 16.0}",
        "MAX_POINTS = 1 << 20",
        "DEFAULT_STEPS = 60",
    ],
)
def test_what_is_no_mathematics_is_left_alone(source: str) -> None:
    assert changed(source) == []


def test_names_of_changes_are_unique_within_a_file() -> None:
    found = Changes("example.py", "x = 1 + 1\ndef f():\n    x = 1 + 1\n    x = 1 + 1\n").found
    assert len({one.key for one in found}) == len(found)
    assert [one.kind for one in found if one.function == "f"][:2] == ["+ -> -", "1 -> 2"]


def test_a_seed_and_a_count_give_the_same_sample_again_and_lines_but_once() -> None:
    path = Path(kahan.__file__)
    every = Changes("kahan.py", path.read_text(encoding="utf-8")).found
    chosen = sample(every, 5, seed=3)
    assert chosen == sample(list(every), 5, seed=3)
    assert chosen != sample(every, 5, seed=4)
    assert len({one.line for one in chosen}) == 5


def test_equivalent_changes_are_listed_with_a_reason_and_are_of_lines_that_are_there() -> None:
    listed = tomllib.loads((ROOT / "tests" / "mutants.toml").read_text(encoding="utf-8"))["equivalent"]
    assert [one for one in listed if one["line"] not in (ROOT / one["file"]).read_text(encoding="utf-8")] == []
    assert all(one["reason"] for one in listed)
    assert {tuple(one) for one in listed} == {("file", "function", "line", "kind", "reason")}


def test_tests_run_in_order_and_within_their_time() -> None:
    seconds = {f"t{k}": 1.0 for k in range(200)}
    assert [len(some) for some in batches(list(seconds))] == [15, 90, 95]
    assert within(list(seconds), seconds, 20) == [f"t{k}" for k in range(20)]


def test_a_change_is_found_in_the_function_that_stands_in_no_other(tmp_path: Path) -> None:
    source = "a = 1\nclass C:\n  @property\n  def f(self, x=1):\n    def g():\n      return 2\n    return g\n"
    path = tmp_path / "example.py"
    path.write_text(source)
    codes = [changed_code(path, line) for line in range(1, 8)]
    assert [code and code.co_qualname for code in codes] == [None, None, None, None, "C.f", "C.f", "C.f"]
