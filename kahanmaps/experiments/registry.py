"""The kinds of tasks in batches: functions registered by a decorator; their signatures determine the options.

    @task("family-space", needs=MEMBER)
    def family_space(system: SystemFile) -> Result:
        '''Compute the space of cubics that belong to A.'''

The parameters of a function are options in `options.VOCABULARY`, optional if they have a default; `system` is the
system of the task. The result is plain data; its entry "verdict" becomes the verdict of the record. The function for a
laboratory task only summarizes the result of a library function, which is called with the options listed:

    @analysis("find-density", "preserve.densities:find_densities", eps=None, effort=1, seed=0)
    def density(search: DensitySearch) -> Result:
        '''Search for densities phi such that the measure dx/phi is invariant.'''

Users register tasks in their own modules: the environment variable KAHANMAPS_TASKS lists the names of these modules,
separated by commas, and each worker process imports them.
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
LIBRARY_MODULES = tuple(f"kahanmaps.experiments.{name}" for name in ("tasks", "laboratory_tasks"))
REPORT = "report"
Result = dict[str, Any]
FullResult = tuple[Result, Any]  # (result, object whose `to_json` returns the full report)
TaskFunction = Callable[..., Result | FullResult]
Summarizer = Callable[[Any], Result]
ARGUMENT_NAMES = {"symbolic": "symbols", "terms": "max_terms"}  # option -> parameter of library functions

# What the system of a task has to be: any system, a member of the family, or a member unless the option other is given.
SYSTEM, MEMBER, MEMBER_OR_OTHER = "system", "member", "member or other"


@dataclass(frozen=True)
class TaskKind:
    """A kind of task: options with defaults, the kind of system it needs (None: no system), whether it `reports`."""

    name: str
    summary: str
    function: TaskFunction
    options: Mapping[str, Option]
    defaults: Mapping[str, Any]
    needs: str | None
    reports: bool = False

    @property
    def required(self) -> tuple[str, ...]:
        """The names of the options without a default."""
        return tuple(name for name in self.options if name not in self.defaults)

    def perform(self, system: Any, options: Mapping[str, Any]) -> Result:
        """Perform the task and return its result; `options` are canonical, except that `other` is a second system."""
        options = dict(options)
        is_report_requested = self.reports and options.pop(REPORT, False)
        arguments = {
            name: value if value is None or name == OTHER else self.options[name].make(value)
            for name, value in options.items()
        }
        if "eps" in self.required and arguments.get("eps") is None:  # a map without eps: any value will do
            arguments["eps"] = self.options["eps"].make("1")
        result = self.function(**arguments) if self.needs is None else self.function(system, **arguments)
        if isinstance(result, tuple):
            result, report = result
            result |= {REPORT: report.to_json()} if is_report_requested else {}
        return result


def fields(result: Any, *names: str) -> Result:
    """Return a dict from `names` to the attributes of `result` with these names."""
    return {name: getattr(result, name) for name in names}


_KINDS: dict[str, TaskKind] = {}


def task(
    name: str, needs: str = SYSTEM, *, options: Mapping[str, Any] | None = None, reports: bool = False
) -> Callable[[TaskFunction], TaskFunction]:
    """Return a decorator that registers a kind of task. Raises TypeError for a parameter that is not an option.

    `options`, with defaults, replace the signature of a function with arbitrary keywords. If `reports`, the function
    returns a pair (result, full report), and the option "report" of the task stores the report.
    """

    def register(function: TaskFunction) -> TaskFunction:
        names, defaults, takes_system = list(options or ()), dict(options or {}), True
        if options is None:
            parameters = dict(inspect.signature(function).parameters)
            takes_system = parameters.pop("system", None) is not None
            names = list(parameters)
            defaults = {
                key: parameter.default
                for key, parameter in parameters.items()
                if parameter.default is not parameter.empty
            }
        unknown = [key for key in names if key not in VOCABULARY]
        if unknown:
            raise TypeError(f"task {name}: {unknown[0]} is not an option{suggestion(unknown[0], list(VOCABULARY))}")
        # A module that is imported twice registers the same function, with equal code, twice.
        if name in _KINDS and _KINDS[name].function.__code__ != function.__code__:
            raise TypeError(f"there are two tasks with the name {name}")
        if reports:
            names, defaults[REPORT] = [*names, REPORT], False
        task_options = {key: VOCABULARY[key] for key in names}
        summary = (inspect.getdoc(function) or "").partition("\n")[0]
        needs_system = needs if takes_system else None
        _KINDS[name] = TaskKind(name, summary, function, task_options, defaults, needs_system, reports)
        return function

    return register


def analysis(
    name: str, function: str, of: str = "", renamed: Mapping[str, str] = ARGUMENT_NAMES, **defaults: Any
) -> Callable[[Summarizer], Summarizer]:
    """Return a decorator that registers a function of the laboratory, given as "module:name", as a kind of task.

    It is called with the system file (or its attribute `of`) and the options; `renamed` maps options to parameter
    names. The `defaults` are stated here rather than in the library, since they enter the keys of tasks.
    """

    def register(summarize: Summarizer) -> Summarizer:
        def perform(system: Any, **options: Any) -> FullResult:
            module, _, attribute = function.partition(":")
            argument = getattr(system, of) if of else system
            arguments = {renamed.get(key, key): value for key, value in options.items() if value is not None}
            result = getattr(import_module(f"kahanmaps.laboratory.{module}"), attribute)(argument, **arguments)
            return summarize(result), result

        perform.__doc__, perform.__module__ = summarize.__doc__, summarize.__module__
        task(name, options=defaults, reports=True)(perform)
        return summarize

    return register


def task_kinds() -> Mapping[str, TaskKind]:
    """Return a dict from names to kinds of tasks, including those that users registered (KAHANMAPS_TASKS)."""
    for library_module in LIBRARY_MODULES:
        import_module(library_module)
    for module in filter(None, map(str.strip, os.environ.get(ENVIRONMENT, "").split(","))):
        try:
            import_module(module)
        except Exception as error:  # importing a module of a user may raise any exception
            reason = f"{type(error).__name__}: {error}"
            raise InputError(f"{ENVIRONMENT} names the module {module}, which cannot be imported: {reason}") from error
    return _KINDS


def task_kind(name: str) -> TaskKind:
    """Return the kind of task with this name. Raises InputError if there is none."""
    kinds = task_kinds()
    if name not in kinds:
        raise InputError(
            f"there is no task {quoted(name)}, expected one of {', '.join(kinds)}{suggestion(name, list(kinds))}"
        )
    return kinds[name]
