#!/usr/bin/env bash
# The third power of a float in Python, numpy and numba.
#
# Expected: x**3 of a double is one number: all three call pow of the C library, which is correct to half a unit in
#           nearly all cases.
# Seen:     Three numbers: Python calls pow, numba multiplies x*x*x, and arrays of numpy have a vectorized pow of their
#           own; a scalar of numpy agrees with Python. A quarter of random x differ between Python and numba, in the
#           last bit.
# Two orbits of a chaotic map, computed by one formula in two of these ways, separate in the end.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    numpy==2.4.6 numba==0.68.1
"$folder/venv/bin/python" - <<'PYTHON'
import numba
import numpy as np


@numba.njit
def cube(x):
    return x**3


print("numpy", np.__version__, " numba", numba.__version__)
sample = np.random.default_rng(1).uniform(0.5, 2, 20000)
python = [float(x) ** 3 for x in sample]
compiled = [cube(x) for x in sample]
products = [float(x) * float(x) * float(x) for x in sample]
scalars = [float(x**3) for x in sample]
arrays = (sample**3).tolist()
print("expected: the same doubles; of 20000")
for name, values in (("numba", compiled), ("numpy scalars", scalars), ("numpy arrays", arrays)):
    differences = sum(a != b for a, b in zip(values, python, strict=True))
    print(f"  {name:<14} differ from Python's x**3 in {differences}")
assert compiled == products and scalars == python
assert sum(a != b for a, b in zip(compiled, python, strict=True)) > 2000
print("seen: compiled code multiplies, and the last bit of a quarter of the cubes is another one")
PYTHON
# Here: floating-point steps are written as products, in Python, numpy and compiled code alike.
