"""What all commands below `kahanmaps plot` share: where the picture goes, how large it is, how it can be remade."""

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
from kahanmaps_cli.screen.progress import SearchProgress, as_typed, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure


F = TypeVar("F", bound=Callable[..., Any])
_ARGUMENTS = "kahanmaps_cli.arguments"


def _read_size(text: str) -> tuple[float, float | None]:
    """WIDTH or WIDTHxHEIGHT in centimetres."""
    match = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?)(?:x([0-9]+(?:\.[0-9]+)?))?", text.strip(), re.ASCII)
    if match is None:
        raise lib.InputError(f"found {text[:60]!r}, expected WIDTH or WIDTHxHEIGHT in cm, as 12 or 12x9")
    width, height = match.groups()
    return float(width), None if height is None else float(height)


class PictureCommand(click.Command):
    """A command that remembers the words it was called with: they stand in the metadata of the picture."""

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
        help="FILE.pdf, FILE.svg or FILE.png; - with --format is standard output.",
    ),
    click.option("--format", "kind", type=click.Choice(["pdf", "svg", "png"]), help="Instead of by the ending."),
    click.option(
        "--size",
        type=ParameterKind("size", _read_size),
        metavar="WxH",
        help="Width, or width x height, in cm (default 12 wide).",
    ),
    click.option("--font-size", type=float, metavar="PT", help="Size of the letters in points (default 9)."),
    click.option("--dpi", type=int, metavar="N", help="Dots per inch of PNG and of clouds of points (default 300)."),
    click.option("--title", help="A title above the picture (default: none)."),
    click.option("-q", "--quiet", is_flag=True, help="No progress or messages on standard error."),
)


@dataclass(frozen=True)
class Drawn:
    """A picture for `picture` to deliver; None where nothing was found that could be drawn.

    `file` is the system for its metadata, `talk` are sentences for standard error, `status` is the exit status.
    """

    figure: Figure | None
    file: lib.SystemFile | None = None
    talk: Sequence[str] = ()
    status: int = 0


Draw = Callable[[dict[str, Any], SearchProgress], Drawn]


def picture(name: str, *options: Callable[[Any], Any]) -> Callable[[Draw], click.Command]:
    """A command `kahanmaps plot NAME` with these options and those of all pictures, from what draws by their values.

    What draws finds the `Style` that is asked for in its options, as "style".
    """

    def made(draw: Draw) -> click.Command:
        def command(**options: Any) -> int:
            """Draw, talk, and write the picture to its file or to standard output."""
            # Sizes and formats that are none are refused before anything is computed.
            lib.require_matplotlib()
            given = {name: options[name] for name in ("font_size", "dpi") if options[name] is not None}
            if options["size"] is not None:
                given["width"], given["height"] = options["size"]
            style = options["style"] = lib.Style(**given)
            path, talks = options["output"], not options["quiet"]
            kind = lib.format_of(path, options["kind"])
            with SearchProgress(options) as progress:
                drawn = draw(options, progress)
            if talks:
                for sentence in drawn.talk:
                    say(sentence)
            figure = drawn.figure
            if figure is None:
                return drawn.status
            if options["title"]:
                lib.write_title(figure, printable(options["title"]), style)
            system = "" if drawn.file is None else drawn.file.to_toml()
            with warnings.catch_warnings(record=True) as found:
                warnings.filterwarnings("always", message="Glyph .* missing", category=UserWarning)
                content = lib.picture_bytes(figure, kind, style, command_line(), system)
            if found and talks:
                say("the fonts lack some letters of the texts: they are drawn as boxes")
            if deliver(path, content) and talks:
                width, height = figure.get_size_inches() * 2.54
                say(f"{path}: {width:.1f} x {height:.1f} cm, {len(content)} bytes")
            return drawn.status

        update_wrapper(command, draw)
        return click.command(name, cls=PictureCommand)(stack(*options, picture_options)(command))

    return made


def window_option(numbers: str = "X0,X1,Y0,Y1") -> Callable[[F], F]:
    """The option --window."""
    return click.option("--window", type=PointText(), metavar=numbers, help="The part that is shown.")


def window_from(options: dict[str, Any], axes: int) -> lib.Window | None:
    """The window that --window asks for, in so many axes."""
    return None if options["window"] is None else lib.require_window(lib.to_floats(options["window"]).tolist(), axes)


def two_variables(option: str, text: str | None, variables: tuple[str, ...]) -> tuple[int, int] | None:
    """The numbers of two variables that the text X,Y of an option names; None for none."""
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
    """The command that is running, as one would type it; it has to be a PictureCommand."""
    context = click.get_current_context()
    words = context.command_path.split()[1:]  # the first one is the program, whatever it was called
    return as_typed(["kahanmaps", *words, *context.meta[_ARGUMENTS]])
