"""The data that states share: a container's values (UserData), and one state's view of them (Remapper)."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any

from minirospy.ros.smach.smach.exceptions import InvalidUserCodeError
from minirospy.ros.smach.smach.log import logdebug, logerr

__all__ = ["Const", "Remapper", "UserData", "get_const"]


class UserData:
    """Key-value pairs, accessed as attributes or items. Accessing a missing key logs an error and raises KeyError."""

    def __init__(self) -> None:
        self._data: dict[str, object] = {}

    def update(self, other_userdata: UserData) -> None:
        """Copy all values from another UserData."""
        self._data.update(other_userdata._data)

    def extract(self, keys: Iterable[str], remapping: Mapping[str, str]) -> UserData:
        """Return a new UserData with copies of the values of ``keys``, renamed according to ``remapping``: {new name: key}."""
        names = {outer: inner for inner, outer in remapping.items()}
        if len(names) != len(remapping):
            logerr(f"SMACH userdata remapping is not one-to-one: {remapping}")
        extracted = UserData()
        for key in keys:
            extracted[names.get(key, key)] = copy.copy(self[key])
        return extracted

    def merge(self, ud: UserData, keys: Iterable[str], remapping: Mapping[str, str]) -> None:
        """Copy the values of ``keys`` from another UserData. ``remapping`` maps that object's keys to this object's keys."""
        for key in keys:
            self[remapping.get(key, key)] = copy.copy(ud[key])

    def keys(self) -> list[str]:
        """Return the keys."""
        return list(self._data)

    def __contains__(self, key: object) -> bool:
        return key in self._data

    def __getitem__(self, key: str) -> Any:
        if key in self._data:
            return self._data[key]
        logerr(f"Userdata key '{key}' not available. Available keys are: {list(self._data)}")
        raise KeyError(key)

    def __setitem__(self, key: str, item: object) -> None:
        self._data[key] = item

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: object) -> None:
        if name.startswith("_"):
            object.__setattr__(self, name, value)
        else:
            self._data[name] = value


def get_const(obj: object) -> object:
    """Return a read-only view of an object if it has attributes; return any other object unchanged."""
    if not hasattr(obj, "__dict__"):
        return obj
    logdebug(f"Making const '{obj}'")
    return Const(obj)


class Const:
    """A read-only view of an object's attributes. Setting an attribute changes only the view, and logs an error."""

    def __init__(self, obj: object) -> None:
        object.__setattr__(self, "_obj", obj)

    def __getattr__(self, name: str) -> Any:
        if name == "_obj":
            raise AttributeError(name)
        return get_const(getattr(self._obj, name))

    def __getitem__(self, name: object) -> object:
        return get_const(self._obj[name])

    def __setattr__(self, name: str, value: object) -> None:
        logerr(f"Attempting to set '{name}' but this member is read-only.")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        text = f"Attempting to delete '{name}' but this member is read-only."
        logerr(text)
        raise TypeError(text)


class Remapper:
    """A state's view of a container's userdata: only the declared keys, under the names that the state uses.

    A value whose key is an input key but not an output key is read-only (``get_const``). Writing a key that is not an
    output key is logged and has no effect; reading a key that is not an input key raises InvalidUserCodeError.
    """

    def __init__(
        self,
        ud: Values,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        remapping: Mapping[str, str] | None = None,
    ) -> None:
        object.__setattr__(self, "_ud", ud)
        object.__setattr__(self, "_input", input_keys)
        object.__setattr__(self, "_output", output_keys)
        object.__setattr__(self, "_map", dict(remapping or {}))

    def _remap(self, key: str) -> str:
        mapped: str = self._map.get(key, key)
        return mapped

    def update(self, other_userdata: UserData) -> None:
        """Copy all values from another UserData."""
        self._ud.update(other_userdata)

    def keys(self) -> list[str]:
        """Return the readable keys that exist."""
        return [self._remap(key) for key in list(self._ud.keys()) if key in self._input]

    def __contains__(self, key: object) -> bool:
        return key in self._input and self._remap(str(key)) in self._ud

    def __getitem__(self, key: str) -> Any:
        if key not in self._input:
            raise InvalidUserCodeError(
                f"Reading from SMACH userdata key '{key}' but the only keys that were declared as input to this state were: "
                f"{self._input}. This key needs to be declared as input to this state. "
            )
        value = self._ud[self._remap(key)]
        return value if key in self._output else get_const(value)

    def __setitem__(self, key: str, item: object) -> None:
        if key in self._output:
            self._ud[self._remap(key)] = item
        else:
            logerr(
                f"Writing to SMACH userdata key '{key}' but the only keys that were declared as output from this state "
                f"were: {self._output}."
            )

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: object) -> None:
        if name.startswith("_"):
            object.__setattr__(self, name, value)
        else:
            self[name] = value


Values = UserData | Remapper
"""The userdata that a state receives: the container's own object, or a view of the declared keys."""
