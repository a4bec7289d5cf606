"""Cuts the font of the formulas, kahanmaps/reports/fonts/kahanmaps-math.woff, out of Latin Modern Math.

python docs/_ext/math_font.py latinmodern-math.otf

The font is in the Debian package fonts-lmodern; fonttools comes with matplotlib.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fontTools.subset import Options, Subsetter, load_font, save_font

FONT = Path(__file__).parents[2] / "kahanmaps" / "reports" / "fonts" / "kahanmaps-math.woff"
PRIMES = {0x2032, 0x2033, 0x2034}
CHARACTERS = (
    "20-7E A0 AF B1 B7 D7 F7 2C6 391-3A9 3B1-3C9 3D1 3D5 3F1 3F5 2026 2032-2034 2061-2064 "  # text, Greek, primes
    "2102 210E 2113 211A 211D 2124 1D434-1D467 1D49C 1D51E 1D51F 1D6E2-1D71B "  # C, h, l, Q, R, Z, italics, script
    "2190-2192 2194 21A6 2202 2207 2208 2209 220F 2211-2213 2217 2218 221A 221E 2223 2224 2227-2229 222B 2236 223C "
    "2245 2248 2260 2261 2264 2265 2282 2295 2297 22C5 22EF 230A 230B 27E8 27E9 2A01"  # relations, operators, brackets
)


def cut(path: str) -> None:
    """Write the font with the characters of our formulas and the table that says where they are put."""
    options = Options(
        flavor="woff",
        layout_features=[],
        name_IDs=[0, 13],  # copyright and licence: the authors ask that what is changed does not go by their name
        hinting=False,
        glyph_names=False,
        drop_tables=["FFTM", "GDEF", "GPOS", "GSUB"],
    )
    font = load_font(path, options)
    names = dict(font.getBestCmap())
    for table in font["cmap"].tables:
        # A prime is raised twice, once by the browser, unless it is the form that is made to stand in an exponent.
        # Browsers do not choose that form by themselves.
        table.cmap.update({code: f"{names[code]}.st" for code in PRIMES & set(table.cmap)})
    codes: set[int] = set()
    for piece in CHARACTERS.split():
        first, _, last = piece.partition("-")
        codes.update(range(int(first, 16), int(last or first, 16) + 1))
    subsetter = Subsetter(options)
    subsetter.populate(unicodes=codes)
    subsetter.subset(font)
    font["CFF "].cff.fontNames = [FONT.stem]
    font.recalcTimestamp = False
    save_font(font, str(FONT), options)


if __name__ == "__main__":
    cut(sys.argv[1])
