"""SymPy: exact numbers are Rational(p, q), functions take sequences and give column matrices, a file is a module."""

from __future__ import annotations

from kahanmaps.languages.language import PYTHON_KEYWORDS, Language, Naming, listed, python_integer, words

# Names that sympify reads as something else than a symbol, and those that the file imports.
_RESERVED = PYTHON_KEYWORDS | words(
    "E I N O Q S C pi oo zoo nan beta gamma zeta im re ff fu id li ln rf yn Ci CC Ei Eq EX FF Ge Gt GF Id Le Li Lt",
    "LC LM LT jn Ne Or QQ RR Si ZZ And Not Xor Chi Max Min Mod Poly abs sin cos tan cot exp log det",
    "Matrix Rational Symbol eye sympify map list",
)


SYMPY = Language(
    key="sympy",
    title="SymPy",
    naming=Naming(lambda name: name in _RESERVED),
    integer=python_integer,
    fraction="Rational({}, {})",
    vector=lambda entries: f"Matrix([{listed(entries, '        ')}])",
    matrix=lambda rows: "Matrix([" + ",\n        ".join(f"[{listed(row, '         ')}]" for row in rows) + "])",
    symbol='{0}=Symbol("{0}")',
    take=lambda variables: f"[{', '.join(variables)}] = Matrix(list(point))",
    convert="{0} = sympify({0})",
    definition="def <name>(<arguments>):\n    <body>",
    function="<unpack>return <body>",
    recipes={
        "kahan_map": """\
<unpack_eps>M = eye(<n>) - eps*<vector_field_jacobian>(point<more>)
return Matrix(list(point)) + 2*eps*M.LUsolve(<vector_field>(point<more>))""",
        "kahan_inverse": "return <kahan_map>(point, -sympify(eps)<more>)",
        "kahan_jacobian": """\
<unpack_eps>image = <kahan_map>(point, eps<more>)
M = eye(<n>) - eps*<vector_field_jacobian>(point<more>)
return M.LUsolve(eye(<n>) + eps*<vector_field_jacobian>(image<more>))""",
        "modified_hamiltonian": """\
step = <kahan_map>(point, eps<more>) - Matrix(list(point))
return <hamiltonian>(point<more>) + <hamiltonian_gradient>(point<more>).dot(step)/3""",
        "form": """\
<unpack_eps>M = <matrix>
return Matrix(list(point)).dot(M*<kahan_map>(point, eps<more>))/eps""",
        "determinant": "<unpack_eps>return (eye(<n>) - eps*<vector_field_jacobian>(point<more>)).det()",
    },
    usage="<kahan_map>([<values>], Rational(1, 10)<more>)",
    power="**",
    head="from sympy import Matrix, Rational, Symbol, eye, sympify",
)
