#!/usr/bin/env bash
# Statistics of exact rationals in xarray and numpy.
#
# Expected: mean, median and std of an array of fmpq are all exact, or all floats.
# Seen:     In xarray the mean is a float and the median exact; the standard deviation is exact where the variance is a
#           square and an error elsewhere. In numpy the mean of rationals is exact, that of integers an error unless
#           the division is exact.
# Whether a statistic works depends on the values.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    python-flint==0.9.0 numpy==2.4.6 xarray==2026.9.0
"$folder/venv/bin/python" - <<'PYTHON'
import flint
import numpy as np
import xarray as xr
from flint import fmpq, fmpz
from flint.utils.flint_exceptions import DomainError

print("python-flint", flint.__version__, " numpy", np.__version__, " xarray", xr.__version__)
two = xr.DataArray(np.array([fmpq(1, 3), fmpq(1, 2)]))
three = xr.DataArray(np.array([fmpq(1, 3), fmpq(1, 2), fmpq(1)]))
print("expected: one kind of number")
for name, value in (("mean", two.mean().item()), ("median", two.median().item()), ("std", two.std().item())):
    print(f"  xarray {name} of 1/3, 1/2: {value} ({type(value).__name__})")
assert type(two.mean().item()) is float
assert two.median().item() == fmpq(5, 12) and two.std().item() == fmpq(1, 12)
try:
    three.std()
    raise SystemExit("the standard deviation of 1/3, 1/2, 1 has a value now")
except DomainError as error:
    print("  xarray std of 1/3, 1/2, 1: DomainError:", error)
print("  numpy mean of 1/3, 1/2:", np.array([fmpq(1, 3), fmpq(1, 2)]).mean(), " of the integers 1, 3:", end=" ")
print(np.array([fmpz(1), fmpz(3)]).mean(), " of the integers 1, 2:", end=" ")
assert np.array([fmpq(1, 3), fmpq(1, 2)]).mean() == fmpq(5, 12) and np.array([fmpz(1), fmpz(3)]).mean() == 2
try:
    np.array([fmpz(1), fmpz(2)]).mean()
    raise SystemExit("the mean of the integers 1, 2 has a value now")
except DomainError as error:
    print("DomainError:", error)
print("seen: a float, a rational, and errors that depend on the values")
PYTHON
# Here: sums of exact numbers are divided as fmpq; floats are made once, at the end.
