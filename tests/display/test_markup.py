"""The pieces of HTML: well-formed, without anything in them that the text brings along."""

from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.display import markup

EVIL = '<script>alert("x")</script>&amp;\x00\x1b[31m\ud800\'"'


def well_formed(html):
    return ElementTree.fromstring(f"<div>{html}</div>")


@given(st.text())
def test_every_text_is_well_formed_once_it_is_escaped(text):
    assert list(well_formed(markup.escape(text))) == []


@pytest.mark.parametrize(
    "html",
    [
        markup.table([EVIL], [["<b>1</b>"]], EVIL),
        markup.definitions([(EVIL, "1")]),
        markup.titled(EVIL, "<p>1</p>", EVIL),
        markup.verdict(EVIL),
        markup.listed([markup.escape(EVIL)]),
    ],
)
def test_no_text_becomes_an_element(html):
    assert "script" not in {entry.tag for entry in well_formed(html).iter()}
    assert "alert" in "".join(well_formed(html).itertext())


@pytest.mark.parametrize("word", ["proved", "refuted", "supported", "measured", "undecided", "completed"])
def test_a_verdict_is_a_word_with_a_mark_and_not_only_a_colour(word):
    text = "".join(well_formed(markup.verdict(word)).itertext())
    assert text.endswith(f" {word}")
    assert len(text) == len(word) + 2


def test_short_text_stays_and_long_text_says_its_length():
    assert markup.shortened("x" * 60) == "x" * 60
    assert markup.shortened("1" * 5000).endswith("(5000 characters)")
    assert len(markup.shortened("1" * 5000)) < 90
