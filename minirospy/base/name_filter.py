"""Name patterns that select which topics, services and parameters may be shown or forwarded. Pure."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable
from dataclasses import dataclass

from minirospy.base.errors import BridgeError

__all__ = ["NameFilter"]


@dataclass(frozen=True)
class NameFilter:
    """Allows names that match a pattern in ``allow`` and one in ``whitelist``, but no pattern in ``deny``.

    ``allow`` and ``deny`` are globs in which ``*`` matches slashes too; ``whitelist`` contains regular expressions for the
    whole name, as in foxglove_bridge.
    """

    allow: tuple[str, ...] = ("*",)
    deny: tuple[str, ...] = ()
    whitelist: tuple[re.Pattern[str], ...] | None = None

    @classmethod
    def of(
        cls, allow: Iterable[str] = (), deny: Iterable[str] = (), whitelist: Iterable[str] | None = None
    ) -> NameFilter:
        """Create the filter. An empty ``allow`` allows all names. Raise BridgeError if a regular expression is invalid."""
        compiled = None
        if whitelist is not None:
            try:
                compiled = tuple(re.compile(each, re.IGNORECASE) for each in whitelist)
            except re.error as error:
                raise BridgeError(f"'{error.pattern!s}' is not a regular expression: {error}") from error
        return cls(tuple(allow) or ("*",), tuple(deny), compiled)

    def __call__(self, name: str) -> bool:
        """Return whether a name is allowed."""
        if not any(fnmatch.fnmatchcase(name, each) for each in self.allow):
            return False
        if any(fnmatch.fnmatchcase(name, each) for each in self.deny):
            return False
        return self.whitelist is None or any(each.fullmatch(name) for each in self.whitelist)
