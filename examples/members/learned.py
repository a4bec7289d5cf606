"""What the study says, in some ten lines, from its database.

python learned.py study.db
"""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from math import log2

from flint import fmpq

import kahanmaps as km
from kahanmaps.experiments.results.records import Row
from kahanmaps.experiments.results.system_spec import system_from
from kahanmaps.maps.normal_form.planes_point import NormalSteps


def results(store: km.Store, *experiments: str) -> Iterator[tuple[Row, dict]]:
    """The rows of some experiments that are done, with their results; a task in two experiments comes once."""
    seen = set()
    for row in store.rows(experiments):
        if row.record is not None and row.record.is_ok and row.task.key not in seen:
            seen.add(row.task.key)
            yield row, dict(row.record.result or {})


def member_of(row: Row) -> tuple[int, str, int]:
    """m, how the member was drawn, and its seed."""
    return row.task.value("m"), row.task.value("draw"), row.task.value("seed")


def heights_of_gamma(row: Row, result: dict) -> list[float]:
    """The heights of gamma = 1 - disc(h) level^2 in the planes of a member, in bits."""
    file = system_from(row.task.system or {}, {}.__getitem__)
    normal_form = km.system_normal_form(file.system, file.hamiltonian, file.member)
    start, eps = km.parse_point(result["start"]), km.parse_point(row.task.value("eps"))[0]
    blocks, _ = NormalSteps(normal_form, eps).blocks(start)
    gammas = [fmpq(1) - block.delta for block in blocks]
    return [log2(max(abs(int(gamma.p)), int(gamma.q))) for gamma in gammas]


def quantiles(values: list[float]) -> str:
    """Least, median, largest."""
    ordered = sorted(values)
    return ", ".join(f"{ordered[k]:.3f}" for k in (0, len(ordered) // 2, -1))


def space(store: km.Store) -> dict[tuple[int, str, int], str]:
    """Dimensions; chi of every member, for later."""
    found = list(results(store, "space"))
    members = Counter(result["m"] for _, result in found)
    dimensions = Counter((result["m"], result["dimension"]) for _, result in found)
    for (m, dimension), count in sorted(dimensions.items()):
        print(f"m = {m}: dimension {dimension} of the space of cubics, for {count} of {members[m]} members")
    return {member_of(row): " ".join(f"({factor})" for factor in result["factors"]) for row, result in found}


def commute(store: km.Store, chi: dict[tuple[int, str, int], str]) -> None:
    """Associated pairs, and H_0 with H_1."""
    claims, proved, alike = 0, 0, Counter()
    refuted = 0
    for row, result in results(store, "commute"):
        claims, proved = claims + result["claims"], proved + result["proved"]
        refuted += result["controls_refuted"]
        if result["controls_refuted"] < result["controls"]:
            alike[chi[member_of(row)]] += 1
    print(f"claims that associated maps commute: {claims}, proved for every eps: {proved}")
    which = "maps of H_0 and H_1 (grad H_1 = A grad H_0)"
    print(f"{which}: refuted that they commute for {refuted} members, not refuted for:")
    for factors, count in alike.most_common():
        print(f"    {count} with chi = {factors}")


def heights(store: km.Store) -> None:
    """Kinds of growth, and the constant against the heights of gamma."""
    kinds = Counter(result["growth"] for _, result in results(store, "heights", "heights-eps", "heights-associated"))
    print("growth of heights:", ", ".join(f"{kind} {count}" for kind, count in kinds.most_common()))
    for _, result in results(store, "heights", "heights-eps", "heights-associated"):
        if result["growth"] != "quadratic":
            print(f"    {result['growth']}: {result['ending']}")
    per_plane = defaultdict(list)
    for row, result in results(store, "heights", "heights-eps"):
        if result["constant"] is not None:
            sizes = heights_of_gamma(row, result)
            rest = float(result["constant"]) - sum(sizes) / 8
            per_plane[row.task.value("eps")].append((rest / len(sizes), sum(sizes) / len(sizes)))
    print("c minus the sum of h(gamma)/8, for each plane, in bits: least, median, largest; median h(gamma) beside it")
    for eps, values in sorted(per_plane.items(), key=lambda item: -fraction(item[0])):
        size = sorted(size for _, size in values)[len(values) // 2]
        print(f"    eps = {eps}: {quantiles([rest for rest, _ in values])}; {size:.1f} ({len(values)} orbits)")


def associated(store: km.Store) -> None:
    """The same start under the maps of the associated systems of one member."""
    constants = defaultdict(list)
    for row, result in results(store, "heights-associated"):
        constants[member_of(row)].append(result["constant"])
    spread = []
    for found in constants.values():
        if None not in found:
            numbers = [float(constant) for constant in found]
            spread.append(max(numbers) / min(numbers) - 1)
    print(f"constants of the associated maps from one start: equal to within {max(spread):.1e} ({len(spread)} members)")


def fraction(text: str) -> float:
    """A number to sort by."""
    number = km.parse_point(text)[0]
    return int(number.p) / int(number.q)


if __name__ == "__main__":
    with km.Store.open(sys.argv[1], readonly=True) as study:
        commute(study, space(study))
        heights(study)
        associated(study)
