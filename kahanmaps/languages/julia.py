"""Julia: exact numbers are p//q, functions take anything with coordinates and give a Vector, a file is `include`d."""

from __future__ import annotations

from collections.abc import Sequence

from kahanmaps.languages.language import Language, Naming, listed, words

_RESERVED = words(
    "abstract baremodule begin break catch const continue do else elseif end export false finally for function",
    "global if import in isa let local macro module mutable primitive quote return struct true try type using where",
    "while I im pi NaN Inf nothing missing exact collect hcat det transpose sum LinearAlgebra Rational BigInt",
    "Integer Union Base Core Main",
)


def _take(variables: Sequence[str]) -> str:
    names = ", ".join(variables) if len(variables) > 1 else f"({variables[0]},)"
    return f"{names} = exact.(point)"


def _matrix(rows: Sequence[Sequence[str]]) -> str:
    # Column by column: between the brackets of [a b; c d] a blank and the end of a line mean something.
    columns = [f"[{listed([row[k] for row in rows], '          ')}]" for k in range(len(rows))]
    return "hcat(" + ",\n        ".join(columns) + ")"


_EXACT = """\
using LinearAlgebra

# Integers and fractions become fractions of BigInt, so that nothing overflows; floats stay what they are.
exact(value) = value isa Union{Integer, Rational} ? Rational{BigInt}(value) : value"""

JULIA = Language(
    key="julia",
    title="Julia",
    naming=Naming(lambda name: name in _RESERVED),
    fraction="{}//{}",
    vector=lambda entries: f"[{listed(entries, '        ')}]",
    matrix=_matrix,
    take=_take,
    convert="{0} = exact({0})",
    definition="function <name>(<arguments>)\n    <body>\nend",
    function="<unpack>return <body>",
    recipes={
        "kahan_map": """\
<unpack_eps>M = I - eps*<vector_field_jacobian>(point<more>)
return collect(exact.(point)) + 2*eps*(M \\ <vector_field>(point<more>))""",
        "kahan_inverse": "<kahan_inverse>(<arguments>) = <kahan_map>(point, -eps<more>)",
        "kahan_jacobian": """\
<unpack_eps>image = <kahan_map>(point, eps<more>)
M = I - eps*<vector_field_jacobian>(point<more>)
return M \\ (I + eps*<vector_field_jacobian>(image<more>))""",
        "modified_hamiltonian": """\
step = <kahan_map>(point, eps<more>) - collect(exact.(point))
return <hamiltonian>(point<more>) + sum(<hamiltonian_gradient>(point<more>) .* step)*1//3""",
        "form": """\
<unpack_eps>M = <matrix>
return sum(collect(exact.(point)) .* (M*<kahan_map>(point, eps<more>)))/eps""",
        "determinant": """\
<unpack_eps>return det(I - eps*<vector_field_jacobian>(point<more>))""",
    },
    usage="<kahan_map>([<values>], 1//10<more>)",
    head=_EXACT,
)
