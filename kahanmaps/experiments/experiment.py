"""One experiment of a batch: many tasks of one kind, none of which is made before it is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from kahanmaps.experiments.grid import Grid, RationalRange, Values
from kahanmaps.experiments.recipes import family_recipe
from kahanmaps.experiments.records import Limits, Task, canonical
from kahanmaps.experiments.registry import TaskKind

PARAMETERS = "parameters."  # what the name of a value begins with that is a parameter of the system


@dataclass(frozen=True)
class Experiment:
    """One experiment: a kind of task, what is the same for all its tasks (`fixed`), and the grid of what is not."""

    name: str
    kind: TaskKind
    recipes: Sequence[Mapping[str, Any]]
    fixed: Mapping[str, Any]
    grid: Grid
    limits: Limits

    @property
    def size(self) -> int:
        """The number of its tasks."""
        return self.grid.size

    @property
    def product(self) -> str:
        """That number as a product: 4 m x 10,000 seed x 3 eps."""
        return " x ".join(f"{len(self.grid.axes[group[0]]):,} {'+'.join(group)}" for group in self.grid.groups)

    @cached_property
    def definition(self) -> str:
        """What its tasks follow from, as canonical text: experiments with the same definition have the same tasks.

        The first task has all that is the same in all of them, defaults too, which may change from version to version.
        """
        axes = {name: _axis_data(values) for name, values in self.grid.axes.items()}
        order = [list(group) for group in self.grid.groups]
        return canonical({"first": self[0].text, "axes": axes, "order": order})

    def __getitem__(self, index: int) -> Task:
        values = {**self.fixed, **self.grid[index]}
        recipe = values.pop("system", None)
        if recipe is not None:
            recipe = _complete(recipe, values)
        options = {name: values.get(name, self.kind.defaults.get(name)) for name in self.kind.options}
        return Task(self.kind.name, recipe, options)

    def tasks(self) -> Iterator[Task]:
        """Its tasks in order, one at a time."""
        return (self[index] for index in range(self.size))


def _complete(recipe: Mapping[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """The recipe with what the values say of it."""
    if "family" in recipe:
        return family_recipe(values)
    given = {name.removeprefix(PARAMETERS): value for name, value in values.items() if name.startswith(PARAMETERS)}
    return {**recipe, "parameters": {**recipe["parameters"], **given}}


def _axis_data(values: Sequence[Any]) -> Any:
    """An axis as plain data, a range as its ends, not spelt out."""
    if not isinstance(values, Values):
        return list(values)
    pieces: list[Any] = []
    for piece in values.pieces:
        if isinstance(piece, RationalRange):
            read = values.option.read
            pieces.append({"from": read(piece[0]), "to": read(piece[-1]), "count": len(piece)})
        else:
            pieces.append(list(piece))
    return pieces
