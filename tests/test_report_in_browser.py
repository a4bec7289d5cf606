"""Pages in a browser: nothing is fetched, nothing complained of, and sliders move what they should.

Chromium runs without a window. Its log of the network tells what a page asks for, the printed page what is readable.
"""

import json
import re
import shutil
import subprocess
from html import unescape

import pytest

import kahanmaps as km
from kahanmaps.reports.report import report_html

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs chromium, chromium-browser or google-chrome")

# Pages that do what a report must not do.
FETCHING = '<!DOCTYPE html><html lang="en"><body><img src="http://localhost:9/x.png"/></body></html>'
COMPLAINING = '<!DOCTYPE html><html lang="en"><body><script>undefined_name()</script></body></html>'


def browse(page, *options):
    """Open a page in a browser of its own; what it writes."""
    profile = page.parent / "profile"
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", *options]
    command += ["--enable-logging=stderr", "--v=0", "--disable-background-networking", page.as_uri()]
    return subprocess.run(command, capture_output=True, timeout=100)


def requests(log):
    """The addresses that a page asked for, of those that need a network."""
    return sorted(
        set(re.findall(r'"url":"((?:https?|wss?)://localhost[^"]*|https?://[^"]*\.(?:png|css|js|svg|woff2?))"', log))
    )


def dumped(tmp_path, html):
    """The page after loading, what was asked of the network, and what was said on the console."""
    page, log = tmp_path / "page.html", tmp_path / "net.json"
    page.write_text(html)
    done = browse(page, "--dump-dom", f"--log-net-log={log}")
    console = [line for line in done.stderr.decode().splitlines() if "CONSOLE" in line]
    return done.stdout.decode(), requests(log.read_text()), console


@pytest.fixture(scope="module")
def html():
    system = km.QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2 + y"])
    return report_html(km.analyze(km.SystemFile.from_system(system, "small")))


def test_nothing_is_fetched_and_nothing_complained_of(tmp_path, html):
    dom, requested, console = dumped(tmp_path, html)
    assert "How to reproduce this page" in dom
    assert (requested, console) == ([], [])


# Once the page has loaded: what its cells say, and what they say after each of two sliders was moved.
MOVING = """<script>document.addEventListener("DOMContentLoaded", () => {
  const told = [];
  const look = () => told.push(Object.fromEntries(
    [...document.querySelectorAll("[id^=explore-]")].map(one => [one.id.slice(8), one.textContent])));
  look();
  for (const [name, value] of [["eps", 0.25], ["x1", 0.5]]) {
    const slider = document.getElementById("explore-" + name);
    slider.value = value;
    slider.dispatchEvent(new Event("input"));
    look();
  }
  document.title = JSON.stringify(told);
});</script></body>"""


def test_sliders_move_eps_and_the_start_and_integrals_stay(tmp_path):
    page = report_html(km.analyze(km.load("euler_top")), explore=True)
    _, _, (error,) = dumped(tmp_path, page.replace("</body>", MOVING))
    assert "violates the following Content Security Policy" in error, "the page runs its own script alone"
    without_policy = re.sub("<meta http-equiv=.*?/>", "", page)
    dom, requested, console = dumped(tmp_path, without_policy.replace("</body>", MOVING))
    assert (requested, console) == ([], [])
    first, at_large_eps, elsewhere = json.loads(unescape(re.search("<title>(.*?)</title>", dom)[1]))
    assert first["status"].startswith("800 steps, 0 points outside")
    assert float(first["change0"]) < 1e-12
    assert at_large_eps["eps-value"] == "0.25"
    assert at_large_eps["first0"] == at_large_eps["last0"] != first["first0"]
    assert elsewhere["x1-value"] == "0.5"
    assert elsewhere["first0"] != at_large_eps["first0"]


@pytest.mark.slow
def test_a_page_that_fetches_or_complains_is_seen(tmp_path):
    assert dumped(tmp_path, FETCHING)[1] == ["http://localhost:9/x.png"]
    assert "undefined_name" in dumped(tmp_path, COMPLAINING)[2][0]
