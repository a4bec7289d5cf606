#!/usr/bin/env bash
# numpy's products of arrays over a finite field, in galois, whose arrays are a subclass of numpy's.
#
# Expected: einsum, tensordot, vecdot and matvec give what dot, inner and @ give, or are refused, as cross is.
# Seen:     sums of ordinary products of the stored integers, in the 8 bits in which they are stored: 10 products
#           6*6 over GF(7) are 104 = 360 - 256, which is neither 3, the answer, nor 360, of which 3 is the remainder.
#           correlate returns an array of the field with the element 72, pinv and cholesky arrays of the field
#           with fractions and square roots: the check of every element is passed by.
# cross is on a list of refused functions, on which none of these is; no report of this was found.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check galois==0.4.11 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import galois
import numpy as np

print("galois", galois.__version__, "numpy", np.__version__)
field = galois.GF(7)
a = field([6] * 10)
rows = field([[6] * 10])
print("expected: the sum of ten products 6*6 over GF(7) is", 10 * 36 % 7)
right = {"dot": np.dot(a, a), "inner": np.inner(a, a), "@": a @ a, "sum": np.sum(a * a)}
wrong = {
    "einsum": np.einsum("i,i", a, a),
    "tensordot": np.tensordot(a, a, 1),
    "vecdot": np.vecdot(a, a),
    "matvec": np.matvec(rows, a)[0],
}
for name, value in {**right, **wrong}.items():
    print(f"  {name:10} {int(value):4}  {type(value).__name__}")
assert all(value == 3 for value in right.values()) and all(int(value) == 104 for value in wrong.values())
try:
    print(np.cross(field([1, 2, 3]), field([4, 5, 6])))
    refused = False
except NotImplementedError as error:
    print("cross:", str(error).split(".")[0])
    refused = True
outside = np.correlate(a[:2], a[:2])
inverse = np.linalg.pinv(field([[1, 2], [3, 4]]))
print("correlate:", repr(outside))
print("pinv:", repr(inverse).replace("\n", ""))
print("inv: ", repr(np.linalg.inv(field([[1, 2], [3, 4]]))).replace("\n", ""))
assert refused and isinstance(outside, field) and int(outside.view(np.ndarray)[0]) == 72
assert isinstance(inverse, field) and abs(float(inverse.view(np.ndarray)[1, 0]) - 1.5) < 1e-9
print("seen: values that are not in the field, without a warning")
PYTHON
# Here: nothing depends on it; computations modulo a prime are those of FLINT.
