"""The system itself: Hamiltonian with a constant J, of the commuting family, or one over a larger algebra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq_mat

from kahanmaps.algebra.written.plain import attributes
from kahanmaps.algebra.written.text import format_number, format_polynomial
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.family.tensor import TensorStructure, tensor_structure
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux, under_map
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import (
    MAX_DIMENSION,
    ConstantStructures,
    constant_structures,
)


def hamiltonian(run: Run, **_: Any) -> ConstantStructures | None:
    """A constant J with f = J grad H, in few dimensions."""
    return constant_structures(run.field, seed=run.seed) if run.dim <= MAX_DIMENSION else None


def family(run: Run, **_: Any) -> SystemNormalForm | NoNormalForm:
    """The normal form of a member of the commuting family, in coordinates with the centre as origin."""
    known = run.found.hamiltonian
    if known is None or known.hamiltonian is None:
        return system_normal_form(run.field)
    moved = known.hamiltonian if known.hamiltonian.centre is None else known.hamiltonian.about(known.hamiltonian.centre)
    return system_normal_form(moved.system, moved)


def algebra(run: Run, **_: Any) -> TensorStructure | None:
    """The algebra larger than Q over which it is a system; of a member of the family its normal form says more."""
    return None if isinstance(run.found.normal_form, SystemNormalForm) else tensor_structure(run.field)


def family_json(found: Findings) -> dict[str, Any]:
    """What a member of the family is one by, and what follows: x = centre + T y, J = T [[0, I], [-I, 0]] T^T."""
    member = None
    if isinstance(found.normal_form, SystemNormalForm):
        form = found.normal_form.form
        member = {"chi": form.chi_text, "integrals_in_involution": form.m, "associated_maps": 2 ** (form.m - 1)}
        member |= {**attributes(found.normal_form, "A", "T"), **attributes(found, "centre")}
    return {"family": (found.normal_form.text or None) if found.normal_form is not None else None, "member": member}


def algebra_json(found: Findings) -> dict[str, Any]:
    """C and its minimal polynomial."""
    known = found.tensor
    return {"algebra": None if known is None else attributes(known, "text", "C", "rank", chi="chi_text")}


def statements(found: Findings) -> list[Statement]:
    """H, invariant hyperplanes, the commuting family and the normal form."""
    lines = []
    structures = found.hamiltonian
    if structures is not None and structures.hamiltonian is not None:
        H = format_polynomial(structures.hamiltonian.H)
        kind = "the standard J" if structures.hamiltonian.is_standard else "a constant skew J"
        lines.append(Statement(Known.PROVED, f"Hamiltonian with {kind}, H = {H}"))
    elif structures is not None and structures.proved:
        lines.append(Statement(Known.PROVED, f"not Hamiltonian with a constant J: {structures.reason}"))
    lines += _hyperplanes(found)
    if found.normal_form is not None and found.normal_form.text:
        text = f"belongs to the commuting family: {found.normal_form.text}{_coordinates(found, found.normal_form.T)}"
        lines.append(Statement(Known.PROVED, text))
    if found.tensor is not None:
        text = "" if found.defect else ": the map is that over K, and inherits what it has (docs/beyond.md)"
        lines.append(Statement(Known.PROVED, f"{found.tensor.text}{text}"))
    if isinstance(found.normal_form, SystemNormalForm):
        form = found.normal_form.form
        lines.append(
            Statement(
                Known.PROVED,
                f"normal form: the planar map of h(X, Y) = {form.h_text} over Q[t]/({form.chi_text}), "
                "a block for each root t",
            )
        )
    return lines


def _hyperplanes(found: Findings) -> list[Statement]:
    """Those that the flow keeps, by what becomes of them under the map at the eps in force."""
    if not found.file.is_quadratic:
        return []
    system, eps = found.file.system, found.eps
    fates: dict[str, list[str]] = {}
    for one in affine_darboux(system).functions:
        fate = "not birational" if found.defect else "invariant"
        if eps is not None and not found.defect:
            fate = under_map(system, one.function, eps)
        fates.setdefault(fate, []).append(f"{format_polynomial(one.function)} = 0")
    kind = {1: "point", 2: "line", 3: "plane"}.get(found.dim, "hyperplane")
    lines = []
    for fate, planes in fates.items():
        are, it = f"the {kind} {planes[0]} is", "it"
        if len(planes) > 1:
            are, it = f"the {kind}s {_enumerated(planes)} are", "them"
        of_map = {
            "invariant": ", for flow and map",
            "contracted": f" for the flow; at eps = {eps} the map contracts {it}: det(I + eps f'(x)) is 0 there",
            "undefined": f" for the flow; at eps = {eps} the map has no value on {it}: det(I - eps f'(x)) is 0 there",
            "undecided": f" for the flow; what the map makes of {it} at eps = {eps} would take too long to decide",
            "not birational": " for the flow",
        }
        lines.append(Statement(Known.PROVED, f"{are} invariant{of_map[fate]}"))
    return lines


def _enumerated(texts: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))


def _coordinates(found: Findings, T: fmpq_mat | None) -> str:
    """In which coordinates the system is a member of the family, x = centre + T y; empty where these are its own."""
    centre = f"({', '.join(map(format_number, found.centre))})" if found.centre and any(found.centre) else ""
    if T is None and not centre:
        return ""
    return f", in coordinates y with x = {' + '.join(filter(None, [centre, 'y' if T is None else 'T y']))}"
