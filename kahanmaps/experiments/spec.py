"""What a batch is to do, in TOML: experiments, each a task for many systems and many values of its options.

    [experiments.commute]
    task = "check-commute"
    system = "family"                        # or a name of the catalogue, a path, or a list of these
    options = { draw = "generic" }           # the same for all tasks
    zip = [["m", "steps"]]                   # axes that run together; all others are combined

    [experiments.commute.axes]               # one value, a list, a range, or a list with ranges in it
    m = "2..5"
    steps = [20, 15, 10, 5]
    seed = "0..9999"
    eps = ["1/10", "0.05", "1/3..2/3 step 1/6"]

    [experiments.commute.limits]             # of one task; [limits] at the top is for all experiments
    time = "60 s"
    memory = "1 GB"
    digits = 20000

Reading it finds every mistake at once, each with its key; docs/batch.md has all keys.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from kahanmaps.errors import InputError, SystemFileError
from kahanmaps.experiments.grid import Grid, RationalRange, Values, read_values
from kahanmaps.experiments.options import FAMILY, OTHER, VOCABULARY, Option, exact, number_of, show, suggestion
from kahanmaps.experiments.recipes import family_recipe, find_file, recipe_of
from kahanmaps.experiments.records import Limits, Task, canonical
from kahanmaps.experiments.registry import MEMBER, MEMBER_OR_OTHER, TaskKind, task_kind
from kahanmaps.experiments.shape import Place, read_memory, read_time, shape_mistakes
from kahanmaps.family.draw import parse_chi
from kahanmaps.systems.files import SystemFile

MAX_BYTES = 4_000_000
MAX_TASKS = 1_000_000
DEFAULT_LIMITS = Limits(time=3600.0, memory=4 * 10**9)
FAMILY_WORD = "family"
_PARAMETERS = "parameters."
_TIME_STEP = "time_step"
_EPS2 = "eps2"
_FILES_AT_MOST = 10_000
_POINTS_COMPARED = 1_000
_LARGEST_TOLD = 3
# m from what a random member is drawn with.
_SIZES: Mapping[str, Callable[[Any], int]] = {
    "m": int,
    "eigenvalues": lambda text: int(text.count(",")) + 1,
    "chi": lambda text: parse_chi(text).degree(),
}


class SpecError(SystemFileError):
    """A spec with mistakes: all of them at once, each with its key."""


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


@dataclass(frozen=True)
class Spec:
    """The experiments of a spec, and the system documents that their tasks name."""

    name: str
    experiments: tuple[Experiment, ...]
    documents: Mapping[str, str]

    @property
    def size(self) -> int:
        """The number of all tasks."""
        return sum(experiment.size for experiment in self.experiments)


def read_spec(path: str | Path, *, max_tasks: int = MAX_TASKS) -> Spec:
    """The spec in a TOML file; paths of systems in it are relative to its folder.

    Raises SpecError with every mistake, InputError where the file cannot be read.
    """
    try:
        with open(path, "rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"cannot read the spec {path}: {reason or error}") from error
    return parse_spec(data, str(path), folder=Path(path).parent, max_tasks=max_tasks)


def parse_spec(
    text: str | bytes, where: str = "spec", *, folder: Path | None = None, max_tasks: int = MAX_TASKS
) -> Spec:
    """The spec that a text in TOML describes; `where` names it in messages.

    >>> table = '[experiments.a]\\ntask = "orbit"\\nsystem = "lorenz"\\n'
    >>> spec = parse_spec(table + 'axes = {eps = ["0.1", "1/7"], seed = "0..4"}')
    >>> spec.size, spec.experiments[0][0].options["eps"]
    (10, '1/10')
    >>> parse_spec('[experiments.a]\\ntask = "orbot"\\nsystem = "lorenz"')  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    kahanmaps.experiments.spec.SpecError: spec: 1 mistake
      experiments.a.task: there is no task 'orbot', expected one of ...; did you mean orbit?
    """
    if len(text) > MAX_BYTES:
        raise InputError(f"{where} is larger than {MAX_BYTES} bytes, the limit for a spec")
    try:
        decoded = text.decode("utf-8-sig") if isinstance(text, bytes) else text
        document = tomllib.loads(decoded, parse_float=lambda number: number.replace("_", ""))
    except UnicodeDecodeError as error:
        raise SpecError(where, [("TOML", f"not UTF-8 text: {error.reason} at byte {error.start}")]) from error
    except tomllib.TOMLDecodeError as error:
        raise SpecError(where, [("TOML", f"{error}")]) from error
    except (RecursionError, ValueError) as error:
        hint = "nested too deeply" if isinstance(error, RecursionError) else "write long numbers in quotes"
        raise SpecError(where, [("TOML", f"cannot be read: {hint}")]) from error
    return _SpecReader(document, where, folder or Path(), max_tasks).read()


class _SpecReader:
    """One pass over a document: the shape by pydantic, the meaning of whatever has its shape here."""

    def __init__(self, document: Mapping[str, Any], where: str, folder: Path, max_tasks: int) -> None:
        self.document = document
        self.where = where
        self.folder = folder
        self.max_tasks = max_tasks
        self.mistakes: list[tuple[str, str]] = []
        self.documents: dict[str, str] = {}
        self._misshapen: list[Place] = []

    def read(self) -> Spec:
        for path, key, sentence in shape_mistakes(self.document):
            self._misshapen.append(path)
            self.mistake(key, sentence)
        experiments = []
        tables = self.sound("experiments") or {}
        for name, table in tables.items():
            self._require_name(name)
            if isinstance(table, dict):
                experiment = _ExperimentReader(self, name).read()
                if experiment is not None:
                    experiments.append(experiment)
        spec = Spec(self.sound("name") or "", tuple(experiments), self.documents)
        if spec.size > self.max_tasks:
            self.mistake(
                "experiments",
                f"found {spec.size:,} tasks, expected at most {self.max_tasks:,} (--max-tasks allows more): "
                + _largest(experiments),
            )
        if self.mistakes:
            raise SpecError(self.where, self.mistakes)
        return spec

    def mistake(self, key: str, sentence: str) -> None:
        # Keys and words come from the file: nothing in them may reach a terminal as an escape sequence.
        printable = ["".join(c if c.isprintable() or c == "\n" else "_" for c in text) for text in (key, sentence)]
        self.mistakes.append((printable[0].replace("\n", "_")[:120], printable[1]))

    def sound(self, *path: str | int) -> Any:
        """The value at a place, None where it is missing or has not the right shape."""
        if any(bad == path[: len(bad)] for bad in self._misshapen):
            return None
        value: Any = self.document
        for key in path:
            if isinstance(value, dict) and key not in value:
                return None
            value = value[key]
        return value

    def _require_name(self, name: str) -> None:
        if not re.fullmatch(r"[A-Za-z0-9_.+-]{1,80}", name):
            self.mistake(
                f"experiments.{name}", "expected a name of at most 80 letters, digits and the characters _ . + -"
            )


class _ExperimentReader:
    """What one table [experiments.NAME] means."""

    def __init__(self, reader: _SpecReader, name: str) -> None:
        self.reader = reader
        self.name = name
        self.at = f"experiments.{name}"
        self.kind: TaskKind | None = None
        self.files: list[SystemFile] = []
        self.others: list[tuple[str, SystemFile]] = []
        self.is_family = False

    def read(self) -> Experiment | None:
        """The experiment, or None after telling what is wrong with it."""
        before = len(self.reader.mistakes)
        self._read_kind()
        recipes = self._read_systems()
        fixed, axes = self._read_values("options"), self._read_values("axes")
        if self.kind is None or self.reader.sound("experiments", self.name, "task") is None:
            return None
        self._require_once()
        zips = self._read_zips(axes)
        limits = self._read_limits(fixed)
        self._require()
        self._compare_dimensions({**fixed, **axes}, zips)
        if len(self.reader.mistakes) > before:
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
            self._mistake("zip", str(error))
            return None
        return Experiment(self.name, self.kind, recipes, constant, grid, limits)

    def _mistake(self, key: str, sentence: str) -> None:
        self.reader.mistake(f"{self.at}.{key}" if key else self.at, sentence)

    def _sound(self, *path: str | int) -> Any:
        return self.reader.sound("experiments", self.name, *path)

    def _read_kind(self) -> None:
        name = self._sound("task")
        if name is None:
            return
        try:
            self.kind = task_kind(name)
        except InputError as error:
            self._mistake("task", str(error))

    def _read_systems(self) -> list[dict[str, Any]]:
        raw = self._sound("system")
        if raw is None:
            if self.kind is not None and self.kind.needs is not None and self._table().get("system") is None:
                self._mistake(
                    "system", 'missing, expected "family", a name of the catalogue, a path, or a list of these'
                )
            return []
        if self.kind is not None and self.kind.needs is None:
            self._mistake("system", f"found {show(raw)}, expected none: {self.kind.name} is about no particular system")
            return []
        references = raw if isinstance(raw, list) else [raw]
        if not references:
            self._mistake("system", "found an empty list, expected at least one system")
        if FAMILY_WORD in references:
            self.is_family = True
            if len(references) > 1:
                self._mistake("system", 'found "family" among others, expected it alone: make another experiment')
            return [{"family": {}}]
        return self._read_files("system", references)

    def _read_files(self, key: str, references: Sequence[str]) -> list[dict[str, Any]]:
        recipes: dict[str, dict[str, Any]] = {}
        for number, reference in enumerate(references, start=1):
            place = f"{key}[{number}]" if len(references) > 1 else key
            try:
                for file in self._find(reference):
                    recipe = recipe_of(file, self.reader.documents)
                    if recipe["document"] in recipes:
                        self._mistake(place, f"found {file.name} twice, expected every system once")
                    recipes[recipe["document"]] = recipe
                    if key == "system":
                        self.files.append(file)
                        self._require_kind(place, file)
                    else:
                        self.others.append((place, file))
            except InputError as error:
                self._mistake(place, str(error))
        return list(recipes.values())

    def _find(self, reference: str) -> list[SystemFile]:
        """The system of a reference, or all those that match a pattern such as members/*.toml."""
        if any(mark in reference for mark in "*?["):
            if Path(reference).is_absolute() or not reference.endswith(".toml"):
                raise InputError(
                    f"found {show(reference)}, expected a pattern that ends in .toml and is relative to the folder of "
                    "the spec, e.g. members/*.toml"
                )
            try:
                paths = sorted(self.reader.folder.glob(reference))
            except (ValueError, NotImplementedError) as error:
                raise InputError(f"found {show(reference)}, which is no pattern: {error}") from error
            if not paths or len(paths) > _FILES_AT_MOST:
                raise InputError(f"found {len(paths)} files like {show(reference)}, expected 1 to {_FILES_AT_MOST}")
            return [find_file(str(path.relative_to(self.reader.folder)), self.reader.folder) for path in paths]
        try:
            return [find_file(reference, self.reader.folder)]
        except InputError as error:
            hint = suggestion(reference, [FAMILY_WORD])
            raise InputError(f"{error}{hint}") from error

    def _require_kind(self, place: str, file: SystemFile) -> None:
        if self.kind is None or file.member is not None or self.kind.needs not in (MEMBER, MEMBER_OR_OTHER):
            return
        if self.kind.needs == MEMBER_OR_OTHER and OTHER in self._given():
            return
        also = ", or a second system as the option other" if self.kind.needs == MEMBER_OR_OTHER else ""
        self._mistake(place, f"{file.name} is of kind [{file.kind}], expected one of kind [family]{also}")

    def _table(self) -> dict[str, Any]:
        found: dict[str, Any] = self.reader.document["experiments"][self.name]
        return found

    def _entries(self, part: str) -> list[tuple[str, str, Any]]:
        """What one of the tables says: canonical names of options, places, values."""
        entries: list[tuple[str, str, Any]] = []
        for key, raw in (self._sound(part) or {}).items():
            if key == "parameters" and isinstance(raw, dict):
                entries += [(f"{_PARAMETERS}{name}", f"{part}.{key}.{name}", value) for name, value in raw.items()]
            else:
                entries.append(("eps" if key == _TIME_STEP else key, f"{part}.{key}", raw))
        return entries

    def _given(self) -> dict[str, str]:
        """The options that the spec gives, right or wrong, and where."""
        return {name: place for part in ("axes", "options") for name, place, _ in self._entries(part)}

    def _require_once(self) -> None:
        places: dict[str, str] = {}
        for part in ("options", "axes"):
            for name, place, _ in self._entries(part):
                if name in places:
                    both = {place.rpartition(".")[2], places[name].rpartition(".")[2]}
                    hint = " (the time step is 2 eps)" if _TIME_STEP in both and len(both) > 1 else ""
                    self._mistake(place, f"found {places[name]} as well, expected one of the two{hint}")
                places.setdefault(name, place)

    def _read_values(self, part: str) -> dict[str, Values]:
        """The values in one of the tables, by canonical name; what is wrong is told and left out."""
        found: dict[str, Values] = {}
        if self.kind is None:
            return found  # what an option means depends on the task
        known = self._known_options()
        for name, place, raw in self._entries(part):
            if name == "parameters" and self.has_parameters:
                self._mistake(place, f"found {show(raw)}, expected a table of parameters")
                continue
            option = self._parameter(name, place) if name.startswith(_PARAMETERS) else known.get(name)
            if option is None:
                if not (name.startswith(_PARAMETERS) and self.has_parameters):  # otherwise it is told already
                    key = place.removeprefix(f"{part}.")
                    names = [*known, *([_TIME_STEP] if "eps" in known else [])]
                    expected = ", ".join([*names, *(["parameters"] if self.has_parameters else [])])
                    self._mistake(
                        place,
                        f"{self.kind.name} has no such option, expected one of {expected}{suggestion(key, names)}",
                    )
                continue
            if part == "options" and isinstance(raw, list):
                self._mistake(place, "found a list, expected one value; lists and ranges go to axes")
                continue
            values = self._read_one(place, option, raw)
            if values is None:
                continue
            if part == "options" and len(values) > 1:
                self._mistake(place, f"found {len(values)} values, expected one; lists and ranges go to axes")
                continue
            found[name] = values
        return found

    @property
    def has_parameters(self) -> bool:
        """Whether the system is a file, or may be: what it is is not known where its place is wrong."""
        return self.kind is not None and self.kind.needs is not None and not self.is_family

    def _parameter(self, name: str, place: str) -> Option | None:
        """A parameter of the systems; None after telling which of them has none of this name."""
        if not self.has_parameters:
            return None
        key = name.removeprefix(_PARAMETERS)
        for file in self.files:
            if key not in file.parameters:
                known = ", ".join(file.parameters) or "none"
                hint = suggestion(key, list(file.parameters))
                self._mistake(place, f"{file.name} has no such parameter, its parameters are: {known}{hint}")
                return None
        return exact(name, "a parameter of the system")

    def _read_one(self, place: str, option: Option, raw: Any) -> Values | None:
        if option.name == OTHER:
            references = raw if isinstance(raw, list) else [raw]
            if not references or not all(isinstance(reference, str) for reference in references):
                self._mistake(place, f"found {show(raw)}, expected a file, a name of the catalogue, or a list of these")
                return None
            recipes = self._read_files(place, references)
            return Values(option, [recipes]) if recipes else None
        if place.endswith(f".{_TIME_STEP}"):
            option = _time_step(option)
        values, mistakes = read_values(option, raw)
        for position, sentence in mistakes:
            self._mistake(place + "".join(f"[{k}]" for k in position), sentence)
        return values

    def _known_options(self) -> dict[str, Option]:
        known = dict(self.kind.options) if self.kind is not None else {}
        if self.is_family or (self.has_parameters and not self.files):  # what cannot be found may have meant a member
            known |= FAMILY | {"seed": VOCABULARY["seed"]}
        return known

    def _read_zips(self, axes: Mapping[str, Values]) -> list[tuple[str, ...]]:
        zips: list[tuple[str, ...]] = []
        before: set[str] = set()
        given = {name for name, _, _ in self._entries("axes")}
        for number, _ in enumerate(self._sound("zip") or [], start=1):
            place = f"zip[{number}]"
            written = self._sound("zip", number - 1)
            if written is None or any(self._sound("zip", number - 1, k) is None for k in range(len(written))):
                continue
            names = ["eps" if name == _TIME_STEP else name for name in written]
            unknown = [name for name in names if name not in axes]
            for name in unknown:
                if name not in given:  # otherwise something else is wrong with it, and told
                    self._mistake(place, f"{name} is not an axis{suggestion(name, list(axes))}")
            if len(names) < 2:
                self._mistake(place, f"found {show(names)}, expected at least two axes that run together")
                continue
            twice = [name for k, name in enumerate(names) if name in names[:k] or name in before]
            before |= set(names)
            for name in twice:
                self._mistake(place, f"found {name} twice, expected every axis in one zip at most")
            if unknown or twice:
                continue
            lengths = {name: len(axes[name]) for name in names}
            if len(set(lengths.values())) > 1:
                told = ", ".join(f"{name} has {length}" for name, length in lengths.items())
                self._mistake(place, f"{told} values, expected as many in each: a zip takes them together")
                continue
            zips.append(tuple(names))
        return zips

    def _read_limits(self, fixed: dict[str, Values]) -> Limits:
        own, common = self._sound("limits") or {}, self.reader.sound("limits") or {}
        limits = {}
        for name, read, default in (
            ("time", read_time, DEFAULT_LIMITS.time),
            ("memory", read_memory, DEFAULT_LIMITS.memory),
        ):
            raw = own.get(name, common.get(name))
            try:
                limits[name] = default if raw is None else read(raw)
            except ValueError:
                limits[name] = default  # told already, with the shape
        assert self.kind is not None
        place = self._given().get("max_digits")
        if "digits" in own and self._sound("limits", "digits") is None:
            pass  # told already, with the shape
        elif "max_digits" not in self.kind.options:
            if "digits" in own:
                self._mistake("limits.digits", f"{self.kind.name} has no digit budget, expected time and memory only")
        elif place is not None:
            if "digits" in own:
                self._mistake("limits.digits", f"found {place} as well, expected one of the two")
        elif isinstance(digits := own.get("digits", common.get("digits")), int) and digits > 0:
            fixed["max_digits"] = Values(VOCABULARY["max_digits"], [(digits,)])
        return Limits(**limits)  # type: ignore[arg-type]

    def _require(self) -> None:
        assert self.kind is not None
        if any(self._sound(part) is None and part in self._table() for part in ("options", "axes")):
            return  # what is missing may be in the table that has not the right shape
        given = self._given()
        for name in self.kind.required:
            if name not in given:
                self._mistake(f"axes.{name}", f"missing, expected {self.kind.options[name].help} (in axes or options)")
        if _EPS2 in given and self.kind.needs == MEMBER_OR_OTHER:
            for name, reason in ((OTHER, "it is the eps of a second system"), ("eps", "without it every eps is meant")):
                if name not in given:
                    self._mistake(given[_EPS2], f"found no {name}, expected one with eps2: {reason}")
        if not self.is_family:
            return
        if not {"m", "eigenvalues", "chi"} & given.keys():
            self._mistake("axes.m", "missing, expected m (half the dimension), eigenvalues or chi in axes or options")
        for first, second in (
            ("m", "eigenvalues"),
            ("m", "chi"),
            ("eigenvalues", "chi"),
            ("draw", "chi"),
            ("draw", "eigenvalues"),
        ):
            if first in given and second in given:
                self._mistake(given[second], f"found {given[first]} as well, expected one of {first} and {second}")

    def _compare_dimensions(self, values: Mapping[str, Values], zips: Sequence[Sequence[str]]) -> None:
        """Every start and every second system must fit every system; zipped ones are compared in pairs."""
        drawn = next((name for name in _SIZES if name in values), None) if self.is_family else None
        if drawn is not None and len(values[drawn]) <= _POINTS_COMPARED:
            dims = [2 * _SIZES[drawn](value) for value in values[drawn]]
        else:
            dims = [file.system.dim for file in self.files]
        starts = values.get("start", ())
        if len(starts) <= _POINTS_COMPARED:
            place = self._given().get("start", "")
            places = [f"{place}[{k}]" if len(starts) > 1 else place for k in range(1, len(starts) + 1)]
            found = [(place, start.count(",") + 1) for place, start in zip(places, starts, strict=True)]
            self._compare(found, dims, "coordinates", any({drawn, "start"} <= set(names) for names in zips))
        if OTHER in values:
            found = [(place, file.system.dim) for place, file in self.others]
            self._compare(found, dims, "variables", any({drawn, OTHER} <= set(names) for names in zips))

    def _compare(self, found: Sequence[tuple[str, int]], dims: Sequence[int], what: str, zipped: bool) -> None:
        for (place, count), partners in zip(found, [[d] for d in dims] if zipped else [dims] * len(found), strict=True):
            wrong = sorted({dim for dim in partners if dim != count})
            if wrong:
                self._mistake(place, f"found {count} {what}, expected {wrong[0]}, the dimension of the system")


def _time_step(eps: Option) -> Option:
    """The option eps, given as the time step h = 2 eps."""

    def read(value: Any) -> Any:
        return eps.read(number_of(value) / 2)

    return Option("eps", eps.help, read, eps.make, numbers=True)


def _complete(recipe: Mapping[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """The recipe with what the values say of it."""
    if "family" in recipe:
        return family_recipe(values)
    given = {name.removeprefix(_PARAMETERS): value for name, value in values.items() if name.startswith(_PARAMETERS)}
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


def _largest(experiments: Sequence[Experiment]) -> str:
    """What the largest experiments have, and how many more there are."""
    by_size = sorted(experiments, key=lambda experiment: -experiment.size)
    told = [f"{experiment.name} has {experiment.product}" for experiment in by_size[:_LARGEST_TOLD]]
    more = len(experiments) - len(told)
    return ", ".join(told) + (f" and {more} more" if more else "")
