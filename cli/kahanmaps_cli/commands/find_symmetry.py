"""kahanmaps find-symmetry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.options import load_system, output_options, seconds_option, system_options
from kahanmaps_cli.progress import Progress, say
from kahanmaps_cli.render import print_json
from kahanmaps_cli.terminal import tell

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.laboratory.symmetry.symmetries import Symmetries

_SHOWN = 40


@click.command("find-symmetry")
@system_options
@seconds_option(30, "Stop about then, and say what is open.")
@output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Affine symmetries T Phi T^-1 = Phi and reversing symmetries T Phi T^-1 = Phi^-1 of the map of SYSTEM.

    \b
      kahanmaps find-symmetry euler_top
      kahanmaps find-symmetry three_wave
      kahanmaps find-symmetry --vars x,y --rhs 'x*(1 - y)' --rhs 'y*(x - 1)'
      kahanmaps find-symmetry lorenz --json | jq .group

    Kahan's map goes along with affine changes of variables: T(x) = S x + r is a symmetry, for every eps, exactly where
    f(T(x)) = S f(x), and a reversing one where f(T(x)) = -S f(x). So everything that is told is proved.

    Searched are one-parameter groups and a scaling; signed permutations, with a translation (dimension at most 12); in
    dimension at most 3 all rational matrices, unless there are one-parameter groups of them. -I reverses every
    homogeneous quadratic system: this and the identity are told as obvious.

    Exit status: 0 searched as said, 2 wrong use, 3 a search was too large or the time over.
    """
    from kahanmaps.checks.settings import Settings
    from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries

    file = load_system(system, options)
    with Progress(quiet) as progress:
        found = linear_symmetries(file.system, seconds=options["seconds"], progress=progress)
    if as_json:
        context = Settings().context([file], seconds=options["seconds"])
        print_json({"command": "find-symmetry", **context, **found.to_json()})
    else:
        _print(file, found)
    if not quiet:
        for sentence in found.undecided:
            say(f"undecided: {sentence}")
    return 0 if found.complete else 3


def _print(file: SystemFile, found: Symmetries) -> None:
    tell(f"# find-symmetry: {file.name}, every eps (the time step is 2 eps); everything here is proved")
    for x in found.infinitesimal:
        kind = "linear" if x.is_linear else "affine"
        tell(f"one-parameter group\t{kind}, the flow of ({', '.join(x.rhs)})")
    if found.scaling is not None:
        rhs = ", ".join(found.scaling.rhs)
        tell(f"scaling\tthe flow of ({rhs}) by t takes the map at eps to that at e^-t eps")
    if found.order is not None:
        forward = sum(not t.reversing for t in found.signed)
        backward = len(found.signed) - forward
        tell(
            f"group\torder {found.order}: {_count(forward, 'symmetry', 'symmetries')} and "
            f"{_count(backward, 'reversing one', 'reversing ones')} among signed permutations"
        )
    for t in found.generators:
        tell(f"generator\t{'reversing ' * t.reversing}{t.text}{_remark(t.obvious)}")
    for name, elements in (("symmetry", found.symmetries), ("reversing", found.reversing)):
        for t in elements[:_SHOWN]:
            tell(f"{name}\t{t.text}{_remark(t.obvious)}")
        if len(elements) > _SHOWN:
            tell(f"{name}\tand {len(elements) - _SHOWN} more (--json has more)")
    for sentence in found.searched:
        tell(f"searched\t{sentence}")
    tell(f"# {'complete: every search came to its end' if found.complete else 'undecided: see standard error'}")


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def _remark(obvious: bool) -> str:
    return "\tobvious" if obvious else ""
