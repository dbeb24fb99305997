"""A controller's parameters. As in roscpp's ``getParam``, a value of the wrong type counts as not set."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeVar

__all__ = ["Parameters"]

_T = TypeVar("_T")


class Parameters:
    """A snapshot of the parameters below a namespace, taken when the controller was loaded. Keys may contain ``/``."""

    def __init__(self, namespace: str, values: Mapping[str, object]) -> None:
        self.namespace = namespace
        self._values = values

    def get(self, key: str) -> object:
        """Return a value, or None if it is not set."""
        value: object = self._values
        for part in key.strip("/").split("/"):
            if not isinstance(value, Mapping) or part not in value:
                return None
            value = value[part]
        return value

    def has_number(self, key: str) -> bool:
        """Return whether the value is an int or a float."""
        return isinstance(self.get(key), (int, float)) and not isinstance(self.get(key), bool)

    def number(self, key: str, default: float) -> float:
        """Return an int or float parameter as a float, or the default. The result may be NaN."""
        value = self.get(key)
        return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else default

    def finite(self, key: str, default: float) -> float:
        """Return a number, or the default. Raise ValueError if the number is infinite or NaN."""
        value = self.number(key, default)
        if not math.isfinite(value):
            raise ValueError(f"parameter {self.namespace}/{key} is {value}: it must be a finite number")
        return value

    def integer(self, key: str, default: int) -> int:
        """Return an int, or the default."""
        return self._typed(key, int, default)

    def flag(self, key: str, default: bool) -> bool:
        """Return a bool, or the default."""
        value = self.get(key)
        return value if isinstance(value, bool) else default

    def text(self, key: str, default: str) -> str:
        """Return a str, or the default."""
        return self._typed(key, str, default)

    def names(self, key: str) -> list[str] | None:
        """Return a list of str, or None if the value is not such a list."""
        value = self.get(key)
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            return None
        return list(value)

    def numbers(self, key: str) -> list[float] | None:
        """Return a list of numbers as floats, or None if the value is not such a list."""
        value = self.get(key)
        if not isinstance(value, list) or not all(type(each) in (int, float) for each in value):
            return None
        return list(map(float, value))

    def below(self, key: str) -> Parameters:
        """Return the parameters below a sub-namespace; empty if it is not set."""
        value = self.get(key)
        return Parameters(f"{self.namespace}/{key}", value if isinstance(value, Mapping) else {})

    def _typed(self, key: str, type_: type[_T], default: _T) -> _T:
        value = self.get(key)
        return value if isinstance(value, type_) and not isinstance(value, bool) else default
