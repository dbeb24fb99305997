"""The states that containers execute."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from minirospy.ros.smach.smach.user_data import Values
from minirospy.ros.smach.smach.util import has_smach_interface

__all__ = ["CBState", "State"]


class State:
    """A state. ``execute`` receives the userdata that the state declared, and returns one of the declared outcomes."""

    def __init__(
        self,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
    ) -> None:
        both = set(io_keys)
        self._outcomes = set(outcomes)
        self._input_keys = set(input_keys) | both
        self._output_keys = set(output_keys) | both
        self._preempt_requested = False

    def execute(self, ud: Values) -> str | None:
        """Perform the state's work and return an outcome; subclasses override this method."""
        raise NotImplementedError

    def register_outcomes(self, new_outcomes: Iterable[str]) -> None:
        """Declare more outcomes."""
        self._outcomes = self._outcomes.union(new_outcomes)

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the declared outcomes."""
        return tuple(self._outcomes)

    def register_io_keys(self, keys: Iterable[str]) -> None:
        """Add userdata keys that the state may read and write."""
        names = set(keys)
        self.register_input_keys(names)
        self.register_output_keys(names)

    def register_input_keys(self, keys: Iterable[str]) -> None:
        """Add userdata keys that the state may read."""
        self._input_keys = self._input_keys.union(keys)

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the keys that the state may read."""
        return tuple(self._input_keys)

    def register_output_keys(self, keys: Iterable[str]) -> None:
        """Add userdata keys that the state may write."""
        self._output_keys = self._output_keys.union(keys)

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the keys that the state may write."""
        return tuple(self._output_keys)

    def request_preempt(self) -> None:
        """Ask the state to stop. Its ``execute`` should check ``preempt_requested`` and return soon."""
        self._preempt_requested = True

    def service_preempt(self) -> None:
        """Mark the preemption request as handled."""
        self._preempt_requested = False

    def recall_preempt(self) -> None:
        """Withdraw the preemption request."""
        self._preempt_requested = False

    def preempt_requested(self) -> bool:
        """Return whether the state was asked to stop."""
        return self._preempt_requested


class CBState(State):
    """A state whose ``execute`` calls a function with the userdata."""

    def __init__(
        self,
        cb: Callable[..., str | None],
        cb_args: Sequence[object] = (),
        cb_kwargs: Mapping[str, object] | None = None,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys, io_keys)
        self._cb = cb
        self._cb_args = cb_args
        self._cb_kwargs = dict(cb_kwargs or {})
        adopt_interface(self, cb)

    def execute(self, ud: Values) -> str | None:
        """Call the function and return its outcome."""
        return self._cb(ud, *self._cb_args, **self._cb_kwargs)


def adopt_interface(state: State, cb: object) -> None:
    """Add to a state the keys and outcomes that a ``cb_interface`` callback declares."""
    if has_smach_interface(cb):
        state.register_input_keys(cb.get_registered_input_keys())
        state.register_output_keys(cb.get_registered_output_keys())
        state.register_outcomes(cb.get_registered_outcomes())
