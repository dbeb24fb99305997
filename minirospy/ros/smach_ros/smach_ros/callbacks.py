"""Wraps the callbacks of service and action states: checks the userdata keys they may use, and their results."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence

from minirospy import client as rospy
from minirospy.ros.smach.smach.exceptions import InvalidStateError
from minirospy.ros.smach.smach.state import State, adopt_interface
from minirospy.ros.smach.smach.user_data import Remapper, Values
from minirospy.ros.smach.smach.util import has_smach_interface

__all__ = ["StateCallback"]


class StateCallback:
    """A callback that belongs to a state; it may be None.

    Its userdata contains the keys that the callback declares with ``cb_interface``, or else those in the state's arguments.
    """

    def __init__(
        self,
        state: State,
        what: str,
        callback: Callable[..., object] | None,
        input_keys: Iterable[str],
        output_keys: Iterable[str],
        args: Sequence[object] = (),
        kwargs: Mapping[str, object] | None = None,
    ) -> None:
        """Store the callback; raise InvalidStateError if it is not callable.

        ``what`` describes the callback in messages, for example "Goal".
        """
        if callback is not None and not callable(callback):
            raise InvalidStateError(
                f"{what} callback object given to {type(state).__name__} that IS NOT a function object"
            )

        self._what = what
        self._callback = callback
        self._args, self._kwargs = args, dict(kwargs or {})
        self._input_keys, self._output_keys = input_keys, output_keys
        if has_smach_interface(callback):
            self._input_keys = callback.get_registered_input_keys()
            self._output_keys = callback.get_registered_output_keys()
        self._state = state

    def adopt(self) -> None:
        """Add to the state the keys and outcomes that its callback declares."""
        adopt_interface(self._state, self._callback)

    def __bool__(self) -> bool:
        return self._callback is not None

    def __str__(self) -> str:
        return str(self._callback)

    def __call__(self, ud: Values, *values: object) -> tuple[bool, object]:
        """Call the callback. Return (True, its return value), or (False, None) and log the error if it raises an exception."""
        if self._callback is None:
            return True, None
        seen = Remapper(ud, self._input_keys, self._output_keys)
        try:
            return True, self._callback(seen, *values, *self._args, **self._kwargs)
        except Exception:  # noqa: BLE001 - the user's callback
            rospy.logerr(f"Could not execute {self._what.lower()} callback: {traceback.format_exc()}")
            return False, None
