"""The document of a spec while it is read: what in it has the right shape, and the mistakes found so far.

The shape is checked by pydantic, once; whoever reads the meaning of a part asks for it here, and tells here what is
wrong with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kahanmaps.experiments.experiment import PARAMETERS
from kahanmaps.experiments.shape import Place, shape_mistakes

TIME_STEP = "time_step"


class SpecDocument:
    """A whole spec; paths of systems in it are relative to `folder`.

    `mistakes` are pairs of key and sentence, those of the shape first. `documents` are of the systems found on the way.
    """

    def __init__(self, document: Mapping[str, Any], folder: Path) -> None:
        self.document = document
        self.folder = folder
        self.mistakes: list[tuple[str, str]] = []
        self.documents: dict[str, str] = {}
        self._misshapen: list[Place] = []
        for path, key, sentence in shape_mistakes(document):
            self._misshapen.append(path)
            self.mistake(key, sentence)

    def mistake(self, key: str, sentence: str) -> None:
        """Tell that something is wrong."""
        # Keys and words come from the file: nothing in them may reach a terminal as an escape sequence.
        printable = ["".join(c if c.isprintable() or c == "\n" else "_" for c in text) for text in (key, sentence)]
        self.mistakes.append((printable[0].replace("\n", "_")[:120], printable[1]))

    def sound(self, *path: str | int) -> Any:
        """The value at a place, None where it is missing or has not the right shape."""
        if any(bad == path[: len(bad)] for bad in self._misshapen):
            return None
        value: Any = self.document
        for key in path:
            if isinstance(value, dict) and key not in value:
                return None
            value = value[key]
        return value


class ExperimentTable:
    """The table [experiments.NAME] of a spec."""

    def __init__(self, spec: SpecDocument, name: str) -> None:
        self.spec = spec
        self.name = name
        self._told_before = len(spec.mistakes)

    @property
    def has_mistakes(self) -> bool:
        """Whether something has been found wrong since the reading of this table began."""
        return len(self.spec.mistakes) > self._told_before

    @property
    def raw(self) -> dict[str, Any]:
        """The table as it was written, whatever shape its values have."""
        found: dict[str, Any] = self.spec.document["experiments"][self.name]
        return found

    def mistake(self, key: str, sentence: str) -> None:
        """Tell that something is wrong; `key` begins in this table."""
        self.spec.mistake(f"experiments.{self.name}.{key}", sentence)

    def sound(self, *path: str | int) -> Any:
        """The value at a place in this table, None where it is missing or has not the right shape."""
        return self.spec.sound("experiments", self.name, *path)

    def entries(self, part: str) -> list[tuple[str, str, Any]]:
        """What the table of options or of axes says: canonical names of options, places, values."""
        entries: list[tuple[str, str, Any]] = []
        for key, raw in (self.sound(part) or {}).items():
            if key == "parameters" and isinstance(raw, dict):
                entries += [(f"{PARAMETERS}{name}", f"{part}.{key}.{name}", value) for name, value in raw.items()]
            else:
                entries.append(("eps" if key == TIME_STEP else key, f"{part}.{key}", raw))
        return entries

    def given(self) -> dict[str, str]:
        """The options that the spec gives, right or wrong, and where."""
        return {name: place for part in ("axes", "options") for name, place, _ in self.entries(part)}
