#!/usr/bin/env bash
# A tour of one minute: a member of the commuting family, an orbit, integrals, commutativity with a control, an analysis.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p .demo

exec 3>&1  # command lines are printed here, outside the pipes that shorten the output

run() {
    printf '\n$ kahanmaps %s\n' "$*" >&3
    kahanmaps "$@"
}

# Cut lines of more than $1 characters at a word boundary, and mark the cut by an ellipsis.
shorten() {
    awk -v width="$1" 'length($0) > width { $0 = substr($0, 1, width - 3); sub(/[ \t][^ \t]*$/, ""); $0 = $0 " ..." } { print }'
}

echo "== a member of the commuting family: dimension 6, eigenvalues 1, -2, 3, coordinates changed by a random symplectic matrix"
run family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o .demo/pair.toml
run family associated .demo/pair.toml --write-to .demo | shorten 110

echo; echo "== an exact orbit of its Kahan map: two of the six coordinates, and a conserved function in the last column"
run orbit .demo/pair.toml --start 1/2,-1/3,0,1,2/5,-1 --eps 1/10 --steps 2 --integral known --format csv | cut -d , -f 1-3,8 | grep -v '^#'

echo; echo "== its integrals, proved for every eps"
run check-integrals .demo/pair.toml | shorten 160

echo; echo "== the maps of two associated systems commute"
run check-commute .demo/pair-ppp.toml .demo/pair-ppm.toml | shorten 160

echo; echo "== all pairs of associated maps commute; the maps of H_0 and H_1 are a control that must be refuted"
run check-commute .demo/pair.toml | grep -v '^	' | shorten 160

echo; echo "== Section 6 of the paper, statement by statement"
run verify .demo/pair.toml --section 6 -q | grep -v '^	' | grep -v '^note' | shorten 160

echo; echo "== a batch of many members (the same command would resume it) and its summary"
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

echo; echo "== a system outside the family: what does the map of the Euler top preserve, and is it integrable?"
run analyze euler_top | shorten 160

echo; echo "The files are in .demo. To start your own work: .venv/bin/kahanmaps --help"
