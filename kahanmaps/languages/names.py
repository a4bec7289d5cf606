"""Names that a language can use: illegal and reserved ones are replaced, different names stay different.

I -> v_I in SymPy, vI in Mathematica    a_1 -> a1 in Mathematica    gamma -> v_gamma in PARI, Maple and SymPy
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field


def words(*lines: str) -> frozenset[str]:
    """The words of some lines of text."""
    return frozenset(" ".join(lines).split())


PYTHON_KEYWORDS = words(
    "False None True and as assert async await break class continue def del elif else except finally for from global",
    "if import in is lambda nonlocal not or pass raise return try while with yield print",
)

# What the written functions call their own arguments and local names.
_OURS = frozenset({"point", "eps", "image", "step", "M", "m"})


@dataclass(frozen=True)
class Naming:
    """How a language names things.

    `legal` is what a name must match, `prefix` what is put before one that is reserved; `underscores` says whether
    names may contain them (then functions are called vector_field, otherwise vectorField). `is_reserved` holds for
    names that mean something else in the language.
    """

    is_reserved: Callable[[str], bool]
    prefix: str = "v_"
    underscores: bool = True
    legal: re.Pattern[str] = field(default=re.compile(r"[A-Za-z][A-Za-z0-9_]*"))

    def function(self, *words: str) -> str:
        """The name of a function from its words, each of letters, digits and _.

        >>> plain = Naming(lambda name: False)
        >>> plain.function("integral", "I1"), Naming(lambda name: False, underscores=False).function("integral", "a_b")
        ('integral_I1', 'integralAB')
        """
        pieces = [piece for word in words for piece in re.split(r"[^A-Za-z0-9]+", word) if piece]
        if self.underscores:
            return "_".join(pieces)
        first, *others = pieces  # a small letter first: Sin and Integral would make a name of Mathematica
        return first[0].lower() + first[1:] + "".join(piece[0].upper() + piece[1:] for piece in others)

    def safe(self, names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
        """Every name with the one to use for it: itself where that is possible, always different ones.

        `taken` are names in use for something else.

        >>> pari = Naming(lambda name: name == "I")
        >>> pari.safe(["x", "I", "v_I", "_y"])
        {'x': 'x', 'I': 'v_v_I', 'v_I': 'v_I', '_y': 'y'}
        """
        used = {*taken, *_OURS}
        found = {}
        wanted = list(names)
        for name in wanted:  # those that may stay as they are come first, whatever the order
            if self._is_free(name) and name not in used:
                found[name] = name
                used.add(name)
        for name in wanted:
            if name in found:
                continue
            body = re.sub(r"[^A-Za-z0-9_]" if self.underscores else r"[^A-Za-z0-9]", "", name).lstrip("_")
            candidate = body if body != name and self._is_free(body) and body not in used else self.prefix + body
            while candidate in used or not self._is_free(candidate):
                candidate = self.prefix + candidate
            found[name] = candidate
            used.add(candidate)
        return {name: found[name] for name in wanted}

    def _is_free(self, name: str) -> bool:
        return self.legal.fullmatch(name) is not None and not self.is_reserved(name)
