"""Maple: exact numbers are p/q, functions take a list or Vector and give a Vector, a file is read by `read`."""

from __future__ import annotations

from kahanmaps.languages.language import Language, Naming, listed, words

_RESERVED = words(
    "D I O Pi Psi Zeta Beta GAMMA gamma Catalan infinity undefined true false FAIL Digits NULL",
    "and assuming break by catch description do done elif else end error export fi finally for from global if",
    "implies in intersect local minus mod module next not od option options or proc quit read return save stop",
    "subset then to try union until use uses while xor",
    "Matrix Vector LinearAlgebra convert list op",
    # Names that stand for a procedure inside itself, and those of the environment.
    "args nargs procname thisproc thismodule Normalizer Testzero Order Rounding UseHardwareFloats printlevel",
)


# A symbol times a Matrix may stay a product: hence ScalarMultiply. Where a singular matrix leaves equations that can be
# solved, LinearSolve gives a family of solutions: hence the determinant.
_REFUSE = """\
if LinearAlgebra:-Determinant(M) = 0 then error "det(I - eps f'(x)) = 0: the Kahan map has no value here" end if;
"""

MAPLE = Language(
    key="maple",
    title="Maple",
    naming=Naming(lambda name: name in _RESERVED),
    comment=lambda line: "# " + line.replace("\\", "/") if line else "#",  # a final \ would continue the comment
    vector=lambda entries: f"Vector([{listed(entries, '   ')}])",
    matrix=lambda rows: "Matrix([" + ",\n   ".join(f"[{listed(row, '     ')}]" for row in rows) + "])",
    take=lambda variables: "local {0};\n  {0} := op(convert(point, list));".format(", ".join(variables)),
    definition="<name> := proc(<arguments>)\n  <body>;\nend proc:",
    function="<unpack><body>",
    recipes={
        "kahan_map": f"""\
local M;
M := LinearAlgebra:-IdentityMatrix(<n>)
  - LinearAlgebra:-ScalarMultiply(<vector_field_jacobian>(point<more>), eps);
{_REFUSE}\
Vector(convert(point, list))
  + LinearAlgebra:-ScalarMultiply(LinearAlgebra:-LinearSolve(M, <vector_field>(point<more>)), 2*eps)""",
        "kahan_inverse": "<kahan_map>(point, -eps<more>)",
        "kahan_jacobian": """\
local M, image;
image := <kahan_map>(point, eps<more>);
M := LinearAlgebra:-IdentityMatrix(<n>)
  - LinearAlgebra:-ScalarMultiply(<vector_field_jacobian>(point<more>), eps);
LinearAlgebra:-LinearSolve(M,
  LinearAlgebra:-IdentityMatrix(<n>)
  + LinearAlgebra:-ScalarMultiply(<vector_field_jacobian>(image<more>), eps))""",
        "modified_hamiltonian": """\
local image;
image := <kahan_map>(point, eps<more>);
<hamiltonian>(point<more>) + (LinearAlgebra:-Transpose(<hamiltonian_gradient>(point<more>))
  . (image - Vector(convert(point, list))))/3""",
        "form": """\
local M;
M := <matrix>;
(LinearAlgebra:-Transpose(Vector(convert(point, list))) . M . <kahan_map>(point, eps<more>))/eps""",
        "determinant": """\
LinearAlgebra:-Determinant(LinearAlgebra:-IdentityMatrix(<n>)
  - LinearAlgebra:-ScalarMultiply(<vector_field_jacobian>(point<more>), eps))""",
    },
    usage="<kahan_map>([<values>], 1/10<more>);",
)
