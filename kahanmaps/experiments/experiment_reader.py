"""What one table [experiments.NAME] of a spec means: its task, options, axes, zips and limits, with every mistake."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from kahanmaps.errors import InputError, suggestion
from kahanmaps.experiments.experiment import PARAMETERS, Experiment
from kahanmaps.experiments.experiment_systems import ExperimentSystems
from kahanmaps.experiments.grid import Grid, Values, read_values
from kahanmaps.experiments.options import FAMILY, OTHER, VOCABULARY, Option, exact, number_of, show
from kahanmaps.experiments.records import Limits
from kahanmaps.experiments.registry import MEMBER_OR_OTHER, TaskKind, task_kind
from kahanmaps.experiments.shape import read_memory, read_time
from kahanmaps.experiments.spec_document import TIME_STEP, ExperimentTable, SpecDocument

DEFAULT_LIMITS = Limits(time=3600.0, memory=4 * 10**9)
_EPS2 = "eps2"
L = TypeVar("L")


def read_experiment(spec: SpecDocument, name: str) -> Experiment | None:
    """The experiment of this name, or None after telling what is wrong with it."""
    table = ExperimentTable(spec, name)
    kind = _read_kind(table)
    systems = ExperimentSystems(table, kind)
    recipes = systems.read()
    if kind is None:
        return None  # what an option means depends on the task
    return _ExperimentReader(table, kind, systems).read(recipes)


def _read_kind(table: ExperimentTable) -> TaskKind | None:
    name = table.sound("task")
    if name is None:
        return None
    try:
        return task_kind(name)
    except InputError as error:
        table.mistake("task", str(error))
        return None


class _ExperimentReader:
    """Reads all but the systems, which are found already."""

    def __init__(self, table: ExperimentTable, kind: TaskKind, systems: ExperimentSystems) -> None:
        self.table = table
        self.kind = kind
        self.systems = systems

    def read(self, recipes: Sequence[dict[str, Any]]) -> Experiment | None:
        fixed, axes = self._read_values("options"), self._read_values("axes")
        self._require_once()
        zips = self._read_zips(axes)
        limits = self._read_limits(fixed)
        self._require()
        self.systems.compare_dimensions({**fixed, **axes}, zips)
        if self.table.has_mistakes:
            return None
        constant = {key: values[0] for key, values in fixed.items()}
        grid_axes: dict[str, Sequence[Any]] = dict(axes)
        if len(recipes) == 1:
            constant["system"] = recipes[0]
        elif recipes:
            grid_axes = {"system": recipes, **axes}
        try:
            grid = Grid(grid_axes, zips)
        except InputError as error:
            self.table.mistake("zip", str(error))
            return None
        return Experiment(self.table.name, self.kind, recipes, constant, grid, limits)

    def _require_once(self) -> None:
        places: dict[str, str] = {}
        for part in ("options", "axes"):
            for name, place, _ in self.table.entries(part):
                if name in places:
                    both = {place.rpartition(".")[2], places[name].rpartition(".")[2]}
                    hint = " (the time step is 2 eps)" if TIME_STEP in both and len(both) > 1 else ""
                    self.table.mistake(place, f"found {places[name]} as well, expected one of the two{hint}")
                places.setdefault(name, place)

    def _read_values(self, part: str) -> dict[str, Values]:
        """The values in one of the tables, by canonical name; what is wrong is told and left out."""
        found: dict[str, Values] = {}
        known = self._known_options()
        for name, place, raw in self.table.entries(part):
            if name == "parameters" and self.systems.has_parameters:
                self.table.mistake(place, f"found {show(raw)}, expected a table of parameters")
                continue
            option = self._parameter(name, place) if name.startswith(PARAMETERS) else known.get(name)
            if option is None:
                if not (name.startswith(PARAMETERS) and self.systems.has_parameters):  # otherwise it is told already
                    key = place.removeprefix(f"{part}.")
                    names = [*known, *([TIME_STEP] if "eps" in known else [])]
                    expected = ", ".join([*names, *(["parameters"] if self.systems.has_parameters else [])])
                    self.table.mistake(
                        place,
                        f"{self.kind.name} has no such option, expected one of {expected}{suggestion(key, names)}",
                    )
                continue
            if part == "options" and isinstance(raw, list):
                self.table.mistake(place, "found a list, expected one value; lists and ranges go to axes")
                continue
            values = self._read_one(place, option, raw)
            if values is None:
                continue
            if part == "options" and len(values) > 1:
                self.table.mistake(place, f"found {len(values)} values, expected one; lists and ranges go to axes")
                continue
            found[name] = values
        return found

    def _parameter(self, name: str, place: str) -> Option | None:
        """A parameter of the systems; None after telling which of them has none of this name."""
        if not self.systems.has_parameters:
            return None
        key = name.removeprefix(PARAMETERS)
        for file in self.systems.files:
            if key not in file.parameters:
                known = ", ".join(file.parameters) or "none"
                hint = suggestion(key, list(file.parameters))
                self.table.mistake(place, f"{file.name} has no such parameter, its parameters are: {known}{hint}")
                return None
        return exact(name, "a parameter of the system")

    def _read_one(self, place: str, option: Option, raw: Any) -> Values | None:
        if option.name == OTHER:
            references = raw if isinstance(raw, list) else [raw]
            if not references or not all(isinstance(reference, str) for reference in references):
                self.table.mistake(
                    place, f"found {show(raw)}, expected a file, a name of the catalogue, or a list of these"
                )
                return None
            recipes = self.systems.read_files(place, references)
            return Values(option, [recipes]) if recipes else None
        if place.endswith(f".{TIME_STEP}"):
            option = _time_step(option)
        values, mistakes = read_values(option, raw)
        for position, sentence in mistakes:
            self.table.mistake(place + "".join(f"[{k}]" for k in position), sentence)
        return values

    def _known_options(self) -> dict[str, Option]:
        known = dict(self.kind.options)
        is_lost = self.systems.has_parameters and not self.systems.files
        if self.systems.is_family or is_lost:  # what cannot be found may have meant a member
            known |= FAMILY | {"seed": VOCABULARY["seed"]}
        return known

    def _read_zips(self, axes: Mapping[str, Values]) -> list[tuple[str, ...]]:
        zips: list[tuple[str, ...]] = []
        before: set[str] = set()
        given = {name for name, _, _ in self.table.entries("axes")}
        for number, _ in enumerate(self.table.sound("zip") or [], start=1):
            place = f"zip[{number}]"
            written = self.table.sound("zip", number - 1)
            if written is None or any(self.table.sound("zip", number - 1, k) is None for k in range(len(written))):
                continue
            names = ["eps" if name == TIME_STEP else name for name in written]
            unknown = [name for name in names if name not in axes]
            for name in unknown:
                if name not in given:  # otherwise something else is wrong with it, and told
                    self.table.mistake(place, f"{name} is not an axis{suggestion(name, list(axes))}")
            if len(names) < 2:
                self.table.mistake(place, f"found {show(names)}, expected at least two axes that run together")
                continue
            twice = [name for k, name in enumerate(names) if name in names[:k] or name in before]
            before |= set(names)
            for name in twice:
                self.table.mistake(place, f"found {name} twice, expected every axis in one zip at most")
            if unknown or twice:
                continue
            lengths = {name: len(axes[name]) for name in names}
            if len(set(lengths.values())) > 1:
                told = ", ".join(f"{name} has {length}" for name, length in lengths.items())
                self.table.mistake(place, f"{told} values, expected as many in each: a zip takes them together")
                continue
            zips.append(tuple(names))
        return zips

    def _read_limits(self, fixed: dict[str, Values]) -> Limits:
        own, common = self.table.sound("limits") or {}, self.table.spec.sound("limits") or {}
        time = _limit(read_time, own.get("time", common.get("time")), DEFAULT_LIMITS.time)
        memory = _limit(read_memory, own.get("memory", common.get("memory")), DEFAULT_LIMITS.memory)
        place = self.table.given().get("max_digits")
        if "digits" in own and self.table.sound("limits", "digits") is None:
            pass  # told already, with the shape
        elif "max_digits" not in self.kind.options:
            if "digits" in own:
                self.table.mistake(
                    "limits.digits", f"{self.kind.name} has no digit budget, expected time and memory only"
                )
        elif place is not None:
            if "digits" in own:
                self.table.mistake("limits.digits", f"found {place} as well, expected one of the two")
        elif isinstance(digits := own.get("digits", common.get("digits")), int) and digits > 0:
            fixed["max_digits"] = Values(VOCABULARY["max_digits"], [(digits,)])
        return Limits(time, memory)

    def _require(self) -> None:
        if any(self.table.sound(part) is None and part in self.table.raw for part in ("options", "axes")):
            return  # what is missing may be in the table that has not the right shape
        given = self.table.given()
        for name in self.kind.required:
            if name not in given:
                self.table.mistake(
                    f"axes.{name}", f"missing, expected {self.kind.options[name].help} (in axes or options)"
                )
        if _EPS2 in given and self.kind.needs == MEMBER_OR_OTHER:
            for name, reason in ((OTHER, "it is the eps of a second system"), ("eps", "without it every eps is meant")):
                if name not in given:
                    self.table.mistake(given[_EPS2], f"found no {name}, expected one with eps2: {reason}")
        if not self.systems.is_family:
            return
        if not {"m", "eigenvalues", "chi"} & given.keys():
            self.table.mistake(
                "axes.m", "missing, expected m (half the dimension), eigenvalues or chi in axes or options"
            )
        for first, second in (
            ("m", "eigenvalues"),
            ("m", "chi"),
            ("eigenvalues", "chi"),
            ("draw", "chi"),
            ("draw", "eigenvalues"),
        ):
            if first in given and second in given:
                self.table.mistake(given[second], f"found {given[first]} as well, expected one of {first} and {second}")


def _limit(read: Callable[[Any], L], raw: Any, default: L) -> L:
    """What is given, if it has the right shape; if not, that is told already."""
    try:
        return default if raw is None else read(raw)
    except ValueError:
        return default


def _time_step(eps: Option) -> Option:
    """The option eps, given as the time step h = 2 eps."""

    def read(value: Any) -> Any:
        return eps.read(number_of(value) / 2)

    return Option("eps", eps.help, read, eps.make, numbers=True)
