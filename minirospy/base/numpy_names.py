"""Array methods that numpy has removed but that ROS 1 programs still call."""

from __future__ import annotations

import sys

from minirospy.base.installation import install_command

__all__ = ["add_numpy_note"]

_REMOVED = {
    "itemset": ("2", "a[i] = value"),
    "newbyteorder": ("2", "a.view(a.dtype.newbyteorder())"),
    "ptp": ("2", "numpy.ptp(a)"),
    "tostring": ("2.3", "a.tobytes()"),
}
"""Dict from array method to (version of numpy that removed it, replacement)."""


def add_numpy_note(error: BaseException) -> None:
    """If ``error`` is about an array method that numpy has removed, add a note that names the replacement.

    On Python 3.10 do nothing, because exceptions have no notes there (PEP 678).
    """
    numpy = sys.modules.get("numpy")
    if numpy is None or sys.version_info < (3, 11) or not isinstance(error, AttributeError):
        return
    removed = _REMOVED.get(error.name or "")
    if removed and isinstance(error.obj, numpy.ndarray):
        version, instead = removed
        command = install_command(f"numpy<{version}")
        error.add_note(f"numpy {version} has removed it: use {instead}, or `{command}`")
