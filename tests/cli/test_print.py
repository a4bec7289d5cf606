"""`print` of a result shows what its command prints."""

from __future__ import annotations

import kahanmaps as km


def test_print_shows_what_the_command_prints(kahanmaps):
    assert f"{km.check_integrals('euler_top')}\n" == kahanmaps("check-integrals", "euler_top").out
    below = kahanmaps("degrees", "euler_top", "--terms", "4").out.split("\n", 1)[1]
    assert f"{km.degrees('euler_top', max_terms=4)}\n" == below
