"""Files for the programs that are not run here, letter by letter as they were reviewed by hand.

`golden` holds what these calls gave, with VERSION for the version. After a change of what is written, write them anew
with GOLDEN=write in the environment and read the difference against the manual of the program.
"""

import os
from pathlib import Path

import pytest

import kahanmaps as km
from kahanmaps.languages.convert import PARTS, convert
from kahanmaps.version import __version__

GOLDEN = Path(__file__).parent / "golden"
EXTENSIONS = {"maple": "mpl", "mathematica": "wl", "julia": "jl", "sage": "sage", "latex": "tex"}
EXTENSIONS |= {"numpy": "numpy", "c": "c", "fortran": "f90"}


def weierstrass(language: str) -> str:
    return convert(km.load("weierstrass"), language, PARTS)


def euler_top(language: str) -> str:
    file = km.load("euler_top")
    return convert(file, language, name="top", symbols=["a1", "a2"])


@pytest.mark.parametrize("write", [weierstrass, euler_top])
@pytest.mark.parametrize("language", EXTENSIONS)
def test_the_file_is_the_one_that_was_reviewed(language, write):
    path = GOLDEN / f"{write.__name__}.{EXTENSIONS[language]}"
    text = write(language).replace(f"kahanmaps {__version__}", "kahanmaps VERSION")
    if os.environ.get("GOLDEN") == "write":
        path.write_text(text)
    assert text == path.read_text()
