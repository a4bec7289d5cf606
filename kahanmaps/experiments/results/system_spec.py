"""The spec of the system of a task, as plain data, and the construction of the system from its spec.

    {"family": {"draw": "eigenvalues", "m": 3, "seed": 7}}                      a random member, constructed when needed
    {"document": DIGEST, "name": "top", "parameters": {"a": "2"}}    a system file or a system of the catalogue

A document is the content of a system file as plain data. A spec refers to a document by its digest: hence a task
depends on the content of the file, not on its path. The name of the system is part of the spec, since reports print it.
A spec contains all parameters, or all arguments of the random construction, so that equal systems have equal specs.
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

_MAX_CACHED_SYSTEMS = 16  # number of systems that a worker caches: consecutive tasks often differ only in eps


def document_text(file: SystemFile) -> str:
    """Return the content of a system file as canonical text, without the entries that only the catalogue uses."""
    return canonical({key: value for key, value in file.document.items() if key != "catalog"})


ENDINGS = (".toml", ".ode")  # suffixes of the names of system files


def find_file(reference: str, folder: Path) -> SystemFile:
    """Return the system of a catalogue name, or of a path ending in .toml or .ode and relative to `folder`."""
    if reference.endswith(ENDINGS):
        return load(folder / reference)
    # With any other path the name of the system would depend on the machine.
    if reference not in names() and ("/" in reference or os.path.exists(reference)):
        raise InputError(f"found {show(reference)}, expected a name of the catalogue or a path that ends in .toml")
    return load(reference)


def spec_of(file: SystemFile, documents: dict[str, str]) -> dict[str, Any]:
    """Return the spec of the system in `file`, with its parameters; add the document of the file to `documents`."""
    text = document_text(file)
    key = digest(text)
    documents[key] = text
    parameters = {name: format_number(value) for name, value in file.parameters.items()}
    return {"document": key, "name": file.name, "parameters": parameters}


def family_spec(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the spec of a random member; `values` contains its seed and the values of the options in `FAMILY`.

    >>> family_spec({"m": 3, "seed": 7, "eps": "1/10"})
    {'family': {'draw': 'eigenvalues', 'size': 2, 'm': 3, 'seed': 7}}
    """
    given_values = {name: values[name] for name in FAMILY if values.get(name) is not None}
    draw = given_values.get("draw", "eigenvalues")
    size = 1 if "chi" in given_values or draw == "generic" else 2
    return {"family": {"draw": draw, "size": size, **given_values, "seed": values.get("seed", 0)}}


def system_from(spec: Mapping[str, Any], document: Callable[[str], str]) -> SystemFile:
    """Return the system that a spec describes; `document` maps the digest of a document to its text.

    >>> system_from({"family": {"draw": "generic", "m": 2, "seed": 1}}, {}.__getitem__).name
    'random member, generic, m = 2, seed 1'
    """
    if "family" in spec:
        return _random_system(canonical(spec["family"]))
    return _read_document(document(spec["document"]), canonical(spec["parameters"]))


@lru_cache(_MAX_CACHED_SYSTEMS)
def _read_document(text: str, parameters: str) -> SystemFile:
    return SystemFile(**DocumentReader(json.loads(text), "system", json.loads(parameters)).read())


@lru_cache(_MAX_CACHED_SYSTEMS)
def _random_system(text: str) -> SystemFile:
    spec = json.loads(text)
    seed, m, size = spec["seed"], spec.get("m"), spec.get("size")
    if spec.get("chi"):
        member = random_member_with_chi(parse_chi(spec["chi"]), seed, size or 1)
    elif spec.get("eigenvalues"):
        member = random_member_with_eigenvalues(FAMILY["eigenvalues"].make(spec["eigenvalues"]), seed, size or 2)
    elif m is None:
        raise InputError("a random member of the family needs m, eigenvalues or chi")
    elif spec["draw"] == "generic":
        member = random_member(m, seed, size or 1)
    else:
        member = random_member_with_eigenvalues(random_eigenvalues(m, seed), seed, size or 2)
    if spec.get("signs"):
        member = FamilyMember(member.A, member.H, FAMILY["signs"].make(spec["signs"]))
    method_text = f", {spec['draw']}" if spec["draw"] != "eigenvalues" else ""
    return SystemFile.from_member(member, f"random member{method_text}, m = {member.m}, seed {seed}")
