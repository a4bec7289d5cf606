"""Conversion of a system over an algebra K = Q[t]/(chi), with its claims, to a system over Q."""

from __future__ import annotations

from typing import Any

from flint import fmpq_poly

from kahanmaps.algebra.functions import BudgetExceeded
from kahanmaps.algebra.printing import format_polynomial, format_rational_function, format_univariate
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.inline import as_file
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.documents.toml_text import to_toml
from kahanmaps.family.tensor import GENERATOR, inherited_density, inherited_integrals, over_algebra
from kahanmaps.maps.kahan import SystemLike


def tensor_file(system: SystemLike, chi: fmpq_poly) -> SystemFile:
    """Return the file over Q of a system over K = Q[t]/(chi); a parameter t of the system stands for t in K.

    Integrals and density are converted too, unless the results are too large, or the system has a parameter t, on which
    they may depend. `chi` is not constant and may have repeated roots. The result is exact. Raises InputError if the
    file contains no quadratic system.

    >>> from kahanmaps.documents.catalog import load
    >>> result = tensor_file(load("euler_top"), fmpq_poly([-2, 0, 1]))
    >>> result.dim, list(result.integrals)
    (6, ['F1_0', 'F1_1', 'F2_0', 'F2_1'])
    """
    file = as_file(system)
    symbols = [GENERATOR] if GENERATOR in file.parameters else []
    system_over_Q = over_algebra(with_symbols(file, symbols), chi)
    document: dict[str, Any] = {
        "name": f"{file.name} over Q[t]/({format_univariate(chi)})",
        "variables": list(system_over_Q.variables),
        "system": {"rhs": [format_polynomial(polynomial) for polynomial in system_over_Q.rhs]},
    }
    if not symbols:
        try:
            integrals = {
                f"{name}_{k}": format_rational_function(component)
                for name, function in file.integrals.items()
                for k, component in enumerate(inherited_integrals(function, chi))
            }
            if integrals:
                document["integrals"] = integrals
            if file.density is not None:
                document["density"] = {"phi": format_rational_function(inherited_density(file.density, chi))}
        except BudgetExceeded:
            pass
    return parse_system(to_toml(document, ("name", "variables"), tuple(document)[2:]), document["name"])
