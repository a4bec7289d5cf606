"""Names of the catalogue that take arguments: `lv(7,3)` is a member of the family `lv`, made when it is asked for."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

from kahanmaps.documents.lotka_volterra import lotka_volterra
from kahanmaps.errors import InputError, quoted

_CALL = re.compile(r"(\w+)(?:\((.*)\))?")
_INTEGER = re.compile(r"-?[0-9]{1,6}")


class NamedFamily(NamedTuple):
    """How its members are written, what they are, and the document that belongs to integer arguments."""

    form: str
    example: str
    title: str
    document: Callable[..., dict[str, Any]]


FAMILIES = {"lv": NamedFamily("lv(n,k)", "lv(7,3)", "Bogoyavlenskij-Itoh systems, 2k + 1 <= n", lotka_volterra)}


def family_member(reference: str) -> tuple[str, dict[str, Any]] | None:
    """The name, without spaces, and the document of a member of a family; None for what does not name a family.

    Raises InputError for arguments that are missing or that the family does not have.

    >>> family_member("lv(3, 1)")[0]
    'lv(3,1)'
    >>> family_member("lorenz")
    >>> family_member("lv(7)")
    Traceback (most recent call last):
        ...
    kahanmaps.errors.InputError: found 'lv(7)', expected lv(n,k) with integers, e.g. lv(7,3)
    """
    match = _CALL.fullmatch("".join(reference.split()))
    if match is None or match[1] not in FAMILIES:
        return None
    family = FAMILIES[match[1]]
    arguments = (match[2] or "").split(",")
    if len(arguments) != family.form.count(",") + 1 or not all(map(_INTEGER.fullmatch, arguments)):
        raise InputError(f"found {quoted(reference)}, expected {family.form} with integers, e.g. {family.example}")
    values = [int(text) for text in arguments]
    return f"{match[1]}({','.join(map(str, values))})", family.document(*values)
