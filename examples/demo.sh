#!/usr/bin/env bash
# The main job in one minute: a member of the family, an orbit, integrals, commutativity and its control, an analysis.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p .demo

exec 3>&1  # the commands are shown whole, whatever their output is piped into

run() {
    printf '\n$ kahanmaps %s\n' "$*" >&3
    kahanmaps "$@"
}

echo "== a member of the family, dimension 6, eigenvalues 1, -2, 3 hidden by a random symplectic matrix"
run family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o .demo/pair.toml
run family associated .demo/pair.toml --write-to .demo | cut -c 1-110

echo; echo "== an exact orbit of its Kahan map; the last column is conserved"
run orbit .demo/pair.toml --start 1/2,-1/3,0,1,2/5,-1 --eps 1/10 --steps 2 --integral known --format csv | cut -d , -f 1-3,8 | grep -v '^#'

echo; echo "== its integrals, for every eps"
run check-integrals .demo/pair.toml | cut -c 1-160

echo; echo "== the maps of two associated systems commute"
run check-commute .demo/pair-ppp.toml .demo/pair-ppm.toml | cut -c 1-160

echo; echo "== all associated maps, pairwise; the control, H_0 with H_1, has to be refuted"
run check-commute .demo/pair.toml | grep -v '^	' | cut -c 1-160

echo; echo "== Section 6 of the paper, statement by statement"
run verify .demo/pair.toml --section 6 -q | grep -v '^	' | grep -v '^note' | cut -c 1-160

echo; echo "== many members at once: a batch, resumed by the same command, and its summary"
cat > .demo/first.toml <<'END'
[experiments.commute]
task = "check-commute"
system = "family"
axes = { m = "2..3", seed = "0..9" }

[experiments.heights]
task = "heights"
system = "family"
options = { eps = "1/10", steps = 40 }
axes = { m = "2..3", seed = "0..9" }
END
run batch run .demo/first.toml --db .demo/first.db -q
run batch summary --db .demo/first.db -e heights --by m,growth --value constant --stable

echo; echo "== a system of another kind: what does the map of the Euler top preserve, and is it integrable?"
run analyze euler_top | cut -c 1-160

echo; echo "The files are in .demo; start your own with: .venv/bin/kahanmaps --help"
