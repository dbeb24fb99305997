"""The parameters that a node has read before: values in, notifications of changes in, values out.

Pure. A change makes the node forget what it concerns, and the next read queries the master: so updates that overtake
each other, and the empty dictionary that means "deleted" as well as "empty", do no harm.
Source: http://wiki.ros.org/ROS/Slave_API, paramUpdate.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

__all__ = ["NOT_SET", "ParameterCache"]


class _Missing(Enum):
    NOT_SET = "not set"


NOT_SET: Final = _Missing.NOT_SET
"""In place of the value of a parameter that is not set; None could be a value."""


class ParameterCache:
    """Values by global name; the value NOT_SET says that the master has none.

    :meth:`store` and :meth:`changed` from several threads want a lock around them.
    """

    def __init__(self) -> None:
        self._values: dict[str, object] = {}
        self._changes = 0

    @property
    def changes(self) -> int:
        """Return the number of changes: to be read before the master is queried, and given to :meth:`store`."""
        return self._changes

    def get(self, key: str) -> object:
        """Return what was stored for ``key`` and has not changed since. Raise LookupError."""
        return self._values[key]

    def store(self, key: str, value: object, changes: int) -> None:
        """Keep the master's answer, unless there was a change since it was asked."""
        if changes == self._changes:
            self._values[key] = value

    def changed(self, key: str) -> None:
        """Forget what a change of ``key`` concerns: itself, what is below it, and what it is a part of."""
        changed = _with_slash(key)
        self._changes += 1
        for known in list(self._values):
            name = _with_slash(known)
            if name.startswith(changed) or changed.startswith(name):
                del self._values[known]


def _with_slash(key: str) -> str:
    return key if key.endswith("/") else key + "/"
