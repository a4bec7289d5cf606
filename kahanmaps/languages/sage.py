"""SageMath: a .sage file, whose integers and fractions are exact; functions take sequences and give vectors."""

from __future__ import annotations

from kahanmaps.languages.language import PYTHON_KEYWORDS, Language, Naming, listed, python_integer, words

_RESERVED = PYTHON_KEYWORDS | words(
    "I e i pi oo infinity NaN QQ ZZ RR CC SR beta gamma zeta psi matrix vector identity_matrix Integer",
    "ZeroDivisionError",
)


# Where a singular matrix leaves equations that can be solved, solve_right gives one solution: hence is_singular.
SAGE = Language(
    key="sage",
    title="SageMath",
    naming=Naming(lambda name: name in _RESERVED),
    integer=python_integer,
    vector=lambda entries: f"vector([{listed(entries, '        ')}])",
    matrix=lambda rows: "matrix([" + ",\n        ".join(f"[{listed(row, '         ')}]" for row in rows) + "])",
    symbol='{0}=SR.var("{0}")',
    take=lambda variables: f"{', '.join(variables)}{',' * (len(variables) == 1)} = vector(point)",
    definition="def <name>(<arguments>):\n    <body>",
    function="<unpack>return <body>",
    recipes={
        "kahan_map": """\
M = identity_matrix(<n>) - eps*<vector_field_jacobian>(point<more>)
if M.is_singular():
    raise ZeroDivisionError("det(I - eps f'(x)) = 0: the Kahan map has no value here")
return vector(point) + 2*eps*M.solve_right(<vector_field>(point<more>))""",
        "kahan_inverse": "return <kahan_map>(point, -eps<more>)",
        "kahan_jacobian": """\
image = <kahan_map>(point, eps<more>)
M = identity_matrix(<n>) - eps*<vector_field_jacobian>(point<more>)
return M.solve_right(identity_matrix(<n>) + eps*<vector_field_jacobian>(image<more>))""",
        "modified_hamiltonian": """\
step = <kahan_map>(point, eps<more>) - vector(point)
return <hamiltonian>(point<more>) + <hamiltonian_gradient>(point<more>)*step/3""",
        "form": """\
M = <matrix>
return vector(point)*(M*<kahan_map>(point, eps<more>))/eps""",
        "determinant": "return (identity_matrix(<n>) - eps*<vector_field_jacobian>(point<more>)).det()",
    },
    usage="<kahan_map>([<values>], 1/10<more>)",
)
