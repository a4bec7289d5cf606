"""Hints on what to type in place of a name that does not exist.

`HINTS` contains terms of SciPy, SymPy and diffrax, and names of earlier releases. Any other name is compared with the
existing names.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from kahanmaps.errors import InputError, suggestion

GUIDE = "docs/howto/python.md"

_ORBIT = "km.orbit(system, x0, eps, steps), in floating point with exact=False"
_SYSTEM = 'km.System("x\' = y; y\' = x^2"), km.System({"x": "y", "y": "x^2"}) or km.load("euler_top")'
_INTEGRALS = "km.find_integrals(system), or km.check_integrals(system, formula) for a claim"

# Unknown name -> what to type instead; system, map, orbit and result stand for values of the user.
HINTS = {
    **dict.fromkeys(("parse", "parse_equations", "from_string", "from_sympy", "from_dict", "system", "ode"), _SYSTEM),
    **dict.fromkeys(("ODE", "QuadraticField", "VectorField", "vector_field", "from_text", "from_latex"), _SYSTEM),
    **dict.fromkeys(("solve_ivp", "odeint", "integrate", "solve", "iterate", "simulate", "trajectory"), _ORBIT),
    **dict.fromkeys(("diffeqsolve", "evolve", "flow_map", "Trajectory"), _ORBIT),
    **dict.fromkeys(("kahan", "kahan_map", "discretize", "KahanMapOver", "ComposedMapOver"), 'km.map(system, "1/10")'),
    **dict.fromkeys(("integrals", "first_integrals", "conserved_quantities", "is_integral", "invariants"), _INTEGRALS),
    **dict.fromkeys(("check_integral", "conserved", "find_invariants", "first_integral"), _INTEGRALS),
    **dict.fromkeys(("integrable", "is_integrable", "verdict"), "km.analyze(system).integrable, or .conclusion"),
    **dict.fromkeys(("complexity", "degree_sequence", "growth"), "km.degrees(system)"),
    **dict.fromkeys(("degree", "degree_growth_of"), "km.degrees(system).degrees[1] for the map, .system.degree"),
    **dict.fromkeys(("measure", "density", "find_measure", "volume_form", "find_measures"), "km.find_density(system)"),
    **dict.fromkeys(("poisson", "poisson_structure"), "km.find_poisson(system), or km.check_poisson(system, matrix)"),
    **dict.fromkeys(("commute", "commutes", "commutator", "check_commuting"), "km.check_commute(system, other)"),
    **dict.fromkeys(("symmetries", "symmetry", "reversing_symmetry"), "km.find_symmetry(system)"),
    **dict.fromkeys(("darboux", "darboux_polynomial", "find_darboux"), "km.darboux_polynomials(system, degree)"),
    **dict.fromkeys(("equilibria", "fixed_points", "critical_points", "steady_states"), "km.fixed_points(system)"),
    **dict.fromkeys(("certify", "prove", "proof", "verify_certificate"), 'km.certificate(system, "sympy")'),
    **dict.fromkeys(("modified_hamiltonian", "modified_equation", "backward_error"), "km.modified(system)"),
    **dict.fromkeys(("lyapunov_exponent", "lyapunov_spectrum"), "km.lyapunov(system, x0, eps, steps)"),
    **dict.fromkeys(("drift", "energy_error", "plot_drift", "rk4"), "km.compare(system, x0, eps, steps)"),
    **dict.fromkeys(("plot_orbit", "phase_portrait", "plot_portrait"), "km.portrait(system), or km.orbit(...).plot()"),
    **dict.fromkeys(("list_systems", "examples", "available_systems"), "km.catalogue()"),
    **dict.fromkeys(("singularity_confinement", "confinement"), "km.singularities(system)"),
    **dict.fromkeys(("periods", "find_period", "periodic_orbit"), "km.period(system, x0, eps, prime)"),
    **dict.fromkeys(("reduce", "mod", "modulo"), 'km.orbit(system, x0, eps, steps, arithmetic="mod:10007")'),
    **dict.fromkeys(("y", "points_array", "values_array"), "orbit.x, an array of shape (points, dimension)"),
    **dict.fromkeys(("save_fig", "savefig"), 'orbit.plot().figure.savefig("orbit.pdf")'),
    **dict.fromkeys(("equations", "expr", "as_expr"), "print(system), system.rhs or .to_sympy()"),
    **dict.fromkeys(("simplify", "factor", "expand"), ".to_sympy(), which SymPy can transform"),
    **dict.fromkeys(("sweep", "bifurcation", "parameter_scan"), 'km.scan(system, over="a")'),
    **dict.fromkeys(("inverse", "step"), 'map.at("1/10").inverse or .step(x): at one eps'),
    **dict.fromkeys(("eps", "h", "time_step", "header"), "orbit.header(), which has the system, eps and the time step"),
    "patterns": "singularities.hypersurfaces, each of which has its pattern",
    "phi": 'phi = km.map(system, "1/10")',
    "to_json": "analysis.to_dict() or result.to_dict(): the result that this is a part of has it",
    "entropy": "km.algebraic_entropy(system)",
    "genus": "geometry.planes[0].kind: a smooth plane cubic has genus 1",
    "witness": "report.findings[0].witness",
    "lax": "Lax pairs are not sought; integrals and Poisson tensors are: km.find_integrals, km.find_poisson",
    "substitute": "system.subs({name: value})",
    "ensembles": "km.ensemble(system, x0, eps, steps)",
    "hamiltonian_structure": "km.constant_structures(system)",
    "to_parquet": 'orbit.write("orbit.parquet")',
    # names in earlier releases
    **dict.fromkeys(("GivenTensor",), "km.MatrixPoissonTensor"),
    **dict.fromkeys(("HiddenMember", "RecognisedMember"), "km.FamilyStructure"),
    **dict.fromkeys(("hidden_member", "recognised_member"), "km.find_family_structure(hamiltonian)"),
    **dict.fromkeys(("hidden_member_of", "recognised_member_of"), "km.find_family_structure_of(system)"),
    **dict.fromkeys(("structure_of", "Structure"), "km.tensor_structure(system)"),
    "Jump": "km.NthIterate",
    "Kahan": "km.KahanFamily",
    "BirationalMap": "km.ImplicitMap",
    "Verdict": "km.Certainty",
    "verify_universal": "km.verify(m=2)",
    "draw_orbits": "km.portrait(system)",
    "draw_generic": "km.random_member(m, seed)",
    "draw_with_chi": "km.random_member_with_chi(chi, seed)",
    "draw_with_eigenvalues": "km.random_member_with_eigenvalues(eigenvalues, seed)",
    "plot": "km.plot(value)",
    "f": "km.System(...).f(x)",
    **dict.fromkeys(("numerator", "denominator"), "I.function.numerator and I.function.denominator"),
    "subs": "I(x, eps) for a value, or I.to_sympy().subs({...})",
    "divergence": "system.system.divergence()",
    "status": "orbit.end.status",
    **dict.fromkeys(("success", "is_whole"), "orbit.end.is_complete"),
}


class MissingName(InputError, AttributeError):
    """A name that does not exist; the message suggests an existing one."""


def missing_name(owner: str, name: str, known: Iterable[str]) -> MissingName:
    """Return the error for a missing attribute `name` of `owner`; its message says what to type instead.

    >>> print(missing_name("module 'kahanmaps'", "equilibria", []))
    module 'kahanmaps' has no attribute 'equilibria': type km.fixed_points(system)
    """
    public_names = getattr(sys.modules.get("kahanmaps"), "__all__", ())
    replacement = HINTS.get(name, f"km.{name}(...)" if name in public_names else "")
    hint = (
        f": {'' if replacement[0].isupper() else 'type '}{replacement}"
        if replacement
        else suggestion(name, sorted(known)) or f"; see {GUIDE}"
    )
    return MissingName(f"{owner} has no attribute {name!r}{hint}")


class AttributeHints:
    """Base class of values for which the error for a missing attribute suggests an existing one."""

    __slots__ = ()

    if not TYPE_CHECKING:  # for a type checker, __getattr__ would make every attribute valid

        def __getattr__(self, name: str) -> Any:
            # Python, NumPy, SymPy and IPython look up such names without a request of the user.
            if name[:1] == "_" or (name.startswith("is_") and name not in HINTS):
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            attributes = (attribute for attribute in dir(type(self)) if attribute[0] != "_")
            raise missing_name(f"{type(self).__name__!r} object", name, [*attributes, *getattr(self, "__dict__", ())])
