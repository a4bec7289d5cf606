"""Colours: where they go and who decides."""

import re

import pytest

CHECK = "check-integrals euler_top --integral x1 --integral known"
ESCAPE = "\x1b["


def test_the_option_is_stronger_than_the_environment_and_changes_nothing_but_colours(kahanmaps, monkeypatch):
    for name in ("NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        monkeypatch.delenv(name, raising=False)
    plain, coloured = kahanmaps(CHECK), kahanmaps("--color always", CHECK)
    assert ESCAPE not in plain.out
    assert "\x1b[32mproved" in coloured.out
    assert "\x1b[31mrefuted" in coloured.out
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured.out) == plain.out
    assert kahanmaps(CHECK, "--color always") == coloured
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert ESCAPE in kahanmaps(CHECK).out
    monkeypatch.setenv("NO_COLOR", "1")
    assert ESCAPE not in kahanmaps(CHECK).out
    assert kahanmaps("--color always", CHECK) == coloured


@pytest.mark.parametrize("command", ["systems", "degrees weierstrass"])
def test_headings_are_bold_where_colours_are_wanted(kahanmaps, command):
    assert "\x1b[1m" in kahanmaps("--color always", command).out
