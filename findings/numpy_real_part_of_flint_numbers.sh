#!/usr/bin/env bash
# Real and imaginary parts of an array of complex balls.
#
# Expected: np.real, np.imag of an array of acb are arrays of arb, or an error says that objects are not understood.
# Seen:     np.real returns the complex numbers unchanged and np.imag zeros, silently; np.conj and np.abs are right.
# NumPy takes the parts of an object array as those of real numbers, while ufuncs call the method of each element.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    python-flint==0.9.0 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import flint
import numpy as np
from flint import acb

print("python-flint", flint.__version__, " numpy", np.__version__)
z = np.array([acb(1, 2), acb(3, -4)])
print("expected: real parts 1, 3; imaginary parts 2, -4")
print("  np.real:", np.real(z))
print("  np.imag:", np.imag(z))
print("  np.conj:", np.conj(z), "  np.abs:", np.abs(z))
assert list(np.real(z)) == list(z), "np.real takes real parts now"
assert list(np.imag(z)) == [0, 0], "np.imag takes imaginary parts now"
assert list(np.conj(z)) == [acb(1, -2), acb(3, 4)] and np.abs(z)[1] == 5
print("seen: 1 + 2i is its own real part, and the imaginary parts are 0")
PYTHON
# Here: parts of balls are taken one by one with .real and .imag.
