#!/usr/bin/env bash
# Arithmetic of arbitrarily large integers in DuckDB.
#
# Expected: BIGNUM is a type of integers: +, -, * and % of integers are integers, and an error says so where they are
#           not there.
# Seen:     Literals beyond 128 bits are BIGNUM, sums and differences are exact; products, remainders and abs are
#           DOUBLE, so that a number that ends in 1 leaves the remainder 8 modulo 10.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    duckdb==2.0.1
"$folder/venv/bin/python" - <<'PYTHON'
import duckdb

print("duckdb", duckdb.__version__)
n = 10**45 + 1
print("n = 10**45 + 1; expected: integers for n + 1, 2 n, n % 10, |n|")


def ask(expression):
    relation = duckdb.sql(f"select {expression}")
    return relation.fetchall()[0][0], str(relation.types[0])


big = f"'{n}'::BIGNUM"
for name in ("{} + 1::BIGNUM", "{} * 2::BIGNUM", "{} % 10", "abs({})"):
    value, kind = ask(name.format(big))
    print(f"  {name.format('n'):<16} {kind:<7} {value}")
assert ask(str(n)) == (str(n), "BIGNUM")
assert ask(f"{big} + 1::BIGNUM") == (str(n + 1), "BIGNUM")
assert ask(f"{big} * 2::BIGNUM") == (2e45, "DOUBLE")
remainder, kind = ask(f"{big} % 10")
assert kind == "DOUBLE" and remainder != n % 10
assert ask(f"abs({big})")[1] == "DOUBLE"
print("seen: addition is exact; multiplication, remainder and absolute value round, and return a wrong last digit")
PYTHON
# Here: nothing is computed with exact numbers inside a database.
