"""What the documentation says in words of single points and orbits: witnesses, and how Lotka-Volterra orbits go."""

import math
import re
from pathlib import Path

import pytest
from flint import arb, ctx
from test_readme import PAGES, ROOT, files

import kahanmaps as km

# A sentence on a witness: eps, x, the image of x, and the integral there and at x.
_SENTENCE = re.compile(
    r"at eps = (\S+) the map takes \(([^)]*)\)\s+to\s+\(([^)]*)\),\s+where\s+H is (\S+)\s+and\s+not\s+(\S+)\. "
)
_WITNESS = re.compile(r"witness: x = \(([^)]*)\), eps = (\S+)\n\s+I\(x~\) = (\S+)\n\s+I\(x\) = (\S+)\n")


def wrong_sentences(page: Path) -> list[str]:
    """The sentences on witnesses that do not repeat the witness that was printed last before them."""
    text, wrong = page.read_text(), []
    for said in _SENTENCE.finditer(text):
        eps, x, _, after, before = said.groups()
        printed = _WITNESS.findall(text[: said.start()])
        if not printed or printed[-1] != (x, eps, after, before):
            wrong.append(said.group())
    return wrong


def test_a_witness_in_words_is_the_one_printed_above_it():
    assert [wrong for page in PAGES for wrong in wrong_sentences(page)] == []
    assert sum(len(_SENTENCE.findall(page.read_text())) for page in PAGES) >= 1


def test_another_witness_in_words_would_be_noticed(tmp_path):
    page = tmp_path / "page.md"
    tutorial = (ROOT / "docs/tutorial.md").read_text()
    for old, new in (("takes (-1, -1)", "takes (0, -1)"), ("H is 31/24", "H is 5/6")):
        page.write_text(tutorial.replace(old, new))
        assert len(wrong_sentences(page)) == 1


def test_the_image_of_the_witness_of_the_tutorial_is_the_one_it_names(tmp_path):
    page = ROOT / "docs/tutorial.md"
    path = tmp_path / "fish.toml"
    path.write_text(files(page)["fish.toml"])
    ((eps, x, image, _, _),) = _SENTENCE.findall(page.read_text())
    assert [str(entry) for entry in km.map(str(path), eps)(x.split(", "))] == image.split(", ")


# docs/kahans-method.md and README.md on Lotka-Volterra: x' = x(1 - y), y' = y(x - 1), with H = x + y - log(xy).


def H(point) -> float:
    x, y = map(float, point)
    return x + y - math.log(x * y)


@pytest.mark.parametrize("y", [1.5, 2.5, 4])
def test_the_orbits_of_the_picture_stay_on_rings_and_those_of_euler_do_not(y):
    orbit = km.orbit("lotka_volterra", start=[1, y], eps="1/20", steps=400, arithmetic="float")
    kahan = [H(point.x) for point in orbit]
    x, z = 1.0, y
    for _ in range(400):
        x, z = x + x * (1 - z) / 10, z + z * (x - 1) / 10
    width, start = H((1, y)) - 2, H((1, y))  # 2 is the minimum of H
    assert max(abs(value - start) for value in kahan) < width / 10
    assert x < 0 or z < 0 or H((x, z)) - start > width / 2


def test_the_orbit_of_5_1_leaves_the_positive_quadrant_at_step_139(monkeypatch):
    # Balls of 2,000 bits, for the digits of exact points double at every step.
    monkeypatch.setattr(ctx, "prec", 2000)
    x, y, e = arb(5), arb(1), arb(1) / 5
    step = 0
    while x > 0 and y > 0 and step < 200:
        step += 1
        # (I - eps f') (x~ - x) = 2 eps f by Cramer's rule
        a, b, c, d = 1 - e * (1 - y), e * x, -e * y, 1 - e * (x - 1)
        f, g, det = 2 * e * x * (1 - y), 2 * e * y * (x - 1), a * d - b * c
        x, y = x + (f * d - b * g) / det, y + (a * g - c * f) / det
    assert step == 139
    assert x < 0 or y < 0
