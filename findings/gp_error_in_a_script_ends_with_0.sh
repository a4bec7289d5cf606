#!/usr/bin/env bash
# The exit status of PARI/GP after an error in a script.
#
# Expected: `gp -q FILE` stops at a line of FILE that raises an error, with a status that is not 0.
# Seen:     gp reports the error and goes on with the next line, up to quit(0). A check that raises an error is thereby
#           skipped, and a script that sets a flag when a check fails, and ends with quit(flag), reports success. After
#           `default(recover, 0)` in the file gp stops with status 1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check passagemath-pari==10.8.13
gp=$(find "$folder/venv" -path '*sage_wheels/bin/gp' -type f)
"$gp" --version-short

# The determinant is wrong (it is that of a vector, not of a matrix), so that this check cannot be made.
cat >"$folder/proof.gp" <<'GP'
failed = 0;
check(text, holds) = { print("  ", text, ": ", holds); if(!holds, failed = 1); }
check("first", (x + 1)^2 == x^2 + 2*x + 1);
check("second", matdet([x]) == x + 1);
check("third", (x - 1)*(x + 1) == x^2 - 1);
quit(failed)
GP
echo "default(recover, 0);" | cat - "$folder/proof.gp" >"$folder/strict.gp"

run() {
    local status=0
    "$gp" -q "$1" </dev/null 2>"$folder/errors" || status=$?
    grep -c "incorrect type in det" "$folder/errors" >/dev/null
    echo "  status of $(basename "$1"): $status"
    seen=$status
}
echo "expected: a status that is not 0 for both"
run "$folder/proof.gp"
[ "$seen" = 0 ]
run "$folder/strict.gp"
[ "$seen" = 1 ]
echo "seen: the second check is skipped and the status is 0; with recover = 0 gp stops there with status 1"
# Here: certificates for gp begin with default(recover, 0).
