"""A bond: two nodes exchange heartbeats on a topic, and get callbacks when the bond forms and breaks.

Source: http://wiki.ros.org/bond, http://wiki.ros.org/bondpy.
"""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable
from contextlib import suppress

from bond.msg import Constants, Status

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.errors import MinirospyError
from minirospy.ros.bondpy.bondpy.machine import Action, Event, State, next_state

__all__ = ["Bond", "Timeout", "as_float_duration", "as_ros_duration"]

Seconds = float | times.Duration
Callback = Callable[[], object]

_LOOK = 0.1  # seconds between checks for a shutdown of the node


def as_ros_duration(d: Seconds) -> times.Duration:
    """Convert seconds to a Duration; a Duration is returned unchanged."""
    return d if isinstance(d, times.Duration) else rospy.Duration.from_sec(d)


def as_float_duration(d: Seconds) -> float:
    """Convert a Duration to seconds; a number is returned unchanged."""
    return d.to_sec() if isinstance(d, times.Duration) else d


class Timeout:
    """Calls a function ``duration`` after the last ``reset``, unless cancelled earlier."""

    def __init__(self, duration: Seconds, on_timeout: Callback | None = None) -> None:
        self.duration = duration
        self.on_timeout = on_timeout
        self.deadline = time.monotonic()
        self.timer: threading.Timer | None = None

    def reset(self) -> Timeout:
        """Restart the timeout; return self."""
        self.cancel()
        seconds = as_float_duration(self.duration)
        self.deadline = time.monotonic() + seconds
        if self.on_timeout is not None:
            self.timer = threading.Timer(seconds, self.on_timeout)
            self.timer.daemon = True
            self.timer.start()
        return self

    def cancel(self) -> None:
        """Cancel the timeout."""
        if self.timer is not None:
            self.timer.cancel()

    def left(self) -> times.Duration:
        """Return the time until the deadline, or zero if it has passed."""
        return rospy.Duration.from_sec(max(0.0, self.deadline - time.monotonic()))


class Bond:
    """One endpoint of a bond. ``start`` waits for the peer, a Bond in another node with the same topic and ID."""

    def __init__(
        self, topic: str, id: str, on_broken: Callback | None = None, on_formed: Callback | None = None
    ) -> None:
        """Create an endpoint without starting it. Callbacks are called without holding a lock."""
        self.topic = topic
        self.id = id
        self.instance_id = str(uuid.uuid4())
        self.sister_instance_id: str | None = None
        self.on_broken = on_broken
        self.on_formed = on_formed
        self.is_shutdown = False
        self.sister_died_first = False
        self.pending_callbacks: list[Callback] = []
        self.lock = threading.RLock()
        self.condition = threading.Condition(self.lock)

        self._state = State.WAITING
        self._has_started = False
        self._seconds: dict[Event, Seconds] = {
            Event.CONNECT_TIMEOUT: Constants.DEFAULT_CONNECT_TIMEOUT,
            Event.HEARTBEAT_TIMEOUT: Constants.DEFAULT_HEARTBEAT_TIMEOUT,
            Event.DISCONNECT_TIMEOUT: Constants.DEFAULT_DISCONNECT_TIMEOUT,
        }
        # The active timeouts' deadlines on the monotonic clock.
        self._deadlines: dict[Event, float] = {}
        self._heartbeat_period: float = Constants.DEFAULT_HEARTBEAT_PERIOD
        self.sub: rospy.Subscriber[Status] | None = None
        self.thread: threading.Thread | None = None
        # queue_size=1: only the newest heartbeat is useful.
        self.pub: rospy.Publisher[Status] = rospy.Publisher(topic, Status, queue_size=1)

    def __repr__(self) -> str:
        return f"[Bond {self.id}, Instance {self.instance_id} ({self._state.value})]"

    def __del__(self) -> None:
        # If __init__ failed, ``pub`` does not exist and there is nothing to shut down.
        if hasattr(self, "pub"):
            self.shutdown()

    # --- timeouts, which can be changed until start()

    def get_connect_timeout(self) -> Seconds:
        """Return the maximum time for the bond to form."""
        return self._seconds[Event.CONNECT_TIMEOUT]

    def set_connect_timeout(self, dur: Seconds) -> None:
        """Set the maximum time for the bond to form."""
        self._set(Event.CONNECT_TIMEOUT, dur)

    connect_timeout = property(get_connect_timeout, set_connect_timeout)

    def get_heartbeat_timeout(self) -> Seconds:
        """Return the maximum time between heartbeats from the peer."""
        return self._seconds[Event.HEARTBEAT_TIMEOUT]

    def set_heartbeat_timeout(self, dur: Seconds) -> None:
        """Set the maximum time between heartbeats from the peer."""
        self._set(Event.HEARTBEAT_TIMEOUT, dur)

    heartbeat_timeout = property(get_heartbeat_timeout, set_heartbeat_timeout)

    def get_disconnect_timeout(self) -> Seconds:
        """Return the maximum time for the peer to confirm that the bond is broken."""
        return self._seconds[Event.DISCONNECT_TIMEOUT]

    def set_disconnect_timeout(self, dur: Seconds) -> None:
        """Set the maximum time for the peer to confirm that the bond is broken."""
        self._set(Event.DISCONNECT_TIMEOUT, dur)

    disconnect_timeout = property(get_disconnect_timeout, set_disconnect_timeout)

    def get_heartbeat_period(self) -> float:
        """Return the interval between heartbeats in seconds."""
        return self._heartbeat_period

    def set_heartbeat_period(self, per: Seconds) -> None:
        """Set the interval between heartbeats in seconds."""
        assert not self._has_started, "the bond has started"
        self._heartbeat_period = as_float_duration(per)

    heartbeat_period = property(get_heartbeat_period, set_heartbeat_period)

    def _set(self, timeout: Event, seconds: Seconds) -> None:
        assert not self._has_started, "the bond has started"
        self._seconds[timeout] = seconds

    # --- public methods

    def start(self) -> None:
        """Start a thread that sends heartbeats and waits for the peer."""
        with self.lock:
            self._run_timeout(Event.CONNECT_TIMEOUT)
            self.sub = rospy.Subscriber(self.topic, Status, self._on_bond_status)
            self.thread = threading.Thread(name=f"bond {self.id}", target=self._run, daemon=True)
            self.thread.start()
            self._has_started = True

    def set_formed_callback(self, on_formed: Callback | None) -> None:
        """Set the callback to call when the bond forms."""
        with self.lock:
            self.on_formed = on_formed

    def set_broken_callback(self, on_broken: Callback | None) -> None:
        """Set the callback to call when the bond breaks."""
        with self.lock:
            self.on_broken = on_broken

    def wait_until_formed(self, timeout: Seconds | None = None) -> bool:
        """Wait until the bond has formed or is broken; return False after ``timeout`` (None or 0: no timeout)."""
        return self._wait(lambda: self._state is not State.WAITING, timeout)

    def wait_until_broken(self, timeout: Seconds | None = None) -> bool:
        """Wait until the bond breaks, even if it never forms; return False after ``timeout`` (None or 0: no timeout)."""
        return self._wait(lambda: self._state is State.DEAD, timeout)

    def is_broken(self) -> bool:
        """Return whether the bond is broken."""
        with self.lock:
            return self._state is State.DEAD

    def break_bond(self) -> None:
        """Break the bond and notify the peer."""
        with self.lock:
            self._handle(Event.DIE)
            self._publish(False)
        self._flush_pending_callbacks()

    def shutdown(self) -> None:
        """Break the bond and unregister from the topic."""
        with self.lock:
            if self.is_shutdown:
                return
            self.is_shutdown = True
            if self._state is not State.DEAD:
                self.break_bond()
            self._deadlines.clear()
            self.condition.notify_all()
        if self.sub is not None:
            self.sub.unregister()
        self.pub.unregister()

    def _wait(self, has_come: Callable[[], bool], timeout: Seconds | None) -> bool:
        end = time.monotonic() + as_float_duration(timeout) if timeout else None
        with self.lock:
            while not has_come() and not rospy.is_shutdown():
                left = _LOOK if end is None else min(_LOOK, end - time.monotonic())
                if left <= 0:
                    break
                self.condition.wait(left)
            return has_come()

    # --- messages from and to the peer

    def _on_bond_status(self, msg: Status) -> None:
        if msg.id != self.id or msg.instance_id == self.instance_id:
            return
        with self.lock:
            if not self.sister_instance_id:
                self.sister_instance_id = msg.instance_id
            if msg.instance_id != self.sister_instance_id:
                rospy.logerr(
                    f"More than two locations are trying to use a single bond (topic: {self.topic}, id: {self.id}).  "
                    "You should only instantiate at most two bond instances for each (topic, id) pair."
                )
                return
            self._handle(Event.SISTER_ALIVE if msg.active else Event.SISTER_DEAD)
            if not msg.active and self.sister_died_first:
                # The peer waits for this confirmation.
                self._publish(False)
        self._flush_pending_callbacks()

    def _publish(self, active: bool) -> None:
        message = Status(
            id=self.id,
            instance_id=self.instance_id,
            active=active,
            heartbeat_timeout=as_float_duration(self._seconds[Event.HEARTBEAT_TIMEOUT]),
            heartbeat_period=self._heartbeat_period,
        )
        message.header.stamp = rospy.Time.now()
        # The node may be shutting down.
        with suppress(rospy.ROSException):
            self.pub.publish(message)

    # --- the state machine and its thread, which sends heartbeats and handles expired timeouts

    def _handle(self, event: Event) -> None:
        self._state, actions = next_state(self._state, event)
        for action in actions:
            self._act(action)
        if actions:
            self.condition.notify_all()

    def _act(self, action: Action) -> None:
        if action is Action.CONNECTED:
            self._deadlines.pop(Event.CONNECT_TIMEOUT, None)
            self.pending_callbacks += [self.on_formed] if self.on_formed else []
        elif action is Action.HEARTBEAT:
            self._run_timeout(Event.HEARTBEAT_TIMEOUT)
        elif action is Action.SISTER_DIED:
            self.sister_died_first = True
        elif action is Action.START_DYING:
            self._deadlines.pop(Event.HEARTBEAT_TIMEOUT, None)
            self._run_timeout(Event.DISCONNECT_TIMEOUT)
        elif action is Action.DEATH:
            self._deadlines.clear()
            self.pending_callbacks += [self.on_broken] if self.on_broken else []

    def _run_timeout(self, timeout: Event) -> None:
        self._deadlines[timeout] = time.monotonic() + as_float_duration(self._seconds[timeout])

    def _run(self) -> None:
        next_beat = time.monotonic()
        while True:
            with self.lock:
                if self.is_shutdown or self._state is State.DEAD or rospy.is_shutdown():
                    return
                now = time.monotonic()
                is_dying = self._state is State.AWAIT_DEATH
                if is_dying or now >= next_beat:
                    self._publish(not is_dying)
                    next_beat = now + (Constants.DEAD_PUBLISH_PERIOD if is_dying else self._heartbeat_period)
                over = [event for event, deadline in self._deadlines.items() if deadline <= now]
                if not over:
                    self.condition.wait(max(0.0, min([next_beat, *self._deadlines.values()]) - now))
            for event in over:
                self._on_timeout(event)
            self._flush_pending_callbacks()

    def _on_timeout(self, event: Event) -> None:
        if event is Event.HEARTBEAT_TIMEOUT and self._is_disabled():
            rospy.logwarn(
                f"Heartbeat timeout is disabled.  Not breaking bond (topic: {self.topic}, id: {self.id})"
            )
            with self.lock:
                self._run_timeout(event)
            return
        with self.lock:
            # Check the deadline again: a message may have restarted the timeout since it expired.
            deadline = self._deadlines.get(event)
            if deadline is not None and deadline <= time.monotonic():
                del self._deadlines[event]
                self._handle(event)

    def _is_disabled(self) -> bool:
        try:
            return bool(rospy.get_param(Constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM, False))
        except (MinirospyError, OSError):
            return False

    def _flush_pending_callbacks(self) -> None:
        with self.lock:
            callbacks, self.pending_callbacks = self.pending_callbacks, []
        for callback in callbacks:
            callback()
