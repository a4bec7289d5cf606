"""The page with sliders: its orbits are those of the library, what it says is what analyze found."""

import base64
import hashlib
import json
import re
import shutil
import subprocess
from functools import cache
from importlib import resources

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses
from page_helpers import Page

import kahanmaps as km
from kahanmaps.maps.floats.float_conversion import to_float, to_floats
from kahanmaps.reports.explore import explore_data
from kahanmaps.reports.report import report_html

NODE = shutil.which("node")
SCRIPT = resources.files("kahanmaps.reports") / "explore.js"
FILES = {
    "plane": km.load("weierstrass"),
    "no eps": km.load("mcmillan"),
    "hostile": km.SystemFile.from_system(km.QuadraticSystem.from_text(["x"], ["x"]), "</script><script>alert(1)"),
}


@cache
def search_catalog(name):
    return km.analyze(FILES[name])


def run_node(program):
    """What a program prints that uses explore.js as `it`."""
    program = f"const it = require({json.dumps(str(SCRIPT))}); {program}"
    return json.loads(subprocess.run([NODE, "-e", program], capture_output=True, check=True, timeout=60).stdout)


def in_node(data, eps, steps):
    """The points that explore.js computes, and its first function along them."""
    return run_node(
        f"const data = {json.dumps(data)}, points = it.orbit(data.rows, data.start, {eps}, {steps});"
        f"const f = data.functions[0];"
        f"console.log(JSON.stringify([points, f ? points.map((x) => it.functionAt(f, x, {eps})) : []]));"
    )


@pytest.mark.skipif(NODE is None, reason="needs node")
@pytest.mark.parametrize("name", list(FILES))
def test_orbits_in_javascript_are_those_of_the_library(name):
    analysis = search_catalog(name)
    data = explore_data(analysis)
    start = [fmpq(*value.as_integer_ratio()) for value in data["start"]]
    map_ = FILES[name].map.at("1/8")
    points, values = in_node(data, 0.125, 12)
    x = tuple(start)
    for point in points:
        assert point == pytest.approx(to_floats(x).tolist(), rel=1e-9, abs=1e-9)
        x = map_.step(x)
    integrals = analysis.integrals.integrals
    if integrals:
        assert np.allclose(values, to_float(integrals[0].function.value(km.QQ, [*start, fmpq(1, 8)])), rtol=1e-9)


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_another_eps_gives_another_orbit_and_a_singular_step_ends_it():
    data = explore_data(search_catalog("plane"))
    assert in_node(data, 0.1, 3)[0][1] != in_node(data, 0.2, 3)[0][1]
    entry = {**explore_data(search_catalog("hostile")), "start": [1.0]}  # x~ = (1 + eps) x/(1 - eps)
    assert len(in_node(entry, 1, 5)[0]) == 1
    assert len(in_node(entry, 0.5, 5)[0]) == 6


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_the_window_holds_the_start_of_an_orbit_that_converges():
    low, high = run_node(f"console.log(JSON.stringify(it.rangeOf({[1] + 99 * [0]})))")
    assert low < 0
    assert high > 1


@pytest.mark.parametrize("name", list(FILES))
def test_the_page_has_the_verdict_and_nothing_of_the_network(name):
    analysis = search_catalog(name)
    html = report_html(analysis, explore=True, command="kahanmaps report")
    page = Page(html)
    assert analysis.conclusion.sentence in page.text
    assert [entry for entry in page.fetched if not entry.startswith(("#", "data:"))] == []
    assert page.tags.count("script") == 2, "data and program; names of users do not begin one"
    program = re.search("<script>(.*?)</script>", page.html, re.DOTALL)[1]
    digest = base64.b64encode(hashlib.sha256(program.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'\"/>" in page.html, "the policy of the page has this program alone"
    assert len(page.ids) == len(set(page.ids))
    assert ("explore-eps" in page.ids) == FILES[name].map.has_eps
    assert page.ids.count(f"explore-x{FILES[name].dim - 1}") == 1
    assert all(page.alttexts)


def test_a_verdict_for_one_eps_says_so():
    assert "at eps = 1/7 only" in Page(report_html(km.analyze(FILES["plane"], eps="1/7"), explore=True)).text
    assert "for every eps" in Page(report_html(search_catalog("plane"), explore=True)).text


def test_only_an_analysis_can_be_explored():
    file = km.load("euler_top")
    refuses("expected an Analysis", report_html, km.check_integrals(file), file=file, explore=True)
