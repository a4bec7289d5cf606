"""The systems of one experiment: found by name, path or pattern, fit for the task, and of dimensions that agree."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, suggestion
from kahanmaps.experiments.grid import Values
from kahanmaps.experiments.options import OTHER, show
from kahanmaps.experiments.recipes import find_file, recipe_of
from kahanmaps.experiments.registry import MEMBER, MEMBER_OR_OTHER, TaskKind
from kahanmaps.experiments.spec_document import ExperimentTable
from kahanmaps.family.draw import parse_chi

FAMILY_WORD = "family"
_FILES_AT_MOST = 10_000
_POINTS_COMPARED = 1_000
# m from what a random member is drawn with.
_SIZES: Mapping[str, Callable[[Any], int]] = {
    "m": int,
    "eigenvalues": lambda text: int(text.count(",")) + 1,
    "chi": lambda text: parse_chi(text).degree(),
}


class ExperimentSystems:
    """Reads the systems of a table; `kind` is None where the task is not known.

    `files` are those of the key system, `others` those of the option other with their places; `is_family` says that
    members are drawn at random instead.
    """

    def __init__(self, table: ExperimentTable, kind: TaskKind | None) -> None:
        self.table = table
        self.kind = kind
        self.files: list[SystemFile] = []
        self.others: list[tuple[str, SystemFile]] = []
        self.is_family = False

    @property
    def has_parameters(self) -> bool:
        """Whether the system is a file, or may be: what it is is not known where its place is wrong."""
        return self.kind is not None and self.kind.needs is not None and not self.is_family

    def read(self) -> list[dict[str, Any]]:
        """The recipes of the systems, none where the task needs none; what is wrong is told and left out."""
        raw = self.table.sound("system")
        if raw is None:
            if self.kind is not None and self.kind.needs is not None and self.table.raw.get("system") is None:
                self.table.mistake(
                    "system", 'missing, expected "family", a name of the catalogue, a path, or a list of these'
                )
            return []
        if self.kind is not None and self.kind.needs is None:
            self.table.mistake(
                "system", f"found {show(raw)}, expected none: {self.kind.name} is about no particular system"
            )
            return []
        references = raw if isinstance(raw, list) else [raw]
        if not references:
            self.table.mistake("system", "found an empty list, expected at least one system")
        if FAMILY_WORD in references:
            self.is_family = True
            if len(references) > 1:
                self.table.mistake("system", 'found "family" among others, expected it alone: make another experiment')
            return [{"family": {}}]
        return self.read_files("system", references)

    def read_files(self, key: str, references: Sequence[str]) -> list[dict[str, Any]]:
        """The recipes of the files that the value of a key names."""
        recipes: dict[str, dict[str, Any]] = {}
        for number, reference in enumerate(references, start=1):
            place = f"{key}[{number}]" if len(references) > 1 else key
            try:
                for file in self._find(reference):
                    recipe = recipe_of(file, self.table.spec.documents)
                    if recipe["document"] in recipes:
                        self.table.mistake(place, f"found {file.name} twice, expected every system once")
                    recipes[recipe["document"]] = recipe
                    if key == "system":
                        self.files.append(file)
                        self._require_kind(place, file)
                    else:
                        self.others.append((place, file))
            except InputError as error:
                self.table.mistake(place, str(error))
        return list(recipes.values())

    def compare_dimensions(self, values: Mapping[str, Values], zips: Sequence[Sequence[str]]) -> None:
        """Every start and every second system must fit every system; zipped ones are compared in pairs."""
        drawn = next((name for name in _SIZES if name in values), None) if self.is_family else None
        if drawn is not None and len(values[drawn]) <= _POINTS_COMPARED:
            dims = [2 * _SIZES[drawn](value) for value in values[drawn]]
        else:
            dims = [file.system.dim for file in self.files]
        starts = values.get("start", ())
        if len(starts) <= _POINTS_COMPARED:
            place = self.table.given().get("start", "")
            places = [f"{place}[{k}]" if len(starts) > 1 else place for k in range(1, len(starts) + 1)]
            found = [(place, start.count(",") + 1) for place, start in zip(places, starts, strict=True)]
            self._compare(found, dims, "coordinates", any({drawn, "start"} <= set(names) for names in zips))
        if OTHER in values:
            found = [(place, file.system.dim) for place, file in self.others]
            self._compare(found, dims, "variables", any({drawn, OTHER} <= set(names) for names in zips))

    def _compare(self, found: Sequence[tuple[str, int]], dims: Sequence[int], what: str, zipped: bool) -> None:
        for (place, count), partners in zip(found, [[d] for d in dims] if zipped else [dims] * len(found), strict=True):
            wrong = sorted({dim for dim in partners if dim != count})
            if wrong:
                self.table.mistake(place, f"found {count} {what}, expected {wrong[0]}, the dimension of the system")

    def _find(self, reference: str) -> list[SystemFile]:
        """The system of a reference, or all those that match a pattern such as members/*.toml."""
        if any(mark in reference for mark in "*?["):
            if Path(reference).is_absolute() or not reference.endswith(".toml"):
                raise InputError(
                    f"found {show(reference)}, expected a pattern that ends in .toml and is relative to the folder of "
                    "the spec, e.g. members/*.toml"
                )
            try:
                paths = sorted(self.table.spec.folder.glob(reference))
            except (ValueError, NotImplementedError) as error:
                raise InputError(f"found {show(reference)}, which is no pattern: {error}") from error
            if not paths or len(paths) > _FILES_AT_MOST:
                raise InputError(f"found {len(paths)} files like {show(reference)}, expected 1 to {_FILES_AT_MOST}")
            return [find_file(str(path.relative_to(self.table.spec.folder)), self.table.spec.folder) for path in paths]
        try:
            return [find_file(reference, self.table.spec.folder)]
        except InputError as error:
            hint = suggestion(reference, [FAMILY_WORD])
            raise InputError(f"{error}{hint}") from error

    def _require_kind(self, place: str, file: SystemFile) -> None:
        if self.kind is None or file.member is not None or self.kind.needs not in (MEMBER, MEMBER_OR_OTHER):
            return
        if self.kind.needs == MEMBER_OR_OTHER and OTHER in self.table.given():
            return
        also = ", or a second system as the option other" if self.kind.needs == MEMBER_OR_OTHER else ""
        self.table.mistake(place, f"{file.name} is of kind [{file.kind}], expected one of kind [family]{also}")
