"""Experiments of a batch, and how a spec is read: an experiment is a lazy sequence of tasks of one kind.

`SpecDocument` checks the shape of a spec: its keys and the types of their values. `ExperimentReader` reads one table
[experiments.NAME]. The kind of task decides what the entries of this table mean. Mistakes go to the `SpecDocument`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, show, suggestion
from kahanmaps.experiments.grid import AxisValues, Grid, RationalRange, has_repeats, read_values
from kahanmaps.experiments.options import (
    EFFORT,
    FAMILY,
    OTHER,
    VOCABULARY,
    Option,
    exact,
    number_of,
    read_memory,
    read_time,
)
from kahanmaps.experiments.registry import MEMBER, MEMBER_OR_OTHER, TaskKind, task_kind
from kahanmaps.experiments.results.records import Task, TaskLimits, canonical
from kahanmaps.experiments.results.system_spec import ENDINGS, family_spec, find_file, spec_of

PARAMETERS = "parameters."  # prefix of the names of options that set a parameter of the system
DEFAULT_LIMITS = TaskLimits(time=3600.0, memory=4 * 10**9)
TIME_STEP = "time_step"
_EPS2 = "eps2"
_FAMILY = "family"
_MAX_FILES = 10_000  # maximal number of files that match one pattern
_CONTRADICTIONS = (("m", "eigenvalues"), ("m", "chi"), ("eigenvalues", "chi"), ("draw", "chi"), ("draw", "eigenvalues"))


KeyPath = tuple[str | int, ...]


def _read_system(value: Any) -> None:
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str) and name for name in names):
        raise ValueError(f'found {show(value)}, expected "family", a name of the catalogue, a path, or a list of these')


def _read_digits(value: Any) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value < 2**63:
        raise ValueError(f"found {show(value)}, expected a whole number of digits, at least 1")


# The shape of a value is a function that raises ValueError for invalid values, or a tuple (type, description). The
# tuple of a list or table has a third entry: the shape of every item, or a dict from allowed keys to their shapes.
_ON_ERROR = (str, "refuse, or skip for systems that cannot be read")
_LIMITS = (
    dict,
    "a table with time, memory, digits",
    {"time": read_time, "memory": read_memory, "digits": _read_digits},
)
_ZIP_TEXT = 'a list of lists of axes, e.g. [["m", "steps"]]'
_EXPERIMENT = (
    dict,
    "a table",
    {
        "task": (str, "the name of a task, e.g. check-commute"),
        "system": _read_system,
        "options": (dict, "a table of options with their values"),
        "axes": (dict, "a table of options with lists or ranges of values"),
        "zip": (list, _ZIP_TEXT, (list, _ZIP_TEXT, (str, _ZIP_TEXT))),
        "on_error": _ON_ERROR,
        "limits": _LIMITS,
    },
)
_EXPERIMENTS = (dict, "at least one table [experiments.NAME]", _EXPERIMENT)
_SPEC = {"name": (str, "text"), "on_error": _ON_ERROR, "limits": _LIMITS, "experiments": _EXPERIMENTS}
_REQUIRED_KEYS = ("experiments", "task")
_SYSTEM_FILE_KEYS = (("system",), ("hamiltonian",), ("family",), ("variables",))


def shape_mistakes(document: Mapping[str, Any]) -> list[tuple[KeyPath, str, str]]:
    """Return the mistakes in the shape of a spec as triples: path of the entry, the path as text, message.

    >>> shape_mistakes({"experiments": {"a": {"task": 1}}})
    [(('experiments', 'a', 'task'), 'experiments.a.task', 'found 1, expected the name of a task, e.g. check-commute')]
    """
    mistakes = _find_mistakes(document, (dict, "a table", _SPEC), ())
    return [(path, key_of(path), sentence) for path, sentence in mistakes]


def _find_mistakes(value: Any, shape: Any, path: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    """Yield (path, message) for each part of `value` that does not have the expected `shape`; `value` is at `path`."""
    if callable(shape):
        try:
            shape(value)
        except ValueError as error:
            yield path, str(error)
        return
    kind, expected, *inner = shape
    if not isinstance(value, kind) or (shape is _EXPERIMENTS and not value):
        yield path, f"found {show(value)}, expected {expected}"
        return
    (shapes,) = inner or [None]
    if isinstance(shapes, tuple):
        for name, item in enumerate(value) if kind is list else value.items():
            yield from _find_mistakes(item, shapes, (*path, name))
    elif shapes is not None:
        for name, inner_shape in shapes.items():
            if name in value:
                yield from _find_mistakes(value[name], inner_shape, (*path, name))
            elif name in _REQUIRED_KEYS:
                yield (*path, name), f"missing, expected {inner_shape[1]}"
        for name in (name for name in value if name not in shapes):
            unknown_path = (*path, name)
            is_of_system = unknown_path in _SYSTEM_FILE_KEYS
            hint = " (a system file is for the other commands)" if is_of_system else suggestion(name, list(shapes))
            yield unknown_path, f"unknown key, expected one of {', '.join(shapes)}{hint}"


def key_of(path: KeyPath) -> str:
    """Return a path as text; positions in lists are counted from 1: experiments.a.zip[1] is the first zip."""
    return "".join(f"[{step + 1}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


class SpecDocument:
    """A spec as plain data; relative paths of system files in it start from `folder`.

    `mistakes` are pairs (key, message), wrong shapes first. `documents` maps digests to documents, the contents of the
    system files read so far. If `skip_bad`, every experiment skips unreadable systems, as with on_error = "skip".
    """

    def __init__(self, document: Mapping[str, Any], folder: Path, skip_bad: bool = False) -> None:
        self.document = document
        self.skip_bad = skip_bad
        self.folder = folder
        self.mistakes: list[tuple[str, str]] = []
        self.documents: dict[str, str] = {}
        self._misshapen: list[KeyPath] = []
        for path, key, sentence in shape_mistakes(document):
            self._misshapen.append(path)
            self.mistake(key, sentence)

    def mistake(self, key: str, sentence: str) -> None:
        """Add the message `sentence` on the entry `key` to the mistakes."""
        # Keys and values come from the file and may contain escape sequences, which must not reach a terminal.
        printable = ["".join(c if c.isprintable() or c == "\n" else "_" for c in text) for text in (key, sentence)]
        self.mistakes.append((printable[0].replace("\n", "_")[:120], printable[1]))

    def valid_value(self, *path: str | int) -> Any:
        """Return the value at a path in the spec; None if it is missing or has a wrong shape."""
        if any(misshapen == path[: len(misshapen)] for misshapen in self._misshapen):
            return None
        value: Any = self.document
        for key in path:
            if isinstance(value, dict) and key not in value:
                return None
            value = value[key]
        return value


@dataclass(frozen=True)
class Experiment:
    """An experiment: a kind of task, values equal for all its tasks (`fixed`), and a grid of the values that vary."""

    name: str
    kind: TaskKind
    system_specs: Sequence[Mapping[str, Any]]
    fixed: Mapping[str, Any]
    grid: Grid
    limits: TaskLimits
    skipped: Sequence[tuple[str, str]] = ()  # pairs of a system that cannot be used, and the reason

    @property
    def size(self) -> int:
        """The number of tasks of the experiment."""
        return self.grid.size

    @property
    def product(self) -> str:
        """The number of tasks as a product, with a factor for each axis or zip: 4 m x 10,000 seed x 3 eps."""
        return " x ".join(f"{len(self.grid.axes[group[0]]):,} {'+'.join(group)}" for group in self.grid.groups)

    @cached_property
    def definition(self) -> str:
        """The definition of the experiment as canonical text; experiments with equal definitions have equal tasks.

        It contains the first task with all its options, since default values may change between versions.
        """
        axes: dict[str, Any] = {}
        for name, values in self.grid.axes.items():
            if not isinstance(values, AxisValues):
                axes[name] = list(values)
                continue
            read_value, axes[name] = values.option.read, []
            for piece in values.pieces:
                if isinstance(piece, RationalRange):  # a range is represented by its end points and its length
                    axes[name].append({"from": read_value(piece[0]), "to": read_value(piece[-1]), "count": len(piece)})
                else:
                    axes[name].append(list(piece))
        groups = [list(group) for group in self.grid.groups]
        return canonical({"first": self[0].text, "axes": axes, "order": groups})

    def __getitem__(self, index: int) -> Task:
        values = {**self.fixed, **self.grid[index]}
        system_spec = values.pop("system", None)
        if system_spec is not None and "family" in system_spec:
            system_spec = family_spec(values)
        elif system_spec is not None:
            parameters = {n.removeprefix(PARAMETERS): value for n, value in values.items() if n.startswith(PARAMETERS)}
            system_spec = {**system_spec, "parameters": {**system_spec["parameters"], **parameters}}
        options = {name: values.get(name, self.kind.defaults.get(name)) for name in self.kind.options}
        return Task(self.kind.name, system_spec, options)

    def tasks(self) -> Iterator[Task]:
        """Yield the tasks of the experiment in order."""
        return (self[index] for index in range(self.size))


class ExperimentReader:
    """Read the table of one experiment in a spec; a reader can be used once.

    `files` are the system files that the key `system` names. If `is_family` is true, the systems are random members of
    the family instead. `kind` is the kind of task, or None if the spec names an unknown one.
    """

    def __init__(self, spec: SpecDocument, name: str) -> None:
        self.spec = spec
        self.name = name
        self.raw: dict[str, Any] = spec.document["experiments"][name]  # its shape may be wrong
        self.kind: TaskKind | None = None
        self.files: list[SystemFile] = []
        self.skipped: list[tuple[str, str]] = []
        self.is_family = False

    def read(self) -> Experiment | None:
        """Return the experiment; if the table contains mistakes, report them and return None."""
        reported_before = len(self.spec.mistakes)
        on_error = self.valid_value("on_error") or self.spec.valid_value("on_error") or "refuse"
        if on_error not in ("refuse", "skip"):
            self.mistake("on_error", f'found {show(on_error)}, expected "refuse" or "skip"')
        self._skips = self.spec.skip_bad or on_error == "skip"
        if (name := self.valid_value("task")) is not None:
            with self._report_errors_at("task"):
                self.kind = task_kind(name)
        system_specs = self._read_systems()
        kind = self.kind
        if kind is None:
            return None  # without a kind of task the options have no meaning
        fixed, axes = self._read_values(kind, "options"), self._read_values(kind, "axes")
        keys: dict[str, str] = {}
        for option, option_key, _ in [entry for table in ("options", "axes") for entry in self.entries(table)]:
            if option in keys:
                option_names = {option_key.rpartition(".")[2], keys[option].rpartition(".")[2]}
                hint = " (the time step is 2 eps)" if TIME_STEP in option_names and len(option_names) > 1 else ""
                self.mistake(option_key, f"found {keys[option]} as well, expected one of the two{hint}")
            keys.setdefault(option, option_key)
        zips = self._read_zips(axes)
        own_limits = self.valid_value("limits") or {}
        time, memory, digits = (
            self.valid_value("limits", name) or self.spec.valid_value("limits", name)
            for name in ("time", "memory", "digits")
        )
        if "digits" in own_limits and self.valid_value("limits", "digits") is None:
            pass  # already reported as a wrong shape
        elif "max_digits" not in kind.options:
            if "digits" in own_limits:
                self.mistake("limits.digits", f"{kind.name} has no digit budget, expected time and memory only")
        elif (max_digits_key := self.given().get("max_digits")) is not None:
            if "digits" in own_limits:
                self.mistake("limits.digits", f"found {max_digits_key} as well, expected one of the two")
        elif digits is not None:
            fixed["max_digits"] = AxisValues(VOCABULARY["max_digits"], [(digits,)])
        limits = TaskLimits(
            DEFAULT_LIMITS.time if time is None else read_time(time),
            DEFAULT_LIMITS.memory if memory is None else read_memory(memory),
        )
        self._require_options(kind)
        if len(self.spec.mistakes) > reported_before:
            return None
        shared_values = {key: values[0] for key, values in fixed.items()}
        grid_axes: dict[str, Sequence[Any]] = dict(axes)
        if len(system_specs) == 1:
            shared_values["system"] = system_specs[0]
        elif system_specs:
            grid_axes = {"system": system_specs, **axes}
        grid = Grid(grid_axes, zips)
        return Experiment(self.name, kind, system_specs, shared_values, grid, limits, tuple(self.skipped))

    @contextmanager
    def _report_errors_at(self, key: str) -> Iterator[None]:
        """Report an InputError that the block raises as a mistake at this key."""
        try:
            yield
        except InputError as error:
            self.mistake(key, str(error))

    def mistake(self, key: str, sentence: str) -> None:
        """Report a mistake; `key` is relative to the table of this experiment."""
        self.spec.mistake(f"experiments.{self.name}.{key}", sentence)

    def valid_value(self, *path: str | int) -> Any:
        """Return the value at a path in the table of this experiment; None if it is missing or has a wrong shape."""
        return self.spec.valid_value("experiments", self.name, *path)

    def entries(self, table: str) -> list[tuple[str, str, Any]]:
        """Return triples (canonical name, key, value) of the entries of `table`, which is "options" or "axes"."""
        entries: list[tuple[str, str, Any]] = []
        for key, raw in (self.valid_value(table) or {}).items():
            if key == "parameters" and isinstance(raw, dict):
                entries += [(f"{PARAMETERS}{name}", f"{table}.{key}.{name}", value) for name, value in raw.items()]
            else:
                entries.append(("eps" if key == TIME_STEP else key, f"{table}.{key}", raw))
        return entries

    def given(self) -> dict[str, str]:
        """Return a dict from the canonical name of each option in the spec, valid or not, to its key."""
        return {name: key for table in ("axes", "options") for name, key, _ in self.entries(table)}

    def _read_values(self, kind: TaskKind, table: str) -> dict[str, AxisValues]:
        """Return a dict from canonical names of options in `table` to their valid values; report the invalid values."""
        valid: dict[str, AxisValues] = {}
        for name, key, raw in self.entries(table):
            with self._report_errors_at(key):
                if name == "parameters" and self.has_parameters:
                    raise InputError(f"found {show(raw)}, expected a table of parameters")
                option = self._find_option(kind, name, key.removeprefix(f"{table}."))
                if table == "options" and isinstance(raw, list):
                    raise InputError("found a list, expected one value; lists and ranges go to axes")
                values = self._read_axis(key, option, raw)
                if values is not None and table == "options" and len(values) > 1:
                    raise InputError(f"found {len(values)} values, expected one; lists and ranges go to axes")
                if values is not None:
                    valid[name] = values
        return valid

    def _find_option(self, kind: TaskKind, name: str, written_name: str) -> Option:
        """Return the option called `name`, maybe a parameter of the system. Raises InputError if there is none."""
        if name.startswith(PARAMETERS) and self.has_parameters:
            parameter = name.removeprefix(PARAMETERS)
            for file in self.files:
                if parameter not in file.parameters:
                    parameter_names = ", ".join(file.parameters) or "none"
                    hint = suggestion(parameter, list(file.parameters))
                    raise InputError(f"{file.name} has no such parameter, its parameters are: {parameter_names}{hint}")
            return exact(name, "a parameter of the system")
        options = dict(kind.options)
        if self.is_family or (self.has_parameters and not self.files):  # perhaps "family" was intended
            options |= FAMILY | {"seed": VOCABULARY["seed"]}
        if name in options:
            return options[name]
        if name == "seconds":  # an option of version 0.2, with which results depended on the clock
            replacement = (
                f"{EFFORT} = 1 (one more doubles the work)" if EFFORT in options else 'limits = {time = "60 s"}'
            )
            raise InputError(f"{kind.name} no longer has this option, expected {replacement}")
        names = [*options, *([TIME_STEP] if "eps" in options else [])]
        expected = ", ".join([*names, *(["parameters"] if self.has_parameters else [])])
        raise InputError(f"{kind.name} has no such option, expected one of {expected}{suggestion(written_name, names)}")

    def _read_axis(self, key: str, option: Option, raw: Any) -> AxisValues | None:
        """Return the values of one option, read from `raw`; None after reporting a mistake at `key`."""
        if option.name == OTHER:
            references = raw if isinstance(raw, list) else [raw]
            if not references or not all(isinstance(reference, str) for reference in references):
                raise InputError(f"found {show(raw)}, expected a file, a name of the catalogue, or a list of these")
            system_specs = self._read_files(key, references)
            return AxisValues(option, [system_specs]) if system_specs else None
        if key.endswith(f".{TIME_STEP}"):
            read_eps = option.read  # reads a value of eps, half the time step
            option = replace(option, read=lambda value: read_eps(number_of(value) / 2))
        zipped_names = {name for names in self._canonical_zips() for name in names or []}
        values, mistakes = read_values(option, raw, repeats=option.name in zipped_names)
        for position, sentence in mistakes:
            self.mistake(key + "".join(f"[{k}]" for k in position), sentence)
        return values

    def _canonical_zips(self) -> list[list[str] | None]:
        """Return the canonical names of the axes in each zip; None for a zip whose wrong shape is already reported."""
        zips: list[list[str] | None] = []
        for index, names in enumerate(self.valid_value("zip") or []):
            is_valid = self.valid_value("zip", index) is not None
            is_valid = is_valid and all(self.valid_value("zip", index, k) is not None for k in range(len(names)))
            zips.append(["eps" if name == TIME_STEP else name for name in names] if is_valid else None)
        return zips

    def _read_zips(self, axes: Mapping[str, AxisValues]) -> list[tuple[str, ...]]:
        zips: list[tuple[str, ...]] = []
        used_names: set[str] = set()
        given_axes = {name for name, _, _ in self.entries("axes")}
        for number, names in enumerate(self._canonical_zips(), start=1):
            key = f"zip[{number}]"
            if names is None:
                continue
            unknown_names = [name for name in names if name not in axes]
            for name in unknown_names:
                if name not in given_axes:  # otherwise the axis exists, and its invalid values are already reported
                    self.mistake(key, f"{name} is not an axis{suggestion(name, list(axes))}")
            repeated_names = [name for k, name in enumerate(names) if name in names[:k] or name in used_names]
            if len(names) < 2:
                self.mistake(key, f"found {show(names)}, expected at least two axes that run together")
                continue
            used_names |= set(names)
            for name in repeated_names:
                self.mistake(key, f"found {name} twice, expected every axis in one zip at most")
            if not unknown_names and not repeated_names:
                zips.append(tuple(names))
                lengths = {name: len(axes[name]) for name in names}
                if len(set(lengths.values())) > 1:
                    counts = ", ".join(f"{name} has {length}" for name, length in lengths.items())
                    self.mistake(key, f"{counts} values, expected equal numbers: the axes of a zip run together")
                elif any(has_repeats(axes[name]) for name in names):
                    positions: dict[tuple[str, ...], int] = {}
                    for k in range(1, 1 + lengths[names[0]]):
                        row = tuple(repr(axes[name][k - 1]) for name in names)
                        if positions.setdefault(row, k) != k:
                            self.mistake(
                                key, f"found equal values at positions {positions[row]} and {k}, expected them once"
                            )
                            break
        return zips

    def _require_options(self, kind: TaskKind) -> None:
        if any(self.valid_value(table) is None and table in self.raw for table in ("options", "axes")):
            return  # a table of wrong shape may contain the option that seems to be missing
        keys = self.given()
        needs_eps = not self.files or any(file.map.has_eps for file in self.files)
        for name in kind.required:
            if name not in keys and (name != "eps" or needs_eps):
                self.mistake(f"axes.{name}", f"missing, expected {kind.options[name].help} (in axes or options)")
        if _EPS2 in keys and kind.needs == MEMBER_OR_OTHER:
            for name, reason in ((OTHER, "it is the eps of a second system"), ("eps", "without it every eps is meant")):
                if name not in keys:
                    self.mistake(keys[_EPS2], f"found no {name}, expected one with eps2: {reason}")
        if not self.is_family:
            return
        if not {"m", "eigenvalues", "chi"} & keys.keys():
            self.mistake("axes.m", "missing, expected m (half the dimension), eigenvalues or chi in axes or options")
        for first, second in _CONTRADICTIONS:
            if first in keys and second in keys:
                self.mistake(keys[second], f"found {keys[first]} as well, expected one of {first} and {second}")

    # Systems

    @property
    def has_parameters(self) -> bool:
        """Whether the system may have parameters: it is a file, or its value is wrong and might mean a file."""
        return self.kind is not None and self.kind.needs is not None and not self.is_family

    def _read_systems(self) -> list[dict[str, Any]]:
        """Return the specs of the valid systems, report the invalid ones; an empty list if the task needs no system."""
        raw = self.valid_value("system")
        if raw is None:
            if self.kind is not None and self.kind.needs is not None and self.raw.get("system") is None:
                self.mistake(
                    "system", 'missing, expected "family", a name of the catalogue, a path, or a list of these'
                )
            return []
        if self.kind is not None and self.kind.needs is None:
            self.mistake("system", f"found {show(raw)}, expected none: {self.kind.name} needs no system")
            return []
        references = raw if isinstance(raw, list) else [raw]
        if not references:
            self.mistake("system", "found an empty list, expected at least one system")
        if _FAMILY in references:
            self.is_family = True
            if len(references) > 1:
                self.mistake("system", 'found "family" among others, expected it alone: add another experiment')
            return [{"family": {}}]
        return self._read_files("system", references)

    def _read_files(self, key: str, references: Sequence[str]) -> list[dict[str, Any]]:
        """Return the specs of the systems that `references`, the value of `key`, names; report the invalid ones."""
        system_specs: dict[str, dict[str, Any]] = {}
        names: dict[str, str] = {}  # digest of a document -> name of the file that contains it
        for number, reference in enumerate(references, start=1):
            item_key = f"{key}[{number}]" if len(references) > 1 else key
            with self._report_errors_at(item_key):
                for name in self._match_files(reference):
                    try:
                        file = find_file(name, self.spec.folder)
                        system_spec = spec_of(file, self.spec.documents)
                        if self._skips and key == "system":
                            self._require_kind(file)
                    except InputError as error:  # go on, so that all mistakes are reported together
                        if self._skips and key == "system":
                            self.skipped.append((name, str(error)))
                        else:
                            self.mistake(item_key, f"{error}{suggestion(name, [_FAMILY])}")
                        continue
                    if system_spec["document"] in system_specs:
                        same_document = f"{name} says the same as {names[system_spec['document']]}"
                        sentence = f"found {file.name} twice, expected every system once: {same_document}"
                        if self._skips and key == "system":
                            self.skipped.append((name, sentence))
                            continue
                        self.mistake(item_key, sentence)
                    system_specs[system_spec["document"]], names[system_spec["document"]] = system_spec, name
                    if key == "system":
                        self.files.append(file)
                        with self._report_errors_at(item_key):
                            self._require_kind(file)
        if self.skipped and not system_specs:
            name, reason = self.skipped[0]
            self.mistake(key, f"found no usable system, expected at least one; {name} is skipped: {reason}")
        return list(system_specs.values())

    def _match_files(self, reference: str) -> list[str]:
        """Return [reference], or the files that match if `reference` is a pattern such as members/*.toml."""
        if not any(wildcard in reference for wildcard in "*?["):
            return [reference]
        if Path(reference).is_absolute() or not reference.endswith(ENDINGS):
            raise InputError(
                f"found {show(reference)}, expected a pattern that ends in .toml and is relative to the folder of "
                "the spec, e.g. members/*.toml"
            )
        try:
            paths = sorted(self.spec.folder.glob(reference))
        except (ValueError, NotImplementedError) as error:
            raise InputError(f"found the invalid pattern {show(reference)}: {error}") from error
        if not paths or len(paths) > _MAX_FILES:
            raise InputError(f"found {len(paths)} files like {show(reference)}, expected 1 to {_MAX_FILES}")
        return [str(path.relative_to(self.spec.folder)) for path in paths]

    def _require_kind(self, file: SystemFile) -> None:
        """Raise InputError if the task needs a member of the family and the file does not contain one."""
        if self.kind is None or file.member is not None or self.kind.needs not in (MEMBER, MEMBER_OR_OTHER):
            return
        if self.kind.needs == MEMBER_OR_OTHER and OTHER in self.given():
            return
        alternative = ", or a second system as the option other" if self.kind.needs == MEMBER_OR_OTHER else ""
        raise InputError(f"{file.name} is of kind [{file.kind}], expected one of kind [family]{alternative}")
