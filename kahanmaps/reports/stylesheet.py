"""How a page looks: one column, light or dark as the reader's system is, on paper black on white.

Formulas are set in a font of their own, which is part of the page: without a font that has a table for mathematics,
browsers do not know where exponents and primes belong.
"""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from importlib import resources

FORMULAS = 'math { font-size: 1.18em; font-family: "kahanmaps math", math; }'
STYLESHEET = """
:root { color-scheme: light dark; --back: #ffffff; --text: #1f2328; --soft: #59636e; --line: #d1d9e0; --card: #f6f8fa;
  --link: #0b57d0; }
@media (prefers-color-scheme: dark) { :root { --back: #14171c; --text: #e2e6ec; --soft: #9aa5b1; --line: #3a424d;
  --card: #1e232a; --link: #8ab4f8; } }
* { box-sizing: border-box; }
html { font: 100%/1.55 system-ui, -apple-system, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif; }
body { margin: 0 auto; max-width: 62rem; padding: 1.5rem 1.25rem 4rem; background: var(--back); color: var(--text);
  overflow-wrap: break-word; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.25rem; margin: 2.4rem 0 .6rem; padding-top: .5rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.4rem 0 .4rem; }
p, ul, ol, table, figure, pre, details { margin: .5rem 0; }
a { color: var(--link); }
.lead, .soft, figcaption, caption { color: var(--soft); }
.conclusion { font-size: 1.15rem; padding: .8rem 1rem; background: var(--card); border-left: .3rem solid var(--soft); }
nav ul { list-style: none; display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; padding: 0; }
ul.statements { list-style: none; padding: 0; }
ul.statements > li { display: grid; grid-template-columns: 7.2rem minmax(0, 1fr); gap: .8rem; padding: .28rem 0; }
@media (max-width: 34rem) { ul.statements > li { grid-template-columns: minmax(0, 1fr); gap: 0; padding: .45rem 0; } }
.verdict { font-weight: 600; }
.formula { line-height: 1.9; }
.wide, section { overflow-x: auto; }
table { border-collapse: collapse; font-size: .95em; }
caption { text-align: left; padding-bottom: .2rem; }
th, td { text-align: left; vertical-align: top; padding: .22rem .8rem .22rem 0; border-bottom: 1px solid var(--line); }
code, pre { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: .9em; overflow-wrap: anywhere; }
pre { background: var(--card); padding: .7rem .9rem; white-space: pre-wrap; }
summary { cursor: pointer; }
details.claim { border-bottom: 1px solid var(--line); padding: .2rem 0; margin: 0; }
details.claim > table { margin: .3rem 0 .6rem 1rem; }
.picture { background: #ffffff; border-radius: .4rem; padding: .4rem; }
figure { margin: 1rem 0; }
:target { scroll-margin-top: 1rem; }
@media print {
  :root { color-scheme: light; --back: #ffffff; --text: #000000; --soft: #444444; --line: #bbbbbb; --card: #ffffff;
    --link: #000000; }
  body { max-width: none; padding: 0; font-size: 10pt; }
  nav { display: none; }
  .wide, section { overflow: visible; }
  h2, h3 { break-after: avoid; }
  figure, tr, ul.statements > li { break-inside: avoid; }
  pre, .conclusion { border: 1px solid var(--line); }
  details::details-content { content-visibility: visible; height: auto; }
}
"""
STYLESHEET += FORMULAS


@cache
def font_face() -> str:
    """The font of formulas as a rule of a stylesheet, which nothing has to be fetched for."""
    font = resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff"
    code = b64encode(font.read_bytes()).decode("ascii")
    return f'@font-face {{ font-family: "kahanmaps math"; src: url(data:font/woff;base64,{code}) format("woff"); }}'
