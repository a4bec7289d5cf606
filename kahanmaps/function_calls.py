"""Calls of public functions: messages explain wrong arguments, and notebooks show progress.

`public_function` wraps a function of `import kahanmaps`; its signature, annotations and docstring remain the same, and
arguments are passed on unchanged.
"""

from __future__ import annotations

import inspect
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import copy_context
from functools import wraps
from importlib import import_module
from types import FunctionType, ModuleType
from typing import Any

from kahanmaps.algebra.fields import integer
from kahanmaps.errors import InputError, suggestion
from kahanmaps.hard_stop import TimeLimit

_DELAY_SECONDS, _UPDATE_SECONDS = 2.0, 0.5  # seconds before progress is first shown, and between two updates
_ARGUMENT_HINTS = {
    **dict.fromkeys(("seconds", "timeout"), "with km.time_limit(10): ... is a limit in seconds, effort= one of work"),
    **dict.fromkeys(("dt", "step_size", "stepsize", "tau"), "h= is the time step, eps= half of it"),
    **dict.fromkeys(("t_span", "t_max", "t_end", "tmax", "t1", "t_eval"), "n= is the number of steps of length h="),
    **dict.fromkeys(("params", "args", "parameters"), "km.System(equations, a=2) or km.load(name, a=2)"),
    **dict.fromkeys(("y0", "initial", "init", "ic"), "x0= is the initial point"),
    **dict.fromkeys(("degree", "deg", "order"), "max_degree= is the largest degree to be searched"),
    **dict.fromkeys(("n_steps", "num_steps", "nsteps"), "n= is the number of steps"),
    **dict.fromkeys(("dtype", "float", "floating", "precision"), 'exact=False, or arithmetic="ball:200"'),
    **dict.fromkeys(("modulus", "p", "mod"), 'arithmetic="mod:10007"'),
    **dict.fromkeys(("n_jobs", "jobs", "workers"), "processes= is the number of processes, where there is one"),
    **dict.fromkeys(("random_state", "rng", "random_seed"), "seed= is the random seed"),
    **dict.fromkeys(("n", "N", "terms", "iterates"), "max_terms= is the number of iterates"),
    "to": "language= is the language, for example 'pari'",
    "seed": "settings=km.Settings(seed=3)",
    **dict.fromkeys(("verbose", "quiet"), "progress=print shows the progress"),
    **dict.fromkeys(("integral", "claim", "formula", "density", "tensor"), "extra= is the claim"),
    **dict.fromkeys(("rtol", "atol", "tol"), "h= is the time step, which does not change along an orbit"),
    **dict.fromkeys(("eps", "h", "time_step"), "leave it out: the answer is for every eps"),
    **dict.fromkeys(("ax", "figsize"), "a new picture is drawn, and its axes are returned: ax = km.plot(...)"),
    **dict.fromkeys(
        ("out", "path", "filename", "savefig"),
        'km.plot(...).figure.savefig("a.pdf"), orbit.write("a.csv") and system.save("a.toml") write files',
    ),
    "over": 'km.scan(system, over="a") varies a parameter',
}
_MISSING_HINTS = {  # name of a required argument -> what to type
    "checker": 'checker= is "sympy", "gp" or "rocq"',
    "other": "km.check_commute(system, other)",
    "language": 'km.convert(system, "latex")',
    "over": 'km.scan(system, over="a")',
    "max_degree": "max_degree= is the largest degree to be searched",
}


class CallError(InputError, TypeError):
    """A missing, unknown or superfluous argument of a call; the message lists the arguments of the function."""


def public_function(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """Return the public version of a function: it checks its arguments, and `name` is its public name."""
    signature = inspect.signature(function)
    annotation_of = {parameter.name: str(parameter.annotation) for parameter in signature.parameters.values()}
    takes_options = inspect.Parameter.VAR_KEYWORD in (parameter.kind for parameter in signature.parameters.values())

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            arguments = signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            raise CallError(_wrong_call(name, signature, kwargs, takes_options, error)) from None
        for argument, value in arguments.items():
            if annotation_of[argument].startswith("bool"):  # any other value would count as true or false
                _require_kind(argument, value, annotation_of[argument])
        try:
            # At a Python prompt or in a notebook a user waits for the result.
            is_interactive = threading.current_thread() is threading.main_thread()
            is_interactive = is_interactive and (hasattr(sys, "ps1") or _in_notebook())
            return call_interactively(arguments, args, kwargs) if is_interactive else function(*args, **kwargs)
        except TypeError as error:
            if not isinstance(error, InputError):  # check now what the function did not check
                for argument, value in arguments.items():
                    _require_kind(argument, value, annotation_of[argument])
            raise

    def call_interactively(arguments: dict[str, Any], args: Sequence[Any], kwargs: dict[str, Any]) -> Any:
        results: list[Any] = []
        if "on_result" in annotation_of and "on_result" not in arguments:
            kwargs["on_result"] = results.append
        with _show_progress(name) as progress, _catch_interrupts() as is_interrupted:
            if "progress" not in arguments and annotation_of.get("progress", "").startswith("Callable[[str]"):
                kwargs["progress"] = progress
            try:
                return function(*args, **kwargs)
            except TimeLimit:
                if not is_interrupted():
                    raise
                if not results:
                    raise KeyboardInterrupt from None
                if hasattr(results[-1], "interrupt"):
                    results[-1].interrupt()
                return results[-1]  # its results are those obtained before the interrupt

    # Pickle looks the function up under this name, as an attribute of `kahanmaps`.
    call.__module__, call.__qualname__ = "kahanmaps", name
    return call


class CallableModule(ModuleType):
    """A callable subpackage: `km.systems(...)` and `km.family(...)` call the function `command` of the subpackage."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return public_function(self.command, self.__name__.rpartition(".")[2])(*arguments, **options)

    def __setattr__(self, name: str, value: Any) -> None:
        # Python sets an imported submodule as an attribute; it must not replace a function of the same name.
        if not (isinstance(value, ModuleType) and isinstance(vars(self).get(name), FunctionType)):
            super().__setattr__(name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return import_module, (self.__name__,)


def _wrong_call(
    name: str, signature: inspect.Signature, kwargs: dict[str, Any], takes_options: bool, error: TypeError
) -> str:
    names = [argument for argument in signature.parameters if argument not in ("self", "options")]
    for argument in () if takes_options else kwargs:
        if argument not in names:
            replacement = _ARGUMENT_HINTS.get(argument, "")
            hinted_name = replacement.partition("=")[0]
            is_applicable = bool(replacement) and (not hinted_name.isidentifier() or hinted_name in names)
            hint = f": {replacement}" if is_applicable else suggestion(argument, names)
            return f"km.{name} has no argument {argument}={hint}; it has {', '.join(names)}"
    advice = _MISSING_HINTS.get(str(error).rpartition(": ")[2].strip("'"), "")
    return f"km.{name}: {error}; its arguments are {', '.join(names)}{advice and f': {advice}'}"


def _require_kind(name: str, value: Any, annotation: str) -> None:
    """Raise InputError unless `value` has the kind (int, float, bool, str) that `annotation` requires."""
    kind = annotation.removesuffix(" | None")
    if (value is None and kind != annotation) or kind not in ("int", "bool", "str", "float"):
        return
    if kind == "int":
        integer(value, name)
    elif kind == "float" and not (isinstance(value, int | float) and not isinstance(value, bool)):
        raise InputError(f"found {name} = {value!r}, expected a number")
    elif kind in ("bool", "str") and type(value).__name__ not in (kind, f"{kind}_"):  # numpy's bool_ and str_
        expected = "True or False" if kind == "bool" else "a text"
        raise InputError(f"found {name} = {value!r}, expected {expected}")


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and type(shell).__name__ == "ZMQInteractiveShell"


@contextmanager
def _catch_interrupts() -> Iterator[Callable[[], bool]]:
    """Let Ctrl-C, or the stop button of a notebook, end the search in the block like a time limit: its results remain.

    A second interrupt raises KeyboardInterrupt. An interrupt handler of the caller is not replaced.
    """
    interrupts: list[bool] = []
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield lambda: False
        return

    def stop(*_: Any) -> None:
        interrupts.append(True)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        raise TimeLimit("interrupted")

    signal.signal(signal.SIGINT, stop)
    try:
        yield lambda: bool(interrupts)
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def _show_progress(name: str) -> Iterator[Callable[[str], None]]:
    """Show the latest message below a notebook cell, from two seconds after the start of the block to its end."""
    if not _in_notebook():
        yield lambda _: None
        return
    ipython: Any = import_module("IPython.display")

    messages, is_done = [f"{name} ..."], threading.Event()

    def show() -> None:
        if is_done.wait(_DELAY_SECONDS):
            return
        with suppress(Exception):  # an error of the display must not end the computation
            handle = ipython.display(ipython.HTML(_progress_bar(messages[-1])), display_id=True)
            while not is_done.wait(_UPDATE_SECONDS):
                handle.update(ipython.HTML(_progress_bar(messages[-1])))
            handle.update(ipython.HTML(""))

    thread = threading.Thread(target=copy_context().run, args=(show,), daemon=True)
    thread.start()
    try:
        yield lambda message: messages.__setitem__(0, message)
    finally:
        is_done.set()
        thread.join()


def _progress_bar(message: str) -> str:
    from html import escape

    return f'<progress style="width: 6em"></progress> <span>{escape(message)}</span>'
