#!/usr/bin/env bash
# Dimensions of simple Lie algebras, and the simple roots of F4, in SymPy's module on Lie algebras.
#
# Expected: basis(), "the number of independent generators", is the rank plus the number of roots, as for every simple
#           Lie algebra; twice the scalar products of simple roots over their squares are the Cartan matrix.
# Seen:     true for C, E, F and G. For A, B and D basis() is the dimension for a smaller matrix group, and a float for B
#           and D: 3 instead of 8 for A2, 0 instead of 3 for A1, 3.0 instead of 21 for B3. The four simple roots of F4 are
#           two orthogonal pairs (the roots of A2 + A2, determinant 9), while its Cartan matrix is right (determinant 1).
# Toda lattices and Volterra chains are built from simple roots; those of F4 decouple into two systems.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy
from sympy import Matrix
from sympy.liealgebras.cartan_type import CartanType

print("SymPy", sympy.__version__)
print("expected: basis() = rank + number of roots, and 2 (a, b)/(a, a) of the simple roots = Cartan matrix")
wrong_dimensions = []
for name in ("A1", "A2", "A3", "B2", "B3", "C3", "D4", "E6", "E7", "E8", "F4", "G2"):
    algebra, rank = CartanType(name), int(name[1:])
    dimension = rank + algebra.roots()
    if algebra.basis() != dimension:
        wrong_dimensions.append(name)
        print(f"{name}: basis() is {algebra.basis()}, rank + number of roots is {dimension}")
assert wrong_dimensions == ["A1", "A2", "A3", "B2", "B3", "D4"], wrong_dimensions

F4 = CartanType("F4")
roots = [Matrix(F4.simple_root(k)) for k in range(1, 5)]
scalar_products = Matrix(4, 4, lambda i, j: 2 * roots[i].dot(roots[j]) / roots[i].dot(roots[i]))
print("simple roots of F4:", [list(root) for root in roots])
print("from the simple roots:", scalar_products.tolist(), "determinant", scalar_products.det())
print("cartan_matrix():      ", F4.cartan_matrix().tolist(), "determinant", F4.cartan_matrix().det())
assert (scalar_products.det(), F4.cartan_matrix().det()) == (9, 1)
for name in ("A3", "B3", "C3", "D4", "G2"):  # up to the order of the two indices
    algebra, rank = CartanType(name), int(name[1:])
    roots = [Matrix(algebra.simple_root(k)) for k in range(1, rank + 1)]
    matrix = Matrix(rank, rank, lambda i, j: 2 * roots[i].dot(roots[j]) / roots[i].dot(roots[i]))
    assert algebra.cartan_matrix() in (matrix, matrix.T), name
print("seen: wrong dimensions for A, B and D, and simple roots of F4 that are two orthogonal pairs")
PYTHON
# Here: periodic Volterra chains and dressing chains are in the catalogue by their equations, not by root systems.
