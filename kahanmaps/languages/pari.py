r"""PARI/GP: exact numbers are p/q, functions take vectors and give columns, a file is read by `gp FILE` or \r FILE."""

from __future__ import annotations

import re
from collections.abc import Sequence

from kahanmaps.languages.language import Language, Naming, listed

# GP has more than a thousand functions whose names are words, and more with each version; none is one letter with
# digits, and an underscore is only in those of its debugger.
_FREE = re.compile(r"[A-HJ-NP-Za-z][0-9]*|(?!dbg_)[A-Za-z][A-Za-z0-9]*_[A-Za-z0-9_]*")


def _matrix(rows: Sequence[Sequence[str]]) -> str:
    if len(rows) == 1:
        return f"Mat({rows[0][0]})"
    return "[" + ";\n   ".join(listed(row, "     ") for row in rows) + "]"


PARI = Language(
    key="pari",
    title="PARI/GP",
    naming=Naming(lambda name: _FREE.fullmatch(name) is None),
    comment=lambda line: rf"\\ {line}".rstrip(),
    vector=lambda entries: f"[{listed(entries, '   ')}]~",
    matrix=_matrix,
    symbol="{0} = '{0}",  # an argument that is not given is 0 in GP: a symbol stands for itself instead
    take=lambda variables: f"my({', '.join(f'{name} = point[{k}]' for k, name in enumerate(variables, 1))});",
    definition="{<name>(<arguments>) =\n  <body>\n}",
    function="<unpack><body>",
    recipes={
        "kahan_map": """\
Col(point) + 2*eps*matsolve(matid(<n>) - eps*<vector_field_jacobian>(point<more>), <vector_field>(point<more>))""",
        "kahan_inverse": "<kahan_map>(point, -eps<more>)",
        "kahan_jacobian": """\
my(image = <kahan_map>(point, eps<more>));
matsolve(matid(<n>) - eps*<vector_field_jacobian>(point<more>),
         matid(<n>) + eps*<vector_field_jacobian>(image<more>))""",
        "modified_hamiltonian": """\
my(image = <kahan_map>(point, eps<more>));
<hamiltonian>(point<more>) + <hamiltonian_gradient>(point<more>)~*(image - Col(point))/3""",
        "form": "Col(point)~*<matrix>*<kahan_map>(point, eps<more>)/eps",
        "determinant": "matdet(matid(<n>) - eps*<vector_field_jacobian>(point<more>))",
    },
    usage="<kahan_map>([<values>]~, 1/10<more>)",
)
