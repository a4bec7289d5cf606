"""Running a claim on the paper's objects: how many pairs it yields, and the first that is not as claimed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kahanmaps.algebra.fields import Field
from kahanmaps.checks.claims import Witness
from kahanmaps.errors import SingularMatrix, SingularStep
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Claim, Kind

# What evaluating a claim raises where it is not defined.
UNDEFINED = (SingularStep, SingularMatrix, ZeroDivisionError)


def entries(value: Any) -> list[Any]:
    """The entries of a matrix; a number alone."""
    return list(value.entries()) if hasattr(value, "entries") else [value]


def same(K: Field, left: Any, right: Any) -> bool:
    """Whether both sides are equal: matrices, numbers of K, or plain integers."""
    if isinstance(left, int):
        return bool(left == right)
    a, b = entries(left), entries(right)
    return len(a) == len(b) and all(K.equal(x, y) for x, y in zip(a, b, strict=True))


@dataclass(frozen=True)
class Outcome:
    """What a claim came to on certain objects: how many pairs, and the first that is not as claimed."""

    objects: PaperObjects
    pairs: int
    failure: tuple[Any, Any] | None

    @property
    def holds(self) -> bool:
        return self.failure is None


def evaluate(claim: Claim, o: PaperObjects) -> Outcome:
    """Run a claim. May raise SingularStep and the like where something is not defined."""
    pairs = 0
    with o.K.working():
        for left, right in claim.function(o):
            pairs += 1
            if same(o.K, left, right) != (claim.kind is not Kind.DIFFERENT):
                return Outcome(o, pairs, (left, right))
    return Outcome(o, pairs, None)


def witness_of(outcome: Outcome) -> Witness | None:
    """The point at which a claim failed, with both sides; of matrices the first entry that differs."""
    if outcome.failure is None:
        return None
    o = outcome.objects
    left, right = outcome.failure
    labels = ("left side", "right side")
    if isinstance(left, int):
        sides = (str(left), str(right))
    else:
        a, b = entries(left), entries(right)
        k = next((k for k, (x, y) in enumerate(zip(a, b, strict=True)) if not o.K.equal(x, y)), 0)
        if len(a) > 1:
            columns = left.ncols()
            labels = tuple(f"{side}, entry ({k // columns + 1},{k % columns + 1})" for side in labels)  # type: ignore[assignment]
        sides = (o.K.format(a[k]), o.K.format(b[k]))
    drawn = {name: o.vector(name) for name in sorted(o.used - {"roots"}) if not name.startswith("break")}
    text = {name: tuple(o.K.format(entry) for entry in vector.entries()) for name, vector in drawn.items()}
    point = text.pop("x", ())
    return Witness(point, o.K.format(o.eps), (sides[0],), (sides[1],), *labels, o.K.name, text)
