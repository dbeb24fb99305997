"""The control loop, which reads the hardware, updates the controllers and writes the hardware at a fixed rate.

The steps of a cycle: ``hardware.read``, updating controllers, starting and stopping controllers, limits, ``hardware.write``.
Deadlines are absolute. A cycle that finishes after the next deadline is an overrun, and the deadlines that it missed are skipped.
"""

from __future__ import annotations

import gc
import sys
import threading
import time as wall
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import ROSTimeMovedBackwardsException, UrdfError
from minirospy.base.times import Duration, Time
from minirospy.client.session import current_session
from minirospy.core.control.hardware import RobotHardware
from minirospy.core.control.limits import JointLimits, LimitEnforcer, read_limits
from minirospy.core.control.manager import describe_error
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.timing import CycleTimes, spread
from minirospy.core.urdf.read import parse_robot
from minirospy.ros.controller_manager.manager import ControllerManager, find_description

__all__ = ["ControlLoop", "limits_of_parameters", "run"]

_BILLION = 1_000_000_000
_END_SECONDS = 5.0  # maximum seconds to wait for the loop to finish at shutdown, in case a driver hangs
_SLEEP_SECONDS = 0.1  # maximum seconds of one sleep, so that a slow loop notices a stop request
_REPORT_SECONDS = 1.0
_WARN_SECONDS = 10.0  # seconds between warnings about overruns or non-finite commands
_WARN_SHARE = 0.05  # largest share of overrun cycles without a warning; a busy computer delays a few
# Maximum time in seconds that another thread holds the GIL; Python's default is 5 ms.
_SWITCH_SECONDS = 0.0002


def run(hardware: RobotHardware, rate: float = 100.0, namespace: str = "") -> int:
    """Control a robot until the node shuts down; return the exit status: 1 if the hardware failed, else 0.

    ``rate``: cycles per second of ROS time. Raise ValueError if it is not positive, or if a joint limit is invalid.
    """
    loop = ControlLoop(hardware, rate, namespace)
    sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_SECONDS))
    gc.collect()
    gc.freeze()  # exclude the imported modules from later garbage collections
    loop.start()
    return loop.wait()


class ControlLoop:
    """Runs a control loop and its controller manager in a thread. ``limits`` default to those in the node's parameters."""

    def __init__(
        self,
        hardware: RobotHardware,
        rate: float = 100.0,
        namespace: str = "",
        limits: Mapping[str, JointLimits] | None = None,
    ) -> None:
        if not 0 < rate < float("inf"):
            raise ValueError(f"the rate of the control loop is {rate}: it must be a positive number")
        self.hardware = hardware
        self.manager = ControllerManager(hardware, namespace)
        if limits is None:
            limits = limits_of_parameters(hardware, self.manager.namespace)
        self._limits = LimitEnforcer(hardware.joints.values(), limits)
        self._times = CycleTimes(round(_BILLION / rate))
        self._invalid: dict[str, None] = {}  # keys: joints with non-finite commands since the last report
        self._stop = SignalSafeEvent()
        self._ended = SignalSafeEvent()
        self._status = 0
        self._thread = threading.Thread(target=self._run, name="control loop", daemon=True)

    def start(self) -> None:
        """Start the loop. It runs until the node shuts down or :meth:`stop` is called."""
        rospy.on_shutdown(self.stop)
        threading.Thread(target=self._report, name="control loop diagnostics", daemon=True).start()
        self._thread.start()

    def stop(self) -> None:
        """Stop the controllers and the loop, and wait up to five seconds for the loop to finish."""
        self._stop.set()
        if threading.current_thread() is not self._thread and not self._ended.wait(_END_SECONDS):
            rospy.logfatal(
                "the control loop does not end: a controller, or read() or write() of the hardware, hangs"
            )
            self._status = 1
            self._ended.set()

    def wait(self) -> int:
        """Wait until the loop has finished; return 1 if the hardware failed or hangs, else 0."""
        wait_for_event(self._ended, None)
        return self._status

    def _run(self) -> None:
        try:
            if rospy.is_wallclock():
                self._run_on_wall_time()
            else:
                self._run_on_simulated_time()
        except BaseException as error:  # noqa: BLE001 - the driver's code, which may call sys.exit
            self._status = 1
            rospy.logfatal("the hardware failed, so the robot is stopped: %s", describe_error(error))
        try:
            self._end()
        finally:
            self._stop.set()
            if self._status:
                rospy.signal_shutdown("the hardware failed")
            self._ended.set()

    def _end(self) -> None:
        """Stop the controllers, then call the driver's write() a last time so that it sees the released joints."""
        now = rospy.get_rostime()
        period = Duration(*divmod(self._times.period, _BILLION))
        self.manager.stop(now)
        self._log_invalid()
        methods: tuple[Callable[[], object], ...] = (
            partial(self.hardware.write, now, period),
            partial(self.manager.close, now),
            self.hardware.close,
        )
        for method in methods:
            try:
                method()
            except BaseException as error:  # noqa: BLE001 - the driver's code
                if not self._status:
                    rospy.logfatal("the hardware failed at the end: %s", describe_error(error))
                self._status = 1

    def _cycle(self, now: Time, period: Duration, is_reset: bool = False) -> None:
        self.hardware.read(now, period)
        self.manager.update(now, period, is_reset)
        if invalid := self._limits.enforce(period):
            self._invalid.update(dict.fromkeys(invalid))
        self.hardware.write(now, period)

    def _run_on_wall_time(self) -> None:
        times, clock, now_of_wall, stop = self._times, wall.monotonic_ns, wall.time_ns, self._stop
        period = times.period
        last_wall, last = now_of_wall(), clock()
        deadline = last + period
        while not stop.is_set():
            while (left := deadline - clock()) > 0:
                wall.sleep(min(left / _BILLION, _SLEEP_SECONDS))
                if stop.is_set():
                    return
            now, started = now_of_wall(), clock()
            if is_reset := now < last_wall:
                self._log_jump(last_wall - now)
            # Measure the period with the monotonic clock, because the system time may change.
            self._cycle(Time(*divmod(now, _BILLION)), Duration(*divmod(started - last, _BILLION)), is_reset)
            last_wall, last = now, started
            ended = clock()
            late, deadline = started - deadline, deadline + period
            times.add(late, ended - started, ended > deadline)
            if ended > deadline:
                deadline += (ended - deadline) // period * period

    def _run_on_simulated_time(self) -> None:
        times, clock = self._times, current_session().clock
        period = times.period
        last = deadline = clock.now()
        while not self._stop.is_set():
            try:
                # Limit the wait to one period: the system time may have jumped back during the last cycle.
                if not clock.sleep(min(max(1, deadline - clock.now()), period), self._stop):
                    return
            except ROSTimeMovedBackwardsException:
                pass
            now, started = clock.now(), wall.monotonic_ns()
            if is_reset := now < last:
                self._log_jump(last - now)
            if is_reset or not last:
                deadline = now
            elapsed = now - last if last and not is_reset else 0
            self._cycle(Time(*divmod(now, _BILLION)), Duration(*divmod(elapsed, _BILLION)), is_reset)
            last = now
            late, deadline = now - deadline, deadline + period
            times.add(late, wall.monotonic_ns() - started, clock.now() > deadline)
            if now >= deadline:
                deadline += (now - deadline) // period * period + period

    def _log_jump(self, nanoseconds: int) -> None:
        rospy.logwarn("time jumped back by %.3f s: the controllers are started again", nanoseconds / _BILLION)

    def _report(self) -> None:
        """Publish the loop's timing once per second, in a separate thread."""
        try:
            publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
            known, warned = 0, -_WARN_SECONDS
            while not self._stop.wait(_REPORT_SECONDS):
                overruns, (late, busy) = self._times.overruns - known, self._times.take()
                status = self._status_message(overruns, late, busy)
                message = DiagnosticArray(status=[status])
                message.header.stamp = rospy.get_rostime()
                publisher.publish(message)
                known = self._times.overruns
                if overruns > len(busy) * _WARN_SHARE and wall.monotonic() - warned >= _WARN_SECONDS:
                    warned = wall.monotonic()
                    rospy.logwarn("%s", status.message)
                self._log_invalid()
        except rospy.ROSException:
            return  # the node is shutting down
        if not rospy.is_shutdown_requested():  # during a shutdown, rospy unregisters all topics at once
            publisher.unregister()

    def _log_invalid(self) -> None:
        """Log the joints with non-finite commands, if any."""
        if self._invalid:
            invalid, self._invalid = self._invalid, {}
            rospy.logerr_throttle(
                _WARN_SECONDS, f"commands that are not finite were replaced, joints: {', '.join(invalid)}"
            )

    def _status_message(self, overruns: int, late: Sequence[int], busy: Sequence[int]) -> DiagnosticStatus:
        times = self._times
        delays, durations = spread(late), spread(busy)
        name, namespace = f"{rospy.get_name()[1:]}: control loop", self.manager.namespace
        if namespace != "/" + rospy.get_namespace().strip("/"):
            name += f" {namespace}"  # distinguishes the loops if a node controls several robots
        status = DiagnosticStatus(name=name, message="OK", hardware_id="none")
        if overruns:
            status.level = DiagnosticStatus.WARN
            status.message = (
                f"control loop: {overruns} of {len(busy)} cycles ended after the next one was due; "
                f"the period is {times.period / 1e6:g} ms, the longest cycle took {durations.longest / 1e6:.1f} ms, "
                f"the latest one began {delays.longest / 1e6:.1f} ms late"
            )
        values = {
            "rate (Hz)": f"{_BILLION / times.period:g}",
            "cycles": str(times.cycles),
            "overruns": str(times.overruns),
            "jitter mean (us)": f"{delays.mean / 1e3:.0f}",
            "jitter p99 (us)": f"{delays.p99 / 1e3:.0f}",
            "jitter max (us)": f"{delays.longest / 1e3:.0f}",
            "cycle mean (us)": f"{durations.mean / 1e3:.0f}",
            "cycle p99 (us)": f"{durations.p99 / 1e3:.0f}",
            "cycle max (us)": f"{durations.longest / 1e3:.0f}",
        }
        status.values = [KeyValue(key, value) for key, value in values.items()]
        return status


def limits_of_parameters(hardware: RobotHardware, namespace: str) -> dict[str, JointLimits]:
    """Return a robot's joint limits from robot_description, overridden by the parameters NAMESPACE/joint_limits.

    Raise ValueError if a limit is invalid.
    """
    root = f"{namespace.rstrip('/')}/joint_limits"
    values = rospy.get_param(root, {})
    parameters = Parameters(root, values if isinstance(values, dict) else {})
    text = find_description(namespace)
    joints = {}
    if text is not None:
        try:
            joints = dict(parse_robot(text).joints)
        except UrdfError as error:
            raise ValueError(f"robot_description: {error}") from error
    limits = {}
    for name, joint in hardware.joints.items():
        if not joint.interfaces:
            continue
        limits[name] = read_limits(joints.get(name), parameters.below(name), name)
        if limits[name].velocity == 0:
            rospy.logwarn(
                "joint '%s' cannot move, because its velocity limit is 0: set %s/%s/max_velocity, and has_velocity_limits",
                name,
                root,
                name,
            )
    return limits
