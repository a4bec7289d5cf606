"""kahanmaps family new | show | space | associated | tensor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps.errors import InputError, counted, quoted
from kahanmaps_cli import options as opt
from kahanmaps_cli.groups import SuggestingGroup
from kahanmaps_cli.screen.outputs import OutputFile, OutputFolder, file_name, will_write
from kahanmaps_cli.screen.progress import print_stderr
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import abbreviated, print_stdout

F = TypeVar("F", bound=Callable[..., Any])

# The options that determine a random member of the family.
random_member_options: Callable[[F], F] = opt.stack(
    click.option("--m", type=int, metavar="M", help="Half the dimension, 1 to 16 (for verify 1 to 8)."),
    click.option("--eigenvalues", metavar="L1,L2,...", help="Rational eigenvalues of A, m of them."),
    click.option("--generic", is_flag=True, help="Choose chi at random, integer and mostly irreducible over Q."),
    click.option("--chi", metavar="EXPR", help="Polynomial chi, chi(t)^2 = det(t I - A), e.g. '(t-1)*(t^2-2)'."),
    click.option(
        "--size",
        type=int,
        metavar="N",
        help="Bound for the random integers from which H is built (default 1 with --generic or --chi, else 2).",
    ),
)
MEMBER_OPTIONS = ("m", "eigenvalues", "generic", "chi", "size")


@click.group("family", cls=SuggestingGroup)
def command() -> None:
    """Construct and inspect members of the commuting family.

    A member consists of a skew-Hamiltonian matrix A (A^T J = J A) and a cubic H with A Hess(H) = Hess(H) A^T.

    \b
      kahanmaps family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o pair.toml
      kahanmaps family show paper_m3
      kahanmaps family space paper_m3
      kahanmaps family associated paper_m3
      kahanmaps family tensor euler_top --algebra 't^2-2' -o top.toml
    """


@command.command("new")
@random_member_options
@click.option("--signs", metavar="S1,S2,...", help="Write the associated system of signs 1, -1, one a factor of chi.")
@opt.seed_option
@click.option("--name", help="Name of the system in the file.")
@click.option("-o", "--output", type=OutputFile(), metavar="FILE", help="Write to FILE (default: standard output).")
@opt.quiet_option
def new(output: str | None, quiet: bool, signs: str | None, name: str | None, **options: Any) -> None:
    """Write a random member as a system file.

    \b
      kahanmaps family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o pair.toml
      kahanmaps family new --m 3 --generic --seed 7
      kahanmaps family new --chi '(t-1)*(t^2-2)' --seed 1
      kahanmaps family new --m 2 --seed 3 --signs 1,-1 -o g.toml

    Without --eigenvalues, --generic or --chi the eigenvalues are distinct small random integers.
    """
    output = None if output == "-" else output
    if name is not None and not name.isprintable():
        raise click.UsageError(f"found --name {quoted(name)}, expected printable text")
    member = random_member_from(**options)
    if signs is not None:
        pieces = [piece.strip() for piece in signs.split(",")]
        if any(piece not in ("1", "+1", "-1") for piece in pieces):
            raise click.UsageError(f"found --signs {quoted(signs)}, expected 1 and -1 separated by commas")
        member = lib.FamilyMember(member.A, member.H, tuple(int(piece) for piece in pieces))
    file = lib.SystemFile.from_member(member, name or (file_name(Path(output).stem) if output else "member"))
    _write_file(file, output)
    if not quiet:
        where = f"{output}: " if output else ""
        print_stderr(f"{where}dimension {member.dim}; {lib.diagnosis(member.A)}")


def random_member_file(options: dict[str, Any]) -> lib.SystemFile:
    """Return the random member given by the options as a system file; m = 3 unless an option determines m."""
    member_options = {name: options[name] for name in MEMBER_OPTIONS}
    if member_options["m"] is None and member_options["eigenvalues"] is None and member_options["chi"] is None:
        member_options["m"] = 3
    member = random_member_from(**member_options, seed=options["seed"])
    return lib.SystemFile.from_member(member, f"random member, m = {member.m}, seed {options['seed']}")


def random_member_from(
    m: int | None, eigenvalues: str | None, generic: bool, chi: str | None, size: int | None, seed: int
) -> lib.FamilyMember:
    """Return the random member given by the options."""
    if sum((eigenvalues is not None, generic, chi is not None)) > 1:
        raise click.UsageError("give one of --eigenvalues, --generic and --chi")
    if size is not None and not 1 <= size <= 10**6:
        raise click.UsageError(f"found --size {size}, expected 1 to 1000000")
    if eigenvalues is not None:
        values = lib.parse_point(eigenvalues)
        if m is not None and m != len(values):
            raise click.UsageError(f"found {counted(len(values), 'eigenvalue')}, expected m = {m}")
        return lib.random_member_with_eigenvalues(values, seed, size or 2)
    if chi is not None:
        polynomial = lib.parse_chi(chi)
        if m is not None and m != polynomial.degree():
            raise click.UsageError(f"chi has degree {polynomial.degree()}, expected m = {m}")
        return lib.random_member_with_chi(polynomial, seed, size or 1)
    if m is None:
        raise click.UsageError("missing --m M (half the dimension), or --eigenvalues L1,L2,..., or --chi EXPR")
    if generic:
        return lib.random_member(m, seed, size or 1)
    return lib.random_member_with_eigenvalues(lib.random_eigenvalues(m, seed), seed, size or 2)


@command.command("show")
@opt.system_options
@click.option("--normal-form", is_flag=True, help="Also print the normal form, of a cubic h(X, Y) over K = Q[t]/chi.")
@opt.json_option
def show(system: str | None, normal_form: bool, as_json: bool, **options: Any) -> None:
    """Show a member: A, the factors of chi (chi^2 = det(t - A)), and H_0, ..., H_{m-1} with grad H_i = A grad H_{i-1}.

    \b
      kahanmaps family show paper_m3
      kahanmaps family show paper_m3 --normal-form
      kahanmaps family show hamiltonian.toml
      kahanmaps family show paper_m3 --json | jq -r '.hamiltonians[1]'

    For a SYSTEM of kind [hamiltonian] or [system] the command searches for a matrix A with A^T J = J A and A Hess(H) =
    Hess(H) A^T that is not a multiple of I: such an A makes the system a member.
    """
    file = opt.load_system(system, options)
    structure, member = None, file.member
    if member is None:
        hamiltonian = file.hamiltonian or lib.find_cubic_hamiltonian(file.system)
        structure = None if hamiltonian is None else lib.find_family_structure(hamiltonian)
        if structure is None:
            raise lib.InputError(
                f"{file.name} is of kind [{file.kind}], expected one of kind [family]; the search for a matrix A that "
                f"makes it a member found none: {lib.why_not_member(hamiltonian)}"
            )
        member = structure.member
    data: dict[str, Any] = {
        **envelope("family show"),
        "system": file.name,
        "m": member.m,
        "dim": member.dim,
        "variables": list(member.variables),
        "A": lib.plain(member.A),
        "chi": lib.format_univariate(lib.chi(member.A)),
        "factors": [{"factor": str(f), "multiplicity": f.multiplicity} for f in member.factors],
        "generic": member.is_generic,
        "diagnosis": lib.diagnosis(member.A),
        "signs": list(member.signs),
        "hamiltonians": [lib.format_polynomial(H) for H in member.chain],
    }
    if structure is not None:
        data["found"] = lib.attributes(
            structure, "text", "A", "dimension", "T", generic="is_generic", standard="is_standard"
        )
    form = lib.normal_form(member) if normal_form else None
    if form is not None:
        data["normal_form"] = {
            "chi": form.chi_text,
            "h": form.h_text,
            "D": form.D_text,
            "S": lib.plain(form.S),
            "h_in_powers_of_t": [[str(c[k]) for k in range(form.m)] for c in form.coefficients],
            "parts": [lib.attributes(part, "root", "weight", h="text", D="D_text") for part in form.parts],
        }
    if as_json:
        print_json(data)
        return
    print_stdout(f"{file.name}: m = {member.m}, dimension {member.dim}, variables {', '.join(member.variables)}")
    if structure is not None:
        print_stdout(f"found by the search for A: {structure.text}")
    print_stdout(data["diagnosis"])
    if structure is not None and not structure.is_standard:
        print_stdout("x = T y, T =")
        _print_matrix(structure.T)
    print_stdout("A =")
    _print_matrix(member.A)
    for k, text in enumerate(data["hamiltonians"]):
        print_stdout(f"H_{k} = {abbreviated(text)}")
    if any(sign < 0 for sign in member.signs):
        print_stdout(
            f"signs = {','.join(map(str, member.signs))}: K = {abbreviated(lib.format_polynomial(member.chosen.K))}"
        )
    if form is not None:
        print_stdout(f"normal form over Q[t]/chi, chi = {abbreviated(form.chi_text)}:")
        print_stdout("X' = dh/dY, Y' = -dh/dX; X~ = (X + 2 eps X')/(1 + eps^2 D), Y~ = (Y + 2 eps Y')/(1 + eps^2 D)")
        print_stdout(f"h = {abbreviated(form.h_text)}")
        print_stdout(f"D = {abbreviated(form.D_text)}")
        print_stdout(f"the Hamiltonian is the coefficient of t^{form.m - 1} in h")
        if form.parts:
            total = ", the Hamiltonian is the sum of weight * h" if len(form.parts) == form.m else ""
            print_stdout(f"at rational roots of chi, with u = X(t), v = Y(t): u' = dh/dv, v' = -dh/du{total}")
            print_stdout("the Kahan map conserves h/(1 + eps^2 D) at each of them")
        for part in form.parts:
            root, weight = (abbreviated(lib.format_number(number)) for number in (part.root, part.weight))
            print_stdout(f"t = {root}: h = {abbreviated(part.text)}, D = {abbreviated(part.D_text)}, weight {weight}")
        point = "x" if structure is None or structure.is_standard else "y"
        print_stdout(f"{point} = S z with the coefficients z of 1, t, ... in X and in Y, S =")
        _print_matrix(form.S)


@command.command("space")
@opt.system_argument
@opt.parameter_option
@click.option("--matrix", metavar="ROWS", help="The matrix A instead of a SYSTEM, e.g. '1,0;0,1'.")
@opt.json_option
def space(system: str | None, parameters: tuple[tuple[str, str], ...], matrix: str | None, as_json: bool) -> None:
    """Compute the space of cubics H with A Hess(H) = Hess(H) A^T: its dimension (4m for generic A) and a basis.

    \b
      kahanmaps family space paper_m3
      kahanmaps family space --matrix '1,0,0,0; 0,2,0,0; 0,0,1,0; 0,0,0,2'
    """
    if (system is None) == (matrix is None):
        raise click.UsageError("give either a SYSTEM of kind [family] or --matrix ROWS")
    if matrix is not None:
        from flint import fmpq_mat

        rows = [list(lib.parse_point(row)) for row in matrix.split(";")]
        if len(rows) > (max_dimension := lib.MAX_DIMENSION) or any(len(row) != len(rows) for row in rows):
            shape = f"{counted(len(rows), 'row')} of lengths {sorted({len(row) for row in rows})}"
            raise InputError(f"found {shape}, expected a square matrix, at most {max_dimension} x {max_dimension}")
        A, variables = fmpq_mat(rows), None
    else:
        member = _get_member(system, parameters)[1]
        A, variables = member.A, member.variables
    cubics = lib.cubic_space(A, variables)
    data: dict[str, Any] = {
        **envelope("family space"),
        "A": lib.plain(A),
        "dim": A.nrows(),
        "dimension": cubics.dimension,
        "expected_for_generic_A": cubics.expected_dimension,
        "unknowns": cubics.unknown_count,
        "rank": cubics.rank,
        "diagnosis": lib.diagnosis(A),
        "basis": [lib.format_polynomial(H) for H in cubics.basis],
    }
    if as_json:
        print_json(data)
        return
    print_stdout(
        f"dimension {cubics.dimension} (generic A: 4m = {cubics.expected_dimension}); "
        f"the linear system has {cubics.unknown_count} unknowns and rank {cubics.rank}"
    )
    print_stdout(data["diagnosis"])
    for k, text in enumerate(data["basis"], start=1):
        print_stdout(f"{k}\t{abbreviated(text)}")


@command.command("associated")
@opt.system_argument
@opt.parameter_option
@click.option(
    "--write-to", type=OutputFolder(), metavar="DIR", help="Write each associated system as a system file to DIR."
)
@opt.json_option
def associated(
    system: str | None, parameters: tuple[tuple[str, str], ...], write_to: str | None, as_json: bool
) -> None:
    """List all rational associated systems up to sign: signs, B_s in powers of A, K_s with grad K_s = B_s grad H.

    \b
      kahanmaps family associated paper_m3
      kahanmaps family associated paper_m3_irreducible --write-to associated/
      kahanmaps check-commute paper_m3_irreducible \\
          associated/paper_m3_irreducible-p-t.toml

    If a factor g of chi is irreducible of degree 2 or more, the list also contains the associated systems over Q[t]/g
    whose sign at one root t of g differs from all other signs. Their files have the parameter t, with the value
    "root of g". All other associated systems are conjugates of these, or belong to products of their matrices B_s.
    """
    file, member = _get_member(system, parameters)
    files: dict[str, lib.SystemFile] = {}

    def with_file(row: dict[str, Any], suffix: str, make_file: Callable[[str], lib.SystemFile]) -> dict[str, Any]:
        if write_to is None:
            return row
        text = "".join("p" if sign > 0 else "m" for sign in row["signs"])
        path = Path(write_to) / f"{file_name(file.name)}-{text}{suffix}.toml"
        files[str(path)] = make_file(path.stem)
        will_write(str(path))
        return {**row, "file": str(path)}

    rows, conjugate_rows = [], []
    for associate in member.associated():
        row: dict[str, Any] = {
            "label": associate.label,
            "signs": list(associate.signs),
            "B_in_powers_of_A": lib.plain(associate.coefficients),
            "B": lib.plain(associate.B),
            "K": lib.format_polynomial(associate.K),
        }
        associated_member = lib.FamilyMember(member.A, member.H, associate.signs)
        rows.append(with_file(row, "", partial(lib.SystemFile.from_member, associated_member)))
    roots = list(member.roots.values())
    for conjugate in member.conjugate_associates():
        row = {
            "root": str(conjugate.root),
            "symbol": conjugate.name,
            "signs": list(conjugate.signs),
            "B_in_powers_of_A": [lib.format_univariate(c.polynomial, conjugate.name) for c in conjugate.coefficients],
            "K": conjugate.K_text,
        }
        root_number = roots.index(conjugate.root) + 1 if len(roots) > 1 else ""
        make_file = partial(lib.SystemFile.from_conjugate, conjugate)
        conjugate_rows.append(with_file(row, f"-{conjugate.name}{root_number}", make_file))
    if write_to is not None:
        Path(write_to).mkdir(parents=True, exist_ok=True)
    for name, associate_file in files.items():
        _write_file(associate_file, name)
    if as_json:
        print_json(
            {
                **envelope("family associated"),
                "system": file.name,
                "factors": [str(f) for f in member.factors],
                "associated": rows,
                "conjugate": conjugate_rows,
            }
        )
        return
    factors = ", ".join(f"({factor})" for factor in member.factors)
    print_stdout(f"{file.name}: signs belong to the factors {factors}; {len(rows)} associated up to sign, f_0 first")
    for row in rows:
        powers = ", ".join(row["B_in_powers_of_A"])
        print_stdout(f"{row['label']}\tB = [{powers}] in 1, A, A^2, ...\tK = {abbreviated(row['K'])}")
    for row in conjugate_rows:
        signs, powers = "".join("+" if sign > 0 else "-" for sign in row["signs"]), ", ".join(row["B_in_powers_of_A"])
        print_stdout(f"{signs} but at {row['symbol']}, a {row['root']}\tB = [{powers}]\tK = {abbreviated(row['K'])}")


@command.command("tensor")
@opt.system_options
@click.option(
    "--algebra", metavar="CHI", required=True, help="Polynomial chi in t of the algebra K = Q[t]/(chi), e.g. 't^2-2'."
)
@click.option("-o", "--output", type=OutputFile(), metavar="FILE", help="Write to FILE (default: standard output).")
@opt.quiet_option
def tensor(system: str | None, algebra: str, output: str | None, quiet: bool, **options: Any) -> None:
    """Write a quadratic system over the algebra K = Q[t]/(chi) as a system over Q.

    \b
      kahanmaps family tensor euler_top --algebra 't^2-2' -o top.toml
      kahanmaps family tensor nahm_octahedral --algebra 't^3'
      kahanmaps family tensor --vars x,y --rhs 't*x^2' --rhs '-2*x*y' -p t=0 \\
          --algebra 't^2+1'

    A variable x becomes x_0, x_1, ..., for x_0 + x_1 t + ... in K. Roots of chi may be repeated. A parameter t of
    SYSTEM, whatever its value, stands for the generator of K. If chi has degree m, each integral that SYSTEM claims
    gives m integrals of the map over Q, and its density gives a density.
    """
    output = None if output == "-" else output
    algebra_file, chi = opt.load_system(system, {**options, "quiet": quiet}), lib.parse_chi(algebra)
    file = lib.tensor_file(algebra_file, chi)
    _write_file(file, output)
    if not quiet:
        where = f"{output}: " if output else ""
        claimed_count = len(algebra_file.integrals) * int(chi.degree())
        print_stderr(f"{where}dimension {file.dim}; {len(file.integrals)} of {claimed_count} integrals inherited")


def _get_member(system: str | None, parameters: Sequence[tuple[str, str]]) -> tuple[lib.SystemFile, lib.FamilyMember]:
    file = opt.load_system(system, {"parameters": parameters})
    if file.member is None:
        raise lib.InputError(f"{file.name} is of kind [{file.kind}], expected one of kind [family]: A and H")
    return file, file.member


def _write_file(file: lib.SystemFile, output: str | None) -> None:
    text = file.to_toml()
    lib.parse_system(text, f"{file.name}, as it would be written")  # raises InputError if the file would be invalid
    if output is None:
        click.echo(text, nl=False)
        return
    lib.write_atomically(output, text.encode())


def _print_matrix(matrix: Any) -> None:
    rows = [[abbreviated(cell, 24) for cell in row] for row in lib.plain(matrix)]
    widths = [max(len(row[j]) for row in rows) for j in range(len(rows))]
    for row in rows:
        print_stdout("  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)))
