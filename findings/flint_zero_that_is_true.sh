#!/usr/bin/env bash
# The truth value of zero in python-flint.
#
# Expected: `if x:` asks whether a number is not zero, as for int, Fraction and float; all types of FLINT agree.
# Seen:     False for fmpz, fmpq, nmod, fmpz_mod and polynomials, True for the zeros of arb, acb and of finite fields;
#           a matrix of balls raises NotImplementedError. All of them are equal to 0 when compared.
# An elimination that looks for a pivot by `if entry:` works over GF(p) as nmod and divides by zero over GF(p) as
# fq_default.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    python-flint==0.9.0
"$folder/venv/bin/python" - <<'PYTHON'
import flint
from flint import acb, arb, arb_mat, fmpq, fmpz, fmpz_mod_ctx, fq_default_ctx, nmod

print("python-flint", flint.__version__)
print("expected: bool(x) is False wherever x == 0")
zeros = {
    "fmpz": fmpz(0),
    "fmpq": fmpq(0),
    "nmod": nmod(0, 7),
    "fmpz_mod": fmpz_mod_ctx(7)(0),
    "fq_default": fq_default_ctx(7)(0),
    "arb": arb(0),
    "acb": acb(0),
}
for name, zero in zeros.items():
    print(f"  {name:<10} x == 0: {zero == 0}   bool(x): {bool(zero)}")
    assert zero == 0
    assert bool(zero) == (name in ("fq_default", "arb", "acb")), name
try:
    bool(arb_mat([[0]]))
    raise SystemExit("a matrix of balls has a truth value now")
except NotImplementedError:
    print("  arb_mat    bool(x): NotImplementedError")
print("seen: the zeros of finite fields and balls count as true")
PYTHON
# Here: code that runs over any field compares with zero.
