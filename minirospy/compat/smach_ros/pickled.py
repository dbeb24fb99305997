"""Userdata as text on a topic: pickled, in base64, as ROS's smach has it.

What comes in was written by another node: only plain values, arrays and messages are made of it, and no other code runs.
"""

from __future__ import annotations

import base64
import io
import pickle
import re
from collections.abc import Mapping

__all__ = ["pickle_userdata", "unpickle_userdata"]

_PLAIN = {
    "builtins": {"bytearray", "bytes", "complex", "frozenset", "object", "range", "set", "slice"},
    "collections": {"OrderedDict", "defaultdict", "deque"},
    "copyreg": {"_reconstructor"},
    "_codecs": {"encode"},
    "genpy.rostime": {"Duration", "Time"},
    "rospy.rostime": {"Duration", "Time"},
    "numpy": {"dtype", "ndarray"},
    "numpy.core.multiarray": {"_reconstruct", "scalar"},
    "numpy._core.multiarray": {"_reconstruct", "scalar"},
    "numpy._core.numeric": {"_frombuffer"},
    "numpy.core.numeric": {"_frombuffer"},
}
_RENAMED = {"__builtin__": "builtins", "copy_reg": "copyreg"}
"""Python 2's names of modules, which this protocol has."""
_MESSAGE = re.compile(r"\w+\.(?:msg|srv)\._\w+")


def pickle_userdata(data: Mapping[str, object]) -> tuple[str, list[str]]:
    """Return the values as text, and the keys of those that cannot be pickled, which are left out."""
    try:
        return _encoded(dict(data)), []
    except Exception:  # noqa: BLE001 - values of the user's: pickle raises what their classes raise
        pass
    kept, left_out = {}, []
    for key, value in list(data.items()):
        try:
            pickle.dumps(value, 2)
        except Exception:  # noqa: BLE001 - as above
            left_out.append(key)
        else:
            kept[key] = value
    return _encoded(kept), left_out


def unpickle_userdata(text: str) -> dict[str, object]:
    """Return the values of a text. Raises ValueError for what is not one, or holds values that may not be made."""
    try:
        data = _Unpickler(io.BytesIO(base64.b64decode(text, validate=True))).load()
    except Exception as error:
        raise ValueError(f"not userdata: {error}") from error
    if not isinstance(data, dict):
        raise ValueError(f"not userdata: {type(data).__name__}")
    return data


def _encoded(data: dict[str, object]) -> str:
    return base64.b64encode(pickle.dumps(data, 2)).decode("ascii")


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> object:
        module = _RENAMED.get(module, module)
        if name in _PLAIN.get(module, ()):
            return super().find_class(module, name)
        if _MESSAGE.fullmatch(module):
            found = super().find_class(module, name)
            if isinstance(found, type) and hasattr(found, "_md5sum"):
                return found
        raise pickle.UnpicklingError(f"{module}.{name} is not a plain value or a message")
