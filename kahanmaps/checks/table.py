"""The table of all checks; an entry has the question, the option and the function of a check.

The commands check-..., the tasks of experiments, the pages of reports and the schemas are derived from this table. The
function of a check is imported only when the check runs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kahanmaps.checks.claims import Report
    from kahanmaps.documents.files import SystemFile


@dataclass(frozen=True)
class ClaimOption:
    """The command-line option for a claim; `read` converts its text to the argument `extra` of the check.

    If `many`, the option may be repeated, as EXPR or NAME=EXPR, and `extra` maps names to texts. The word "known"
    stands for the claims that are checked by default.
    """

    flag: str
    metavar: str
    help: str
    read: Callable[[SystemFile, str], Any] = lambda file, text: text
    many: bool = False


@dataclass(frozen=True)
class Check:
    """A check. `question` is shown in lists, `headline` and `text` in the help of its command.

    `function` is "module:name" of a function (file, settings, extra) -> Report, for two systems (file, other, settings,
    eps2). `examples` are arguments of "kahanmaps check-NAME". `outcome` says what exit status 0 means.
    """

    name: str
    function: str
    question: str
    headline: str
    examples: tuple[str, ...]
    text: str
    outcome: str
    claim: ClaimOption | None = None
    is_of_pair: bool = False
    for_batch: str = ""  # the question in experiments, where the user cannot give a claim

    @property
    def command(self) -> str:
        """The name of the command of this check, which is also the name of its task in experiments."""
        return f"check-{self.name}"

    def __call__(self, *arguments: Any, **options: Any) -> Report:
        """Run the check and return its report. Raises InputError if the check does not apply to the system."""
        module, _, name = self.function.partition(":")
        report: Report = getattr(import_module(module), name)(*arguments, **options)
        return report


_CHECKS = [
    Check(
        "commute",
        "kahanmaps.checks.commute:check_commute",
        "Do two Kahan maps commute?",
        "Do the maps of SYSTEM and OTHER commute?",
        (
            "paper_m3        # its associated maps, pairwise",
            "f.toml g.toml --eps 1/10",
            "f.toml g.toml --eps 1/10 --eps2 1/7",
            "--vars x,y --rhs y --rhs=-x harmonic",
            "paper_m2 --json | jq .verdict",
            "f.toml g.toml --start 1,1/2 --eps 1/10 --steps 1000 \\\n--arithmetic float",
        ),
        """
        Without --eps the maps are compared for every eps.

        For a single SYSTEM of kind [family], the maps of H_0 and H_1 with grad H_1 = A grad H_0 serve as a control:
        they are expected NOT to commute, and this does not affect the exit status.

        SYSTEM and OTHER are files, names of the catalogue, - for standard input, or equations: "x' = y; y' = -x". -p
        sets a parameter of both systems, or of the system that has it. The first system on the command line is called
        f, the second g; one of them may be given by --rhs.

        --arithmetic float measures the size of Phi_g(Phi_f^n(x)) - Phi_f^n(Phi_g(x)) along a float orbit, and its order
        in eps; the verdict and the exit status are those of the exact check, which is run as well.
        """,
        "they commute",
        is_of_pair=True,
        for_batch="Do two Kahan maps commute, or all rational associated maps of a member of the family?",
    ),
    Check(
        "integrals",
        "kahanmaps.checks.conserve:check_integrals",
        "Are the known or claimed integrals conserved?",
        "Are the integrals of SYSTEM conserved by its map?",
        (
            "paper_m3",
            "euler_top -p a1=1 -p a2=2 -p a3=-3",
            "my.toml --eps 1/10 \\\n--integral 'I1=(x^2+y^2)/(1-eps^2*z^2)'",
            "--vars x,y --rhs y --rhs=-x --integral x^2+y^2",
        ),
        """
        Without --eps the integrals are checked for every eps.

        A Hamiltonian system has a known integral, the modified H, and its multiple H~ = x^T J x~/eps for homogeneous H
        and standard J; a member of the family has the integrals of all rational associated systems. The section
        [integrals] claims further integrals. By default all these integrals are checked, with --integral only the given
        ones.
        """,
        "conserved",
        ClaimOption(
            "--integral",
            "[NAME=]EXPR",
            "An integral to check: a rational function of x, its images x~, x~~ and eps; the name of an integral of "
            "the file; or the word 'known': all known and claimed integrals.",
            many=True,
        ),
    ),
    Check(
        "measure",
        "kahanmaps.checks.preserve:check_measure",
        "Is the measure dx/phi invariant?",
        "Is the measure dx/phi invariant under the map of SYSTEM?",
        ("paper_m3", "lotka_volterra --eps 1/10", "--vars x,y --rhs 'x*(1-y)' --rhs 'y*(x-1)' \\\n--density x*y"),
        """
        Without --eps the measure is checked for every eps. By default two functions phi are checked:
        det(I - eps f'(x)) if the system is Hamiltonian, and the [density] of the file if there is one. --density gives
        another phi instead.
        """,
        "invariant",
        ClaimOption("--density", "EXPR", "A claimed density phi: a rational function of the variables and eps."),
    ),
    Check(
        "poisson",
        "kahanmaps.checks.preserve:check_poisson",
        "Is J - eps^2 f'(x)^2 J, or a given tensor, invariant?",
        "Is Pi(x) = J - eps^2 f'(x)^2 J, or the tensor P of a file, a Poisson tensor that the map of SYSTEM preserves?",
        ("paper_m3", "henon_heiles    # Pi is not invariant here", "lotka_volterra --tensor p.toml"),
        """
        The transformation law dPhi P(x) dPhi^T = P(x~) and the Jacobi identity are both checked. Without --eps they are
        checked for every eps. Without --tensor P is Pi, and the system has to be Hamiltonian.
        """,
        "it is",
        ClaimOption(
            "--tensor",
            "FILE",
            "A claimed tensor P: a section [poisson] with rows of functions, as find-poisson --toml prints it.",
            lambda file, path: import_module("kahanmaps.invariants.poisson").MatrixPoissonTensor.read(
                path, file.variables, file.parameters
            ),
        ),
        for_batch="Is the Poisson tensor J - eps^2 f'(x)^2 J invariant?",
    ),
]

CHECKS = {check.command: check for check in _CHECKS}
