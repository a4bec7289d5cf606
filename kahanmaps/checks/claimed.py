"""Claims as one writes them, formulas as text or of SymPy, as the functions and tensors that are checked."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import Any

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.expressions import formula_text
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.iterates import parse_with_iterates
from kahanmaps.errors import InputError
from kahanmaps.invariants.poisson import GivenTensor


def settings_and_claim(
    settings: Settings | Any, extra: Any, eps: Any = None, time_step: Any = None
) -> tuple[Settings, Any]:
    """The two in this order, at an eps or time step if one is given: a claim may stand in the place of the settings."""
    if settings is None or isinstance(settings, Settings):
        return Settings.of(settings, eps, time_step), extra
    if extra is not None:
        raise InputError(f"found claims as second and as third argument, expected Settings, not {settings!r}")
    return Settings.of(None, eps, time_step), settings


def claimed_function(file: SystemFile, claim: Any) -> RationalFunction:
    """A formula in the variables of a file, its parameters and eps, as a function of the variables and eps.

    With x~ in it, it is one of the variables, their iterates and eps. The name of an integral of the file stands for
    it.
    """
    if isinstance(claim, RationalFunction):
        return claim
    of_file, names = {**file.integrals, **file.integrals_in_iterates}, file.claim_names
    if isinstance(claim, str) and claim in of_file and claim not in names:
        return of_file[claim]
    return parse_with_iterates(formula_text(claim), names[: file.dim], names[file.dim :], file.parameters)


def claimed_functions(file: SystemFile, claims: Any) -> dict[str, RationalFunction]:
    """Formulas by name; those of a list, and a single one, are called I1, I2, ..., as far as these names are free."""
    if claims is None:
        return {}
    if not isinstance(claims, Mapping):
        unnamed = claims if isinstance(claims, list | tuple) else [claims]
        of_file = {**file.integrals, **file.integrals_in_iterates}
        free = (f"I{k}" for k in count(1) if f"I{k}" not in of_file)
        claims = {c if isinstance(c, str) and c in of_file else next(free): c for c in unnamed}
    if not claims:
        raise InputError("found no integral, expected at least one, or None for those of theorems and of the file")
    return {name: claimed_function(file, claim) for name, claim in claims.items()}


def claimed_tensor(file: SystemFile, claim: Any) -> GivenTensor | None:
    """A matrix of formulas as a tensor. Raises InputError for what is none, and for one that is not skew."""
    if claim is None or isinstance(claim, GivenTensor):
        return claim
    rows = claim.tolist() if hasattr(claim, "tolist") else claim
    if not isinstance(rows, list | tuple) or not all(isinstance(row, list | tuple) for row in rows):
        raise InputError(f"found {claim!r}, expected a matrix of formulas: [['0', 'x*y'], ['-x*y', '0']]")
    return GivenTensor([[claimed_function(file, entry) for entry in row] for row in rows])
