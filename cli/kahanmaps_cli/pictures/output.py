"""Options and output shared by the subcommands of `kahanmaps plot`."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import update_wrapper
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps.errors import printable
from kahanmaps_cli.options import stack
from kahanmaps_cli.params import ParameterKind, PointText
from kahanmaps_cli.screen.outputs import OutputFile, deliver
from kahanmaps_cli.screen.progress import SearchProgress, as_typed, print_stderr

if TYPE_CHECKING:
    from matplotlib.figure import Figure


F = TypeVar("F", bound=Callable[..., Any])
_ARGUMENTS = "kahanmaps_cli.arguments"


def _read_size(text: str) -> tuple[float, float | None]:
    """Parse a size WIDTH or WIDTHxHEIGHT, in centimeters."""
    match = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?)(?:x([0-9]+(?:\.[0-9]+)?))?", text.strip(), re.ASCII)
    if match is None:
        raise lib.InputError(f"found {text[:60]!r}, expected WIDTH or WIDTHxHEIGHT in cm, as 12 or 12x9")
    width, height = match.groups()
    return float(width), None if height is None else float(height)


class PictureCommand(click.Command):
    """A command that stores the words of its command line, which become metadata of the picture."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta[_ARGUMENTS] = list(args)
        return super().parse_args(ctx, args)


picture_options: Callable[[F], F] = stack(
    click.option(
        "-o",
        "--output",
        type=OutputFile(),
        required=True,
        metavar="FILE",
        help="Output file: FILE.pdf, FILE.svg or FILE.png; - is standard output (with --format).",
    ),
    click.option(
        "--format", "kind", type=click.Choice(["pdf", "svg", "png"]), help="File format (default: by the extension)."
    ),
    click.option(
        "--size",
        type=ParameterKind("size", _read_size),
        metavar="WxH",
        help="Width, or width x height, in cm (default: width 12).",
    ),
    click.option("--font-size", type=float, metavar="PT", help="Font size in points (default 9)."),
    click.option(
        "--dpi", type=int, metavar="N", help="Dots per inch of PNG files and of rasterized points (default 300)."
    ),
    click.option("--title", help="Title above the picture (default: none)."),
    click.option("-q", "--quiet", is_flag=True, help="Print no progress and no messages on standard error."),
)


@dataclass(frozen=True)
class Drawing:
    """The result of a plot command: the figure, or None if there is nothing to draw.

    The picture stores the system `file`; the `messages` go to standard error, and `status` is the exit status.
    """

    figure: Figure | None
    file: lib.SystemFile | None = None
    messages: Sequence[str] = ()
    status: int = 0


Draw = Callable[[dict[str, Any], SearchProgress], Drawing]


def picture(name: str, *options: Callable[[Any], Any]) -> Callable[[Draw], click.Command]:
    """Make the decorated function the command `kahanmaps plot NAME`, with its own `options` and those of all pictures.

    The function gets a dict of option values, "style" being a `Style`, and the progress; it returns a `Drawing`.
    """

    def decorate(draw: Draw) -> click.Command:
        def command(**options: Any) -> int:
            """Draw the picture, print messages, and write it to its file or to standard output."""
            # Refuse invalid sizes and formats before the computation.
            lib.require_matplotlib()
            style_options = {name: options[name] for name in ("font_size", "dpi") if options[name] is not None}
            if options["size"] is not None:
                style_options["width"], style_options["height"] = options["size"]
            style = options["style"] = lib.Style(**style_options)
            path, is_verbose = options["output"], not options["quiet"]
            kind = lib.format_of(path, options["kind"])
            with SearchProgress(options) as progress:
                drawing = draw(options, progress)
            if is_verbose:
                for sentence in drawing.messages:
                    print_stderr(sentence)
            figure = drawing.figure
            if figure is None:
                return drawing.status
            if options["title"]:
                lib.write_title(figure, printable(options["title"]), style)
            system = "" if drawing.file is None else drawing.file.to_toml()
            with warnings.catch_warnings(record=True) as font_warnings:
                warnings.filterwarnings("always", message="Glyph .* missing", category=UserWarning)
                content = lib.picture_bytes(figure, kind, style, command_line(), system)
            if font_warnings and is_verbose:
                print_stderr("the fonts lack some letters, which are drawn as boxes")
            if deliver(path, content) and is_verbose:
                width, height = figure.get_size_inches() * 2.54
                print_stderr(f"{path}: {width:.1f} x {height:.1f} cm, {len(content)} bytes")
            return drawing.status

        update_wrapper(command, draw)
        return click.command(name, cls=PictureCommand)(stack(*options, picture_options)(command))

    return decorate


def window_option(numbers: str = "X0,X1,Y0,Y1") -> Callable[[F], F]:
    """Return the option --window."""
    return click.option("--window", type=PointText(), metavar=numbers, help="Show only this part of the picture.")


def window_from(options: dict[str, Any], axes: int) -> lib.Window | None:
    """Return the window of --window for a picture with `axes` axes; None if the option is not given."""
    return None if options["window"] is None else lib.require_window(lib.to_floats(options["window"]).tolist(), axes)


def two_variables(option: str, text: str | None, variables: tuple[str, ...]) -> tuple[int, int] | None:
    """Return the indices of the two variables in the value X,Y of an option; None if the option is not given."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or any(name not in variables for name in names):
        raise click.UsageError(
            f"found {option} {text[:60]}, expected two of the variables {', '.join(variables)}, as X,Y"
        )
    if names[0] == names[1] and len(variables) > 1:
        raise click.UsageError(f"found {option} {text[:60]}, expected two different variables")
    return variables.index(names[0]), variables.index(names[1])


def command_line() -> str:
    """Return the command line of the running PictureCommand as it would be typed in a shell."""
    context = click.get_current_context()
    words = context.command_path.split()[1:]  # the first word is the name of the program file, not "kahanmaps"
    return as_typed(["kahanmaps", *words, *context.meta[_ARGUMENTS]])
