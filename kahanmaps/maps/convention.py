"""What eps is, in a sentence that every record carries."""

from __future__ import annotations

from kahanmaps.maps.implicit import BirationalMap

CONVENTION = "eps is the paper's epsilon, the time step is 2 eps"
NO_TIME_STEP = "eps stands in the map as its file says; there is no time step"
NO_EPS = "the map does not depend on eps"


def convention(*maps: BirationalMap) -> str:
    """The sentence for the maps of which a record speaks together."""
    with_eps = [map_ for map_ in maps if map_.has_eps]
    if not with_eps:
        return NO_EPS
    return CONVENTION if any(map_.has_time_step for map_ in with_eps) else NO_TIME_STEP
