"""Whether the parts of an analysis agree: the one place that sees all of them.

Degrees, singularities, integrals and heights are found independently of each other, and each within limits of its own.
What is proved stands. Where two measurements exclude each other, neither is a finding.
"""

from __future__ import annotations

from kahanmaps.errors import counted
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.findings import Findings

_POLYNOMIAL = (Growth.LINEAR, Growth.QUADRATIC, Growth.POLYNOMIAL)


def orbits_lie_on_curves(found: Findings) -> bool:
    """Whether dim - 1 independent integrals are proved or supported: then degrees grow quadratically at most.

    For the map acts on each of the curves, which have genus 0 or 1 where it has infinite order.
    """
    return found.integrals is not None and len(found.integrals.integrals) >= found.dim - 1 >= 1


def contradictions(found: Findings) -> list[str]:
    """What excludes each other among integrals, closed orbits and degrees: sentences, none where all agree."""
    growth = found.degrees.growth if found.degrees is not None else Growth.UNKNOWN
    period = found.integrals.profile.period if found.integrals is not None else None
    said = []
    if growth is Growth.EXPONENTIAL and orbits_lie_on_curves(found):
        said.append("the degrees seem to grow exponentially, which they cannot where integrals leave curves only")
    elif growth is Growth.EXPONENTIAL and isinstance(found.normal_form, SystemNormalForm):
        said.append("the degrees seem to grow exponentially, which they cannot for a member of the commuting family")
    if found.degrees is not None and found.degrees.enclosure is not None and orbits_lie_on_curves(found):
        said.append("positive algebraic entropy is proved, which excludes an integral")
    if found.pencil is not None and (impossible := found.pencil.against(growth)):
        said.append(impossible)
    if period is not None and growth in (Growth.EXPONENTIAL, *_POLYNOMIAL):
        said.append(f"orbits close after {counted(period, 'step')}, but the degrees seem to grow")
    return said


def doubt_of_heights(found: Findings) -> str:
    """Why the growth of heights is no finding beside that of the degrees; empty where the two go together."""
    if found.heights is None or found.degrees is None:
        return ""
    kind, growth = found.heights.kind, found.degrees.growth
    bounded = growth in (Growth.ZERO, Growth.BOUNDED)
    if bounded and kind in (Growth.QUADRATIC, Growth.EXPONENTIAL):
        reason = "the degrees are bounded"
    elif growth in _POLYNOMIAL and kind is Growth.EXPONENTIAL:
        reason = f"the degrees grow {'linearly' if growth is Growth.LINEAR else 'polynomially'}"
    elif growth is Growth.EXPONENTIAL and kind not in (Growth.EXPONENTIAL, Growth.UNDECIDED):
        reason = "the degrees grow exponentially"
    else:
        reason = ""
    steps = max(len(orbit.growth.heights) for orbit in found.heights.orbits) - 1
    last = max(found.degrees.patterns.lengths, default=0) if found.degrees.patterns is not None else 0
    if kind is not Growth.UNDECIDED and last > steps // 2:
        late = f"the singularities show something new up to step {last} and the orbits have {counted(steps, 'step')}"
        return f"{reason}: {late}" if reason else late
    return reason
