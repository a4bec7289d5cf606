#!/usr/bin/env bash
# An array of polynomials of FLINT.
#
# Expected: np.array([p, q]) is an array of two polynomials, as np.array([A, B]) of two matrices of FLINT is one of two
#           objects.
# Seen:     Two polynomials of the same degree become a 2 x (degree + 1) array of coefficients, also with dtype=object;
#           two of different degrees become two objects, and without dtype=object a ValueError.
# The shape of a result depends on a degree, which in a computation changes when a leading coefficient happens to
# cancel.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    python-flint==0.9.0 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import flint
import numpy as np
from flint import fmpq_poly, fmpz_mat

print("python-flint", flint.__version__, " numpy", np.__version__)
line, other, constant = fmpq_poly([1, 2]), fmpq_poly([3, 4]), fmpq_poly([5])
print("expected: shape (2,) for any two polynomials")
same = np.array([line, other], dtype=object)
mixed = np.array([line, constant], dtype=object)
print("  degrees 1, 1:", same.shape, type(same.flat[0]).__name__)
print("  degrees 1, 0:", mixed.shape, type(mixed.flat[0]).__name__)
assert same.shape == (2, 2) and mixed.shape == (2,)
try:
    np.array([line, constant])
    raise SystemExit("different degrees without dtype=object are accepted now")
except ValueError as error:
    print("  degrees 1, 0 without dtype=object: ValueError:", str(error)[:60], "...")
matrices = np.array([fmpz_mat([[1, 2]]), fmpz_mat([[3, 4]])])
print("  two matrices:", matrices.shape)
assert matrices.shape == (2,)
print("seen: coefficients where the degrees agree, polynomials where they do not")
PYTHON
# Here: polynomials are kept in lists; an array for them is made with np.empty(n, dtype=object) and filled.
