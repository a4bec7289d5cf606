"""A question to SageMath (passagemath): reads the input as JSON, writes the answer and its time. Run by peers.py."""

import json
import sys
import time

from sage.all__sagemath_schemes import *  # noqa: F403  initializes Sage, so it is first
from sage.dynamics.arithmetic_dynamics.projective_ds import DynamicalSystem_projective
from sage.rings.rational_field import QQ
from sage.schemes.projective.projective_space import ProjectiveSpace

MOST_RUNS = 200


def plain(points):
    """Points as lists of fractions."""
    return [[str(entry) for entry in point] for point in points]


QUESTIONS = {
    "degrees": lambda f, start, entry: [int(degree) for degree in f.degree_sequence(entry["terms"])],
    "dynamical degree": lambda f, start, entry: str(f.dynamical_degree(N=entry["terms"])),
    "orbit": lambda f, start, entry: plain(f.orbit(start, [0, entry["steps"]])),
    "fixed points": lambda f, start, entry: plain(f.periodic_points(1)),
    "canonical height": lambda f, start, entry: str(f.canonical_height(start)),
    "preperiodic": lambda f, start, entry: str(start.is_preperiodic(f)),
}


def main(question):
    """Answer it until a third of a second has passed, each time with a new map, which remembers nothing."""
    entry = json.load(sys.stdin)
    space = ProjectiveSpace(QQ, len(entry["variables"]) - 1, entry["variables"])
    ring = space.coordinate_ring()
    start = space([QQ(text) for text in entry["start"]] + [1])
    forms = [ring(text) for text in entry["forms"]]
    started, count, seconds = time.process_time(), 0, 0.0
    try:
        while seconds < 0.3 and count < MOST_RUNS:
            text = QUESTIONS[question](DynamicalSystem_projective(forms, domain=space), start, entry)
            count, seconds = count + 1, time.process_time() - started
        answer = {"text": text, "seconds": seconds / count}
    except Exception as error:  # whatever it says is the answer
        answer = {"error": f"{type(error).__name__}: {error}"}
    print(json.dumps(answer))


main(sys.argv[1])
