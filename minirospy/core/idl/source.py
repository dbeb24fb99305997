"""Collect the text of a generated module: lines, blocks, and the names that they share."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["Source", "python_name"]

_SAME = re.compile(r"([a-zA-Z])\1{2,}")
_RESERVED = {*keyword.kwlist, "self", "serialize", "deserialize"}


def python_name(field: str) -> str:
    """Return a field's name in Python; add an underscore if it is a keyword."""
    return field + "_" if field in _RESERVED else field


class Source:
    """Collects lines, and records the structs, classes and helpers that the start of the module must define."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.structs: dict[str, str] = {}
        """Dict from format characters for ``struct`` to the name of the compiled struct in the module."""
        self.classes: dict[str, str] = {}  # dict from ``pkg/Name`` to the name of the class in the module
        self.helpers: set[str] = set()  # names of the helpers in ``emit`` that the module needs
        self._indent = ""
        self._taken: set[str] = set()
        self._last: dict[str, int] = {}

    def line(self, text: str = "") -> None:
        """Add a line to the current block."""
        self.lines.append(self._indent + text if text else "")

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Add the line ``head``, and indent the lines added inside the context."""
        self.line(head)
        self._indent += "    "
        yield
        self._indent = self._indent[:-4]

    @contextmanager
    def function(self, head: str) -> Iterator[None]:
        """Yield a block with its own local names."""
        self._taken, self._last = set(), {}
        with self.block(head):
            yield

    def struct(self, letters: str) -> str:
        """Return the name of the compiled struct for these format characters (``If``: an unsigned int, then a float)."""
        short = _SAME.sub(lambda match: f"{len(match[0])}{match[1]}", letters)
        return self.structs.setdefault(short, f"_struct_{short}")

    def use(self, helper: str) -> str:
        """Record that the module needs a helper; return its name."""
        self.helpers.add(helper)
        return helper

    def class_(self, full_name: str) -> str:
        """Return the name of a message's class, which is unique within the module."""
        if full_name not in self.classes:
            name = "_" + full_name.replace("/", "_")
            # Without this check, a/b_C and a_b/C would get the same name, and struct/I the name of a compiled struct.
            while name in self.classes.values() or (name.startswith("_struct_") and name[-1] != "_"):
                name += "_"
            self.classes[full_name] = name
        return self.classes[full_name]

    def local(self, stem: str) -> str:
        """Return a local name that is unused in this function. It ends in a digit, so that it hides no other name."""
        number = self._last.get(stem, 0) + 1
        while f"{stem}{number}" in self._taken:
            number += 1
        self._last[stem] = number
        self._taken.add(f"{stem}{number}")
        return f"{stem}{number}"
