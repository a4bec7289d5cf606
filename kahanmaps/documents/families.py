"""Families of systems in the catalogue; a member such as `lv(7,3)` is given by arguments and generated on demand.

The Bogoyavlenskij-Itoh systems LV(n, k) are Lotka-Volterra systems:

    x_i' = x_i sum_j a_ij x_j,    a_ij = -a_ji,    a_ij = 1 for 0 < j - i < n - k and -1 for j - i >= n - k,

with 2k + 1 <= n. For n = 2k + 1 the species form a circle, in which each species preys on the next k. For larger n the
species k + 1, ..., n - k have equal interactions with all other species. Their sum replaces them and reduces LV(n, k)
to LV(2k + 1, k). The Kahan map moves all partial sums of these species by the same Moebius map, so that cross-ratios
are integrals (proofs: docs/mathematics.md). Sources: itoh-1987, bogoyavlenskij-1988, damianou-2017.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

from kahanmaps.errors import InputError, quoted

_MEMBER_NAME = re.compile(r"(\w+)(?:\((.*)\))?")
_INTEGER = re.compile(r"-?[0-9]{1,6}")
MAX_SPECIES = 40  # maximal n of LV(n, k): the size of documents grows like n^2
_DEGREE_COUNT = 4  # number of degrees d_1, d_2, ... of iterates that a document states


class NamedFamily(NamedTuple):
    """A family of systems: notation of members, an example, a title, and the function that makes documents."""

    form: str
    example: str
    title: str
    document: Callable[..., dict[str, Any]]


def degree(n: int, k: int, m: int) -> int:
    """Return the degree of the m-th iterate of the Kahan map of LV(n, k) by a formula that is measured, not proved.

    >>> [degree(5, 2, m) for m in range(5)]
    [1, 5, 21, 45, 81]
    """
    if m % 2 == 0:
        return n * k * m * m // 2 + (n - 2 * k - 1) * m + 1
    return n * k * (m * m - 1) // 2 + (n - 2 * k - 1) * (m - 1) + n


def lotka_volterra(n: int, k: int) -> dict[str, Any]:
    """Return the document of LV(n, k).

    Args:
        n: the number of species, at least 2.
        k: an integer of at least 0 and at most (n - 1)/2.

    Returns:
        Plain data in the format of a system file, with integrals of few terms.

    Raises:
        InputError: for any other n or k.

    Source: damianou-2017, kouloukas-quispel-vanhaecke-2016.

    >>> lotka_volterra(3, 1)["system"]["rhs"]
    ['x1*(x2 - x3)', 'x2*(x3 - x1)', 'x3*(x1 - x2)']
    """
    if not (2 <= n <= MAX_SPECIES and 0 <= k and 2 * k + 1 <= n):
        raise InputError(f"found lv({n},{k}), expected lv(n,k) with 2 <= n <= {MAX_SPECIES}, 0 <= k and 2k + 1 <= n")
    x = [f"x{i + 1}" for i in range(n)]
    middle_species = x[k : n - k]
    middle_sum = " + ".join(middle_species)
    integrals = {"I1": " + ".join(x)}
    for a in range(2, len(middle_species)):
        denominator = f"({' + '.join(middle_species[:a])})*({' + '.join(middle_species[a - 1 :])})"
        integrals[f"I{len(integrals) + 1}"] = f"{middle_species[a - 1]}*({middle_sum})/({denominator})"
    if k == 1:
        first, last = x[0], x[-1]
        mixed_terms = f"2*{first}*({middle_sum}) - 2*({middle_sum})*{last} - 2*{first}*{last}"
        det = f"1 - eps^2*({first}^2 + ({middle_sum})^2 + {last}^2 - {mixed_terms})"
        integrals[f"I{len(integrals) + 1}"] = f"{first}*({middle_sum})*{last}/({det})"
    rows = []
    for i in range(n):  # sum_j a_ij x_j, positive terms first
        signs = {j: (1 if abs(j - i) < n - k else -1) * (1 if j > i else -1) for j in range(n) if j != i}
        terms = [f"{'+' if signs[j] > 0 else '-'} x{j + 1}" for j in sorted(signs, key=lambda j: -signs[j])]
        text = " ".join(terms)
        rows.append(text.removeprefix("+ ") if text.startswith("+ ") else f"-{text.removeprefix('- ')}")
    ratio_count, is_full = n - 2 * k - 2, n == 2 * k + 1
    # Known statements about the flow and the map, each with a status.
    facts = [
        "Classical: the flow is integrable, by k + 1 integrals for n = 2k + 1 and in general by those of LV(2k + 1, k) "
        "and cross-ratios.",
        "Proved: dx/(x1 ... xn) is invariant, as for every Lotka-Volterra system with a skew matrix "
        "(docs/mathematics.md).",
        "Proved: the sum of all x_i is conserved, as every affine integral of the flow is.",
    ]
    if ratio_count > 0:
        facts.append(
            f"Proved: I2, ..., I{ratio_count + 1} are cross-ratios of x{k + 1}, x{k + 1} + x{k + 2}, ..., conserved."
        )
    if k:
        where = "" if is_full else f" of LV({2 * k + 1},{k}), to which the map projects,"
        facts.append(
            f"Proved: the product of the variables{where} divided by det(I - eps f'), and the modified Hamiltonian of "
            "a cubic H are conserved."
        )
    if k > 1:
        facts.append(
            "Measured: for k = 2 and 3 LV(2k + 1, k) has k + 1 independent integrals P/det(I - eps f'), P of degree "
            "2k + 1."
        )
    facts.append("Measured: for all n up to 7 the degrees of the iterates have a formula in n, k and m.")
    return {
        "variables": x,
        "catalog": {
            "title": f"Bogoyavlenskij-Itoh system LV({n},{k})",
            "sources": ["itoh-1987", "bogoyavlenskij-1988", "damianou-2017", "kouloukas-quispel-vanhaecke-2016"],
            "convention": "the sources treat the flow, the last one with a Kahan map of time step 2 eps",
            "facts": facts,
            "degrees": [degree(n, k, m) for m in range(1, _DEGREE_COUNT + 1)],
            "growth": "quadratic" if k else "linear",
        },
        "system": {"rhs": [f"{x[i]}*({row})" for i, row in enumerate(rows)]},
        "integrals": integrals,
        "density": {"phi": "*".join(x)},
    }


FAMILIES = {"lv": NamedFamily("lv(n,k)", "lv(7,3)", "Bogoyavlenskij-Itoh systems, 2k + 1 <= n", lotka_volterra)}


def family_member(reference: str) -> tuple[str, dict[str, Any]] | None:
    """Return the name without spaces and the document of the member `reference` of a family; None for other names.

    Raises InputError for missing arguments, and for arguments for which the family has no member.

    >>> family_member("lv(3, 1)")[0]
    'lv(3,1)'
    >>> family_member("lorenz")
    >>> family_member("lv(7)")
    Traceback (most recent call last):
        ...
    kahanmaps.errors.InputError: found 'lv(7)', expected lv(n,k) with integers, e.g. lv(7,3)
    """
    match = _MEMBER_NAME.fullmatch("".join(reference.split()))
    if match is None or match[1] not in FAMILIES:
        return None
    family = FAMILIES[match[1]]
    arguments = (match[2] or "").split(",")
    if len(arguments) != family.form.count(",") + 1 or not all(map(_INTEGER.fullmatch, arguments)):
        raise InputError(f"found {quoted(reference)}, expected {family.form} with integers, e.g. {family.example}")
    values = [int(text) for text in arguments]
    return f"{match[1]}({','.join(map(str, values))})", family.document(*values)
