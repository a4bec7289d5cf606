#!/usr/bin/env bash
# A large integer as an argument of a task of dask.
#
# Expected: An integer is an argument like any other: pickle takes 10**5000 in microseconds.
# Seen:     client.submit raises ValueError, because the name of the task is made from the decimal digits of its
#           arguments, and Python writes at most 4,300 of them. With pure=False or a key, or as an integer of FLINT, it
#           works; results are free.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    distributed==2026.8.0 dask==2026.8.0 python-flint==0.9.0
"$folder/venv/bin/python" - <<'PYTHON'
import pickle

import distributed
from flint import fmpz


def bits(n):
    return int(n).bit_length()


print("distributed", distributed.__version__)
n = 10**5000
assert pickle.loads(pickle.dumps(n)) == n
with distributed.Client(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as client:
    print("expected:", bits(n), "bits")
    try:
        client.submit(bits, n)
        raise SystemExit("integers of 5001 digits are accepted now")
    except ValueError as error:
        print("  submit(bits, n): ValueError:", str(error)[:60], "...")
    ways = {
        "pure=False": client.submit(bits, n, pure=False),
        "key='bits'": client.submit(bits, n, key="bits"),
        "fmpz(n)": client.submit(bits, fmpz(n)),
    }
    for way, future in ways.items():
        print(f"  with {way}: {future.result()}")
        assert future.result() == bits(n)
print("seen: an error of the naming of tasks, in all ways but three")
PYTHON
# Here: tasks travel as text.
