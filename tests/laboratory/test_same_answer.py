"""Searches say the same and count the same work, whatever the hash seed and whatever was searched before."""

import json
import os
import subprocess
import sys

SCRIPT = """
import json, sys
import kahanmaps as km
from kahanmaps.algebra.work import counted
from kahanmaps.laboratory.preserve.limit.limits import flow_and_map

SEARCHES = [
    (km.find_integrals, "volterra_periodic_4", {}),
    (km.find_integrals, "weierstrass", {"flow": True}),
    (km.find_integrals, "lyness", {"effort": -8}),
    (km.find_integrals, "euler_top", {"symbols": ["a1"], "effort": -9}),
    (km.find_densities, "volterra_periodic_4", {}),
    (km.find_densities, "somos_4", {}),
    (km.find_poisson, "euler_top", {}),
    (lambda name, **_: flow_and_map(km.find_integrals(name)), "lotka_volterra", {}),
]
found = {}
for k in map(int, sys.argv[1:]):
    search, name, options = SEARCHES[k]
    before = counted()
    result = search(name, **options).to_json()
    found.setdefault(k, []).append((json.dumps(km.algebra.printing.plain(result)), counted() - before))
print(json.dumps(found))
"""
COUNT = 8


def answers(hash_seed: int, order: list[int]) -> dict[str, list[tuple[str, int]]]:
    command = [sys.executable, "-c", SCRIPT, *map(str, order)]
    environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    result = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def test_searches_do_not_depend_on_the_hash_seed_or_on_what_was_searched_before() -> None:
    order = list(range(COUNT))
    first, second = answers(1, order), answers(2, [*order[::-1], *order])
    for k in map(str, order):
        [one] = first[k]
        assert second[k] == [one, one]
        assert one[1] > 1000
