"""The loop that reads the hardware, updates the controllers and writes the hardware, at a fixed rate.

A cycle: ``hardware.read``, the controllers, starting and stopping controllers, limits, ``hardware.write``. Deadlines are
absolute; a cycle that ends after the next deadline is an overrun, and the deadlines that it missed are skipped.
"""

from __future__ import annotations

import threading
import time as wall

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.times import Duration, Time
from minirospy.core.control.hardware import RobotHardware
from minirospy.core.control.manager import describe_error
from minirospy.ros.controller_manager.manager import ControllerManager

__all__ = ["ControlLoop", "run"]

_END_SECONDS = 5.0  # the longest wait for the loop's end at shutdown, in case a driver hangs


def run(hardware: RobotHardware, rate: float = 100.0, namespace: str = "") -> int:
    """Control a robot until the node shuts down; return the exit status: 1 if the hardware failed, else 0.

    ``rate``: cycles per second of ROS time. Raise ValueError if it is not positive.
    """
    loop = ControlLoop(hardware, rate, namespace)
    loop.start()
    return loop.wait()


class ControlLoop:
    """A loop in a thread of its own, with its controller manager."""

    def __init__(self, hardware: RobotHardware, rate: float = 100.0, namespace: str = "") -> None:
        if not 0 < rate < float("inf"):
            raise ValueError(
                f"the rate of the control loop is {rate}: it must be a positive number of cycles per second"
            )
        self.hardware = hardware
        self.manager = ControllerManager(hardware, namespace)
        self._period = round(1e9 / rate)  # nanoseconds
        self._stop = SignalSafeEvent()
        self._ended = SignalSafeEvent()
        self._status = 0
        self._thread = threading.Thread(target=self._run, name="control loop", daemon=True)

    def start(self) -> None:
        """Start the loop. It ends when the node shuts down, or when :meth:`stop` is called."""
        rospy.on_shutdown(self.stop)
        self._thread.start()

    def stop(self) -> None:
        """Stop the controllers and the loop, and wait for its end for at most five seconds."""
        self._stop.set()
        if threading.current_thread() is not self._thread and not self._ended.wait(_END_SECONDS):
            rospy.logerr("the control loop does not end: read() or write() of the hardware hangs")

    def wait(self) -> int:
        """Wait until the loop has ended; return the exit status: 1 if the hardware failed, else 0."""
        wait_for_event(self._ended, None)
        return self._status

    def _run(self) -> None:
        try:
            if rospy.is_wallclock():
                self._run_on_wall_time()
            else:
                self._run_on_simulated_time()
        except Exception as error:  # noqa: BLE001 - the driver's code
            self._status = 1
            rospy.logfatal("the hardware failed, so the robot is stopped: %s", describe_error(error))
        finally:
            self._end()

    def _end(self) -> None:
        """Stop the controllers, and write once more so that the driver sees that its joints are released."""
        now = rospy.get_rostime()
        self.manager.close(now)
        try:
            self.hardware.write(now, Duration(0, self._period))
            self.hardware.close()
        except Exception as error:  # noqa: BLE001 - the driver's code
            if not self._status:
                rospy.logerr("the hardware failed at the end: %s", describe_error(error))
            self._status = 1
        self._ended.set()
        if self._status:
            threading.Thread(target=rospy.signal_shutdown, args=("the hardware failed",), daemon=True).start()

    def _cycle(self, now: Time, period: Duration, is_reset: bool = False) -> None:
        self.hardware.read(now, period)
        self.manager.update(now, period, is_reset)
        self.hardware.write(now, period)

    def _run_on_wall_time(self) -> None:
        period, pause, clock = self._period, wall.sleep, wall.monotonic_ns
        last = wall.time_ns()
        deadline = clock() + period
        while not self._stop.is_set():
            if (left := deadline - clock()) > 0:
                pause(left / 1e9)
            now = wall.time_ns()
            self._cycle(Time(*divmod(now, 1_000_000_000)), Duration(0, max(0, now - last)), now < last)
            last = now
            deadline += period
            if (late := clock() - deadline) > 0:
                deadline += late // period * period

    def _run_on_simulated_time(self) -> None:
        last = 0
        while not self._stop.is_set():
            rospy.sleep(0.001)
            now = rospy.get_rostime()
            at = now.to_nsec()
            if at == last or (last and last < at < last + self._period):
                continue
            self._cycle(now, Duration(0, at - last if 0 < last < at else 0), at < last)
            last = at
