"""Options that say which member of the family to draw, and the drawing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli.options import stack

F = TypeVar("F", bound=Callable[..., Any])


draw_options: Callable[[F], F] = stack(
    click.option("--m", type=int, metavar="M", help="Half the dimension, 1 to 16 (for verify 1 to 8)."),
    click.option("--eigenvalues", metavar="L1,L2,...", help="Rational eigenvalues of A, m of them."),
    click.option("--generic", is_flag=True, help="A random integer chi, typically irreducible over Q."),
    click.option("--chi", metavar="EXPR", help="chi itself, a polynomial in t: '(t-1)*(t^2-2)'."),
    click.option("--size", type=int, metavar="N", help="Bound for the integer coefficients drawn (default 2 or 1)."),
)
DRAWN = ("m", "eigenvalues", "generic", "chi", "size")


def drawn_file(options: dict[str, Any]) -> lib.SystemFile:
    """The member that the options ask for as a system file; without any of them one with m = 3."""
    drawn = {name: options[name] for name in DRAWN}
    if drawn["m"] is None and drawn["eigenvalues"] is None and drawn["chi"] is None:
        drawn["m"] = 3
    member = draw_member(**drawn, seed=options["seed"])
    return lib.SystemFile.from_member(member, f"random member, m = {member.m}, seed {options['seed']}")


def draw_member(
    m: int | None, eigenvalues: str | None, generic: bool, chi: str | None, size: int | None, seed: int
) -> lib.FamilyMember:
    """The member that the options ask for."""
    if sum((eigenvalues is not None, generic, chi is not None)) > 1:
        raise click.UsageError("give one of --eigenvalues, --generic and --chi")
    if size is not None and not 1 <= size <= 10**6:
        raise click.UsageError(f"found --size {size}, expected 1 to 1000000")
    if eigenvalues is not None:
        values = lib.parse_point(eigenvalues)
        if m is not None and m != len(values):
            raise click.UsageError(f"found {len(values)} eigenvalues, expected m = {m}")
        return lib.draw_with_eigenvalues(values, seed, size or 2)
    if chi is not None:
        polynomial = lib.parse_chi(chi)
        if m is not None and m != polynomial.degree():
            raise click.UsageError(f"chi has degree {polynomial.degree()}, expected m = {m}")
        return lib.draw_with_chi(polynomial, seed, size or 1)
    if m is None:
        raise click.UsageError("missing --m M (half the dimension), or --eigenvalues L1,L2,..., or --chi EXPR")
    if generic:
        return lib.draw_generic(m, seed, size or 1)
    return lib.draw_with_eigenvalues(lib.random_eigenvalues(m, seed), seed, size or 2)
