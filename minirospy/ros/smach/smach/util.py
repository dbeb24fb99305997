"""The interface that state callbacks may declare, and the shutdown check."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeGuard

__all__ = ["CBInterface", "cb_interface", "has_smach_interface", "is_shutdown", "set_shutdown_check"]

_checks: dict[str, Callable[[], bool]] = {"shutdown": lambda: False}


def is_shutdown() -> bool:
    """Return whether containers must stop after the state that is executing."""
    return _checks["shutdown"]()


def set_shutdown_check(cb: Callable[[], bool]) -> None:
    """Set the function that decides whether containers must stop."""
    _checks["shutdown"] = cb


def has_smach_interface(obj: object) -> TypeGuard[CBInterface]:
    """Return whether an object declares outcomes, input keys and output keys."""
    return all(hasattr(obj, f"get_registered_{name}") for name in ("input_keys", "output_keys", "outcomes"))


class CBInterface:
    """A callback that declares outcomes and userdata keys, which are added to the state that uses the callback."""

    def __init__(
        self,
        cb: Callable[..., object],
        outcomes: Iterable[str] | None = None,
        input_keys: Iterable[str] | None = None,
        output_keys: Iterable[str] | None = None,
        io_keys: Iterable[str] | None = None,
    ) -> None:
        both = set(io_keys or ())
        self._input_keys = set(input_keys or ()) | both
        self._output_keys = set(output_keys or ()) | both
        self._outcomes = tuple(outcomes or ())
        self._cb = cb

    def __call__(self, *args: object, **kwargs: object) -> object:
        """Call the callback."""
        return self._cb(*args, **kwargs)

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the userdata keys that the callback may read."""
        return tuple(self._input_keys)

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the userdata keys that the callback may write."""
        return tuple(self._output_keys)

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes that the callback adds to its state."""
        return self._outcomes


class cb_interface:  # noqa: N801 - ROS's name
    """A decorator that adds outcomes and userdata keys to a callback."""

    def __init__(
        self,
        outcomes: Iterable[str] | None = None,
        input_keys: Iterable[str] | None = None,
        output_keys: Iterable[str] | None = None,
    ) -> None:
        self._interface = outcomes, input_keys, output_keys

    def __call__(self, cb: Callable[..., object]) -> CBInterface:
        """Return the callback, wrapped so that it declares these outcomes and keys."""
        return CBInterface(cb, *self._interface)
