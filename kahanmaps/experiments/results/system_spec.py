"""How a task comes by its system: a recipe of plain data, and the system that is made of it.

    {"family": {"draw": "eigenvalues", "m": 3, "seed": 7}}           a random member, made anew wherever it is needed
    {"document": DIGEST, "name": "top", "parameters": {"a": "2"}}    a system file or a system of the catalogue

A document is a system file as plain data; recipes name it by its digest, so that a task is the same wherever the file
lies, and another one when the file says something else. What a system is called belongs to it: reports print it. A
recipe is complete, with all parameters and all that a member is drawn with, so that the same question has one recipe.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from kahanmaps.algebra.printing import format_number
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.document import DocumentReader
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, show
from kahanmaps.experiments.options import FAMILY
from kahanmaps.experiments.results.records import canonical, digest
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import (
    parse_chi,
    random_eigenvalues,
    random_member,
    random_member_with_chi,
    random_member_with_eigenvalues,
)

_KEPT = 16  # systems that a child keeps: tasks that differ in eps only come one after the other


def document_text(file: SystemFile) -> str:
    """What a system file says of its system, as canonical text; what the catalogue adds about it is left out."""
    return canonical({key: value for key, value in file.document.items() if key != "catalog"})


ENDINGS = (".toml", ".ode")  # of system files


def find_file(reference: str, folder: Path) -> SystemFile:
    """The system of a name of the catalogue or of a path ending in .toml or .ode, which is relative to `folder`."""
    if reference.endswith(ENDINGS):
        return load(folder / reference)
    # Any other path would give its system a name with folders in it, and another one on every machine.
    if reference not in names() and ("/" in reference or os.path.exists(reference)):
        raise InputError(f"found {show(reference)}, expected a name of the catalogue or a path that ends in .toml")
    return load(reference)


def spec_of(file: SystemFile, documents: dict[str, str]) -> dict[str, Any]:
    """The recipe of a system file, with its own parameters; its document joins `documents`."""
    text = document_text(file)
    key = digest(text)
    documents[key] = text
    parameters = {name: format_number(value) for name, value in file.parameters.items()}
    return {"document": key, "name": file.name, "parameters": parameters}


def family_spec(values: Mapping[str, Any]) -> dict[str, Any]:
    """The recipe of a random member drawn with these values of `FAMILY` and this seed.

    >>> family_spec({"m": 3, "seed": 7, "eps": "1/10"})
    {'family': {'draw': 'eigenvalues', 'size': 2, 'm': 3, 'seed': 7}}
    """
    given = {name: values[name] for name in FAMILY if values.get(name) is not None}
    draw = given.get("draw", "eigenvalues")
    size = 1 if "chi" in given or draw == "generic" else 2
    return {"family": {"draw": draw, "size": size, **given, "seed": values.get("seed", 0)}}


def system_from(recipe: Mapping[str, Any], document: Callable[[str], str]) -> SystemFile:
    """The system of a recipe. `document` gives the text of a document by its digest.

    >>> system_from({"family": {"draw": "generic", "m": 2, "seed": 1}}, {}.__getitem__).name
    'random member, generic, m = 2, seed 1'
    """
    if "family" in recipe:
        return _drawn(canonical(recipe["family"]))
    return _read(document(recipe["document"]), canonical(recipe["parameters"]))


@lru_cache(_KEPT)
def _read(text: str, parameters: str) -> SystemFile:
    return SystemFile(**DocumentReader(json.loads(text), "system", json.loads(parameters)).read())


@lru_cache(_KEPT)
def _drawn(text: str) -> SystemFile:
    recipe = json.loads(text)
    seed, m, size = recipe["seed"], recipe.get("m"), recipe.get("size")
    if recipe.get("chi"):
        member = random_member_with_chi(parse_chi(recipe["chi"]), seed, size or 1)
    elif recipe.get("eigenvalues"):
        member = random_member_with_eigenvalues(FAMILY["eigenvalues"].make(recipe["eigenvalues"]), seed, size or 2)
    elif m is None:
        raise InputError("a random member of the family needs m, eigenvalues or chi")
    elif recipe["draw"] == "generic":
        member = random_member(m, seed, size or 1)
    else:
        member = random_member_with_eigenvalues(random_eigenvalues(m, seed), seed, size or 2)
    if recipe.get("signs"):
        member = FamilyMember(member.A, member.H, FAMILY["signs"].make(recipe["signs"]))
    how = f", {recipe['draw']}" if recipe["draw"] != "eigenvalues" else ""
    return SystemFile.from_member(member, f"random member{how}, m = {member.m}, seed {seed}")
