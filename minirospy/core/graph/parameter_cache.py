"""The cache of parameters that a node has read. Change notifications invalidate its entries.

Pure. A change only invalidates the affected values, and the next read queries the master. Therefore updates may overtake
each other, and an empty dictionary may mean both "deleted" and "empty".
Source: http://wiki.ros.org/ROS/Slave_API, paramUpdate.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

__all__ = ["NOT_SET", "ParameterCache"]


class _Missing(Enum):
    NOT_SET = "not set"


NOT_SET: Final = _Missing.NOT_SET  # the value of a parameter that is not set; None could be a value


class ParameterCache:
    """Cached values, keyed by global name. NOT_SET means that the parameter is not set in the master.

    If several threads call :meth:`store` and :meth:`changed`, the caller must use a lock.
    """

    def __init__(self) -> None:
        self._values: dict[str, object] = {}
        self._changes = 0

    @property
    def changes(self) -> int:
        """The number of changes. Read it before querying the master, and pass it to :meth:`store`."""
        return self._changes

    def get(self, key: str) -> object:
        """Return the value stored for ``key``. Raise LookupError if none was stored, or if a change has invalidated the value."""
        return self._values[key]

    def store(self, key: str, value: object, changes: int) -> None:
        """Store the value that the master returned, unless any parameter has changed since ``changes`` was read."""
        if changes == self._changes:
            self._values[key] = value

    def changed(self, key: str) -> None:
        """Invalidate the values of ``key``, of the keys below it, and of the namespaces that contain it."""
        changed = _with_slash(key)
        self._changes += 1
        for known in list(self._values):
            name = _with_slash(known)
            if name.startswith(changed) or changed.startswith(name):
                del self._values[known]


def _with_slash(key: str) -> str:
    return key if key.endswith("/") else key + "/"
