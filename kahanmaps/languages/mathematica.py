"""Mathematica: exact numbers are p/q, functions take and give lists, a file is read by Get or wolframscript -file."""

from __future__ import annotations

import re
from collections.abc import Sequence

from kahanmaps.languages.language import Language, Naming, listed


def _pattern(point: Sequence[str]) -> str:
    return "{" + ", ".join(f"{name}_" for name in point) + "}" if point else "point_List"


def _comment(line: str) -> str:
    return f"(* {line.replace('(*', '( *').replace('*)', '* )')} *)" if line else ""


# Where a singular matrix leaves equations that can be solved, LinearSolve gives one solution: hence the determinant.
MATHEMATICA = Language(
    key="mathematica",
    title="Mathematica",
    # Every name of the system itself starts with a capital letter.
    naming=Naming(lambda name: name[0].isupper(), "v", False, re.compile(r"[A-Za-z][A-Za-z0-9]*")),
    comment=_comment,
    vector=lambda entries: f"{{{listed(entries, '   ')}}}",
    matrix=lambda rows: "{" + ",\n   ".join(f"{{{listed(row, '     ')}}}" for row in rows) + "}",
    point=_pattern,
    argument="{}_",
    symbol="{}_",
    take=lambda variables: "",
    definition="<name>[<arguments>] :=\n  <body>;",
    function="<body>",
    recipes={
        "kahan_map": """\
<kahan_map>[<arguments>] := Module[{m},
  m = IdentityMatrix[<n>] - eps*<vector_field_jacobian>[point<more>];
  If[Det[m] === 0, $Failed, point + 2*eps*LinearSolve[m, <vector_field>[point<more>]]]
];""",
        "kahan_inverse": "<kahan_inverse>[<arguments>] := <kahan_map>[point, -eps<more>];",
        "kahan_jacobian": """\
<kahan_jacobian>[<arguments>] := Module[{m, image},
  m = IdentityMatrix[<n>] - eps*<vector_field_jacobian>[point<more>];
  image = <kahan_map>[point, eps<more>];
  If[image === $Failed, $Failed,
    Inverse[m].(IdentityMatrix[<n>] + eps*<vector_field_jacobian>[image<more>])]
];""",
        "modified_hamiltonian": """\
<modified_hamiltonian>[<arguments>] := Module[{image},
  image = <kahan_map>[point, eps<more>];
  If[image === $Failed, $Failed,
    <hamiltonian>[point<more>] + <hamiltonian_gradient>[point<more>].(image - point)/3]
];""",
        "form": """\
<name>[<arguments>] := Module[{m, image},
  m = <matrix>;
  image = <kahan_map>[point, eps<more>];
  If[image === $Failed, $Failed, point.m.image/eps]
];""",
        "determinant": """\
<density>[<arguments>] := Det[IdentityMatrix[<n>] - eps*<vector_field_jacobian>[point<more>]];""",
    },
    usage="<kahan_map>[{<values>}, 1/10<more>]",
    head="ClearAll[<functions>];",
)
