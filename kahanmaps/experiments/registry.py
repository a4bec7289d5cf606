"""The tasks a batch can do: functions that register themselves, and whose signature says what they can be asked.

    @task("family-space", needs=MEMBER)
    def family_space(system: SystemFile) -> Result:
        '''The space of cubics that belong to A.'''

The names of the parameters are names of `options.VOCABULARY`; a default makes an option optional, and `system`, if
it is there, is the system. A result is plain data; "verdict" in it becomes the verdict of the record. What a function
of the laboratory finds, with these options and these defaults, is a task that only says what is kept of it:

    @analysis("find-density", "preserve.densities:find_densities", eps=None, effort=1, seed=0)
    def density(found: DensitySearch) -> Result:
        '''The densities phi for which the measure dx/phi is invariant.'''

Tasks of one's own live in modules named in the environment variable KAHANMAPS_TASKS (separated by commas), which every
child imports.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from kahanmaps.errors import InputError, quoted, suggestion
from kahanmaps.experiments.options import OTHER, VOCABULARY, Option

ENVIRONMENT = "KAHANMAPS_TASKS"
LIBRARY = tuple(f"kahanmaps.experiments.{name}" for name in ("tasks", "laboratory_tasks"))
REPORT = "report"
Result = dict[str, Any]
Whole = tuple[Result, Any]  # a result and what it is of, of which `to_json` says all
Function = Callable[..., Result | Whole]
Summary = Callable[[Any], Result]
ARGUMENTS = {"symbolic": "symbols", "terms": "max_terms"}  # options that the laboratory calls otherwise

# What a task needs its system to be.
SYSTEM, MEMBER, MEMBER_OR_OTHER = "system", "member", "member or other"


@dataclass(frozen=True)
class TaskKind:
    """A kind of task: its name, what it does in a sentence, its options with their defaults, what it needs."""

    name: str
    summary: str
    function: Function
    options: Mapping[str, Option]
    defaults: Mapping[str, Any]
    needs: str | None
    reports: bool = False

    @property
    def required(self) -> tuple[str, ...]:
        """The options without a default."""
        return tuple(name for name in self.options if name not in self.defaults)

    def perform(self, system: Any, options: Mapping[str, Any]) -> Result:
        """Do it: `options` are canonical, `other` a system already made."""
        options = dict(options)
        is_whole = self.reports and options.pop(REPORT, False)
        made = {
            name: value if value is None or name == OTHER else self.options[name].make(value)
            for name, value in options.items()
        }
        if "eps" in self.required and made.get("eps") is None:  # left out for maps that do not depend on it
            made["eps"] = self.options["eps"].make("1")
        result = self.function(**made) if self.needs is None else self.function(system, **made)
        if isinstance(result, tuple):
            result, found = result
            result |= {REPORT: found.to_json()} if is_whole else {}
        return result


def fields(found: Any, *names: str) -> Result:
    """These attributes of what was found, by their names."""
    return {name: getattr(found, name) for name in names}


_KINDS: dict[str, TaskKind] = {}


def task(
    name: str, needs: str = SYSTEM, *, options: Mapping[str, Any] | None = None, reports: bool = False
) -> Callable[[Function], Function]:
    """Register a function as a kind of task. Raises TypeError for a parameter that is no known option.

    `options` with their defaults stand for the signature of a function that takes any: its system, and these by name.
    One that `reports` returns what it found beside the result: it is kept as "report" where that option asks for it.
    """

    def register(function: Function) -> Function:
        names, defaults, takes_system = list(options or ()), dict(options or {}), True
        if options is None:
            parameters = dict(inspect.signature(function).parameters)
            takes_system = parameters.pop("system", None) is not None
            names = list(parameters)
            defaults = {key: one.default for key, one in parameters.items() if one.default is not one.empty}
        unknown = [key for key in names if key not in VOCABULARY]
        if unknown:
            raise TypeError(f"task {name}: {unknown[0]} is not an option{suggestion(unknown[0], list(VOCABULARY))}")
        if name in _KINDS and _KINDS[name].function.__code__ != function.__code__:  # equal: imported a second time
            raise TypeError(f"there are two tasks of the name {name}")
        if reports:
            names, defaults[REPORT] = [*names, REPORT], False
        known = {key: VOCABULARY[key] for key in names}
        summary = (inspect.getdoc(function) or "").partition("\n")[0]
        _KINDS[name] = TaskKind(name, summary, function, known, defaults, needs if takes_system else None, reports)
        return function

    return register


def analysis(
    name: str, function: str, of: str = "", renamed: Mapping[str, str] = ARGUMENTS, **defaults: Any
) -> Callable[[Summary], Summary]:
    """Register what a function of the laboratory ("module:name", loaded when it is called) finds, as a kind of task.

    It is given the file of the system, or this attribute of it, and the options, some `renamed`. Their `defaults` stand
    here, not in the library, since they belong to the keys of tasks.
    """

    def register(summarize: Summary) -> Summary:
        def perform(system: Any, **options: Any) -> Whole:
            module, _, attribute = function.partition(":")
            asked = getattr(system, of) if of else system
            given = {renamed.get(key, key): value for key, value in options.items() if value is not None}
            found = getattr(import_module(f"kahanmaps.laboratory.{module}"), attribute)(asked, **given)
            return summarize(found), found

        perform.__doc__, perform.__module__ = summarize.__doc__, summarize.__module__
        task(name, options=defaults, reports=True)(perform)
        return summarize

    return register


def task_kinds() -> Mapping[str, TaskKind]:
    """All kinds of tasks by name, those of KAHANMAPS_TASKS among them."""
    for ours in LIBRARY:
        import_module(ours)
    for module in filter(None, map(str.strip, os.environ.get(ENVIRONMENT, "").split(","))):
        try:
            import_module(module)
        except Exception as error:  # it is somebody's module: whatever it raises
            told = f"{type(error).__name__}: {error}"
            raise InputError(f"{ENVIRONMENT} names the module {module}, which cannot be imported: {told}") from error
    return _KINDS


def task_kind(name: str) -> TaskKind:
    """The kind of task of this name. Raises InputError where there is none."""
    kinds = task_kinds()
    if name not in kinds:
        raise InputError(
            f"there is no task {quoted(name)}, expected one of {', '.join(kinds)}{suggestion(name, list(kinds))}"
        )
    return kinds[name]
