"""Converts userdata to a string for a topic, pickled and base64-encoded as in ROS's smach, and back.

Another node sends the data, so only plain values, arrays and messages are created from it; no other code is executed.
"""

from __future__ import annotations

import base64
import io
import pickle
import re
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from minirospy.base.times import Duration, Time
from minirospy.client.time import Duration as RosDuration
from minirospy.client.time import Time as RosTime
from minirospy.core.idl.load import get_message_class, get_service_class

__all__ = ["pickle_userdata", "unpickle_userdata"]

_RENAMED = {"__builtin__": "builtins", "copy_reg": "copyreg", "numpy.core": "numpy._core"}
"""Maps module names in Python 2 and in older numpy versions to their current names."""
_MESSAGE = re.compile(r"(\w+)\.(msg|srv)\._(\w+)")
_TEXTS = "SU"
_SIMPLE = "biufc" + _TEXTS  # numpy dtype kinds for numbers and strings; other kinds may contain pointers


def pickle_userdata(data: Mapping[str, object]) -> tuple[str, list[str]]:
    """Pickle userdata values. Return the string, and the keys of the values that were omitted because they cannot be pickled."""
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
    """Return the userdata in a pickled string. Raise ValueError if it is malformed or contains objects that are not allowed."""
    try:
        data = _Unpickler(io.BytesIO(base64.b64decode(text, validate=True))).load()
    except Exception as error:
        raise ValueError(f"not userdata: {error}") from error
    if not isinstance(data, dict):
        raise ValueError(f"not userdata: {type(data).__name__}")
    return data


def _encoded(data: dict[str, object]) -> str:
    return base64.b64encode(pickle.dumps(data, 2)).decode("ascii")


_set_state = pickle._Unpickler.dispatch[pickle.BUILD[0]]


class _Unpickler(pickle._Unpickler):
    """pickle's unpickler in Python, used instead of the one in C so that each operation can be checked before it runs."""

    stack: list[Any]
    read: Callable[[int], bytes]
    append: Callable[[object], None]

    def find_class(self, module: str, name: str) -> object:
        for old, new in _RENAMED.items():
            if module == old or module.startswith(f"{old}."):
                module = new + module[len(old) :]
        if made := _MAKERS.get(f"{module}.{name}"):
            return made
        if match := _MESSAGE.fullmatch(module):
            # Find the class by its message type: importing a module named in the data would execute its code.
            for found in _classes(f"{match[1]}/{match[3]}", match[2]):
                if found.__name__ == name:
                    return found
        raise pickle.UnpicklingError(f"{module}.{name} is not a plain value or a message")

    def load_build(self) -> None:
        """Set an object's state. Reject classes, which are shared, and numpy dtypes, because a bad state could corrupt memory."""
        target, state = self.stack[-2:]
        if callable(target):
            raise pickle.UnpicklingError("the state of a class")
        if type(target).__module__.partition(".")[0] == "numpy" and hasattr(target, "fields"):
            _check_dtype(target, state)
        _set_state(self)  # type: ignore[arg-type]

    def load_bytearray8(self) -> None:
        """Create a bytearray from the available bytes; pickle would first allocate the size stated in the data."""
        size = int.from_bytes(self.read(8), "little")
        self.append(bytearray(self.read(size)))

    dispatch: ClassVar[dict[int, Any]] = {
        **pickle._Unpickler.dispatch,
        pickle.BUILD[0]: load_build,
        pickle.BYTEARRAY8[0]: load_bytearray8,
    }


def _classes(name: str, kind: str) -> tuple[Any, ...]:
    if kind == "msg":
        found = get_message_class(name)
        return () if found is None else (found,)
    service = get_service_class(name)
    return () if service is None else (service, service._request_class, service._response_class)


def _check_dtype(target: Any, state: Any) -> None:
    """Raise UnpicklingError if the state changes anything in a numpy dtype except its byte order."""
    # Allow only values that numpy writes: numpy itself would accept any string size, even a negative one, and any flags.
    size, alignment = (target.itemsize, target.alignment) if target.kind in _TEXTS else (-1, -1)
    allowed = [(3, order, None, None, None, size, alignment, target.flags) for order in "<>=|"]
    if target.kind not in _SIMPLE or tuple(state) not in allowed:
        raise pickle.UnpicklingError(f"an array of {target}")


def _plain(make: Callable[..., object], *kinds: type) -> Callable[..., object]:
    """Wrap a constructor to reject first arguments of other types: bytes(N), for example, would allocate N bytes."""

    def made(content: object = (), *more: object) -> object:
        if type(content) not in (*kinds, tuple):
            raise pickle.UnpicklingError(f"{make.__name__} of {type(content).__name__}")
        return make(content, *more)

    return made


def _bytes_of(text: str, encoding: str) -> bytes:
    if encoding not in ("latin1", "latin-1"):
        raise pickle.UnpicklingError(f"bytes in {encoding}")
    return text.encode(encoding)


def _reconstructed(cls: type, base: type, state: object) -> object:
    if base is not object or not isinstance(cls, type):
        raise pickle.UnpicklingError(f"an object on {base}")
    return object.__new__(cls)


def _simple_dtype(name: object, *_: object) -> Any:
    import numpy as np

    found = np.dtype(name if isinstance(name, str) else "O")
    if found.kind not in _SIMPLE:
        raise pickle.UnpicklingError(f"an array of {name}")
    # Return a copy: pickle then changes the state of the returned dtype, which must not be numpy's shared one.
    return np.dtype(found.str, copy=True)


def _empty_array(*_: object) -> object:
    import numpy as np

    return np.empty(0)


def _array(data: Any, dtype: Any, shape: Any, order: Any) -> object:
    return _from_buffer(data, dtype).reshape(shape, order=order)


def _scalar(dtype: Any, data: Any) -> object:
    return _from_buffer(data, dtype, 1)[0]


def _from_buffer(data: Any, dtype: Any, count: int = -1) -> Any:
    import numpy as np

    # Reject arrays: pickle may set the state of the returned array next, which could free memory that it shares.
    if type(data) not in (bytes, bytearray):
        raise pickle.UnpicklingError(f"an array in {type(data).__name__}")
    return np.frombuffer(data, dtype, count)


_MAKERS: Mapping[str, Callable[..., object]] = {
    "builtins.bytearray": _plain(bytearray, str, bytes),
    "builtins.bytes": _plain(bytes, list),
    "builtins.complex": complex,
    "builtins.frozenset": _plain(frozenset, list),
    "builtins.object": object,
    "builtins.range": range,
    "builtins.xrange": range,
    "builtins.set": _plain(set, list),
    "builtins.slice": slice,
    "collections.OrderedDict": _plain(OrderedDict, list),
    "collections.defaultdict": defaultdict,
    "collections.deque": _plain(deque, list),
    "copyreg._reconstructor": _reconstructed,
    "_codecs.encode": _bytes_of,
    "genpy.rostime.Duration": Duration,
    "genpy.rostime.Time": Time,
    "rospy.rostime.Duration": RosDuration,
    "rospy.rostime.Time": RosTime,
    "numpy.dtype": _simple_dtype,
    "numpy.ndarray": object,
    "numpy._core.multiarray._reconstruct": _empty_array,
    "numpy._core.multiarray.scalar": _scalar,
    "numpy._core.numeric._frombuffer": _array,
}
"""The constructors for the classes that the data may name."""
