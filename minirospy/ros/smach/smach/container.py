"""The base class of all containers: construction in a ``with`` block, copying userdata in and out, and callbacks."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, ClassVar

from minirospy.ros.smach.smach.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
)
from minirospy.ros.smach.smach.log import logerr, logwarn
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import UserData, Values

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Container"]

Callback = Callable[..., object]


class Container(State):
    """A state that contains other states. Subclasses define how these are executed.

    Callbacks are called when the container starts (userdata, initial states), at each transition (userdata, active states),
    and when it finishes (userdata, the last states, the outcome).
    """

    _construction_stack: ClassVar[list[Container]] = []
    _construction_lock = threading.RLock()  # held by the thread that has opened a container

    def __init__(
        self,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys)
        self.userdata = UserData()  # shared by the container's states
        self._executing_thread: int | None = None
        self._start_cbs: list[tuple[Callback, Sequence[object]]] = []
        self._transition_cbs: list[tuple[Callback, Sequence[object]]] = []
        self._termination_cbs: list[tuple[Callback, Sequence[object]]] = []

    def __getitem__(self, key: str) -> State:
        """Return the state with this label."""
        raise NotImplementedError

    def get_children(self) -> Mapping[str, State]:
        """Return a dict of the states, keyed by label."""
        raise NotImplementedError

    def set_initial_state(self, initial_states: Sequence[str], userdata: UserData) -> None:
        """Set the initial states and add ``userdata`` to the container's userdata."""
        raise NotImplementedError

    def get_initial_states(self) -> list[str]:
        """Return the labels of the initial states."""
        raise NotImplementedError

    def get_active_states(self) -> list[str]:
        """Return the labels of the executing states."""
        raise NotImplementedError

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the transitions as (outcome, label of the state, label of the next state or container's outcome)."""
        raise NotImplementedError

    def check_consistency(self) -> None:
        """Raise InvalidStateError or InvalidTransitionError if the container cannot be executed."""
        raise NotImplementedError

    # Userdata.

    def _copy_input_keys(self, parent_ud: Values | None, ud: UserData) -> None:
        if parent_ud is not None:
            _copy(self.get_registered_input_keys(), parent_ud, ud, "input")

    def _copy_output_keys(self, ud: UserData, parent_ud: Values | None) -> None:
        if parent_ud is not None:
            _copy(self.get_registered_output_keys(), ud, parent_ud, "output")

    # Callbacks.

    def register_start_cb(self, start_cb: Callback, cb_args: Sequence[object] = ()) -> None:
        """Register a function to be called with userdata, initial states and ``cb_args`` when the container starts."""
        self._start_cbs.append((start_cb, cb_args))

    def register_transition_cb(self, transition_cb: Callback, cb_args: Sequence[object] = ()) -> None:
        """Register a function to be called with userdata, active states and ``cb_args`` at each transition."""
        self._transition_cbs.append((transition_cb, cb_args))

    def register_termination_cb(self, termination_cb: Callback, cb_args: Sequence[object] = ()) -> None:
        """Register a function to be called with userdata, last states, outcome and ``cb_args`` when the container finishes."""
        self._termination_cbs.append((termination_cb, cb_args))

    def call_start_cbs(self) -> None:
        """Call the functions registered with ``register_start_cb``; log their exceptions."""
        self._call("start", self._start_cbs, lambda: (self.get_initial_states(),))

    def call_transition_cbs(self) -> None:
        """Call the functions registered with ``register_transition_cb``; log their exceptions."""
        self._call("transition", self._transition_cbs, lambda: (self.get_active_states(),))

    def call_termination_cbs(self, terminal_states: Sequence[str], outcome: str | None) -> None:
        """Call the functions registered with ``register_termination_cb``; log their exceptions."""
        self._call("termination", self._termination_cbs, lambda: (terminal_states, outcome))

    def _call(
        self,
        kind: str,
        callbacks: Iterable[tuple[Callback, Sequence[object]]],
        arguments: Callable[[], tuple[object, ...]],
    ) -> None:
        try:
            for callback, more in callbacks:
                callback(self.userdata, *arguments(), *more)
        except Exception:  # noqa: BLE001 - the user's callback
            logerr(f"Could not execute {kind} callback: {traceback.format_exc()}")

    # Construction.

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        if exc_type is None:
            self.close()
            return
        self._leave()
        if exc_type not in (InvalidStateError, InvalidTransitionError):
            lines = traceback.format_exception(exc_type, exc_val, exc_tb)
            logerr("Error raised during SMACH container construction: \n" + "\n".join(lines))

    @contextmanager
    def opened(self, **kwargs: object) -> Iterator[Self]:
        """Open the container for a ``with`` block; ``kwargs`` have no effect, as in ROS."""
        self.open()
        try:
            yield self
        finally:
            self.close()

    def open(self) -> None:
        """Open the container: ``add`` then adds states to it until ``close`` is called."""
        Container._construction_lock.acquire()
        Container._construction_stack.append(self)

    def close(self) -> None:
        """Close the container and log an error if it is not consistent."""
        self._leave()
        try:
            self.check_consistency()
        except (InvalidStateError, InvalidTransitionError):
            logerr("Container consistency check failed.")

    def _leave(self) -> None:
        if not self.is_opened():
            raise InvalidStateError("Attempting to close a container that is not currently open.")
        Container._construction_stack.pop()
        Container._construction_lock.release()

    def is_opened(self) -> bool:
        """Return whether the container is open for ``add``."""
        stack = Container._construction_stack
        return bool(stack) and stack[-1] is self

    def assert_opened(self, msg: str = "") -> None:
        """Raise InvalidConstructionError with ``msg`` if the container is not open."""
        if not self.is_opened():
            raise InvalidConstructionError(msg)

    @classmethod
    def _currently_opened_container(cls) -> Self:
        stack = Container._construction_stack
        if not stack:
            raise InvalidStateError(
                "Attempting to access the currently opened container, but no container is opened."
            )
        if not isinstance(stack[-1], cls):
            raise InvalidStateError(
                f"Attempting to call a {cls} construction method without having opened a {cls}."
            )
        return stack[-1]


def _copy(keys: Iterable[str], source: Values, target: Values, kind: str) -> None:
    for key in keys:
        try:
            target[key] = source[key]
        except KeyError:
            logwarn(f"Attempting to copy {kind} key '{key}', but this key does not exist.")
