"""``rosrun controller_manager spawner``: load and start controllers, and stop and unload them on exit.

Source: http://wiki.ros.org/controller_manager.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

from controller_manager_msgs.srv import (
    LoadController,
    SwitchController,
    SwitchControllerRequest,
    UnloadController,
)
from std_msgs.msg import Bool

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.ros.rosparam.rosparam import RosParamException, load_file, set_param_raw

__all__ = ["main", "new_parser"]

_SERVICES = ("load_controller", "switch_controller", "unload_controller")
_MESSAGE_SECONDS = 1.0  # seconds to wait, so that the manager's log appears before the spawner's, as in ROS


def new_parser() -> argparse.ArgumentParser:
    """Return the program's parser."""
    parser = argparse.ArgumentParser(prog="spawner", description="Controller spawner")
    parser.add_argument("--stopped", action="store_true", help="loads controllers, but does not start them")
    parser.add_argument(
        "--wait-for",
        metavar="topic",
        help='does not load or start controllers until it hears "True" on a topic (Bool)',
    )
    parser.add_argument("--namespace", metavar="ns", help="namespace of the controller_manager services")
    parser.add_argument(
        "--timeout",
        metavar="T",
        type=float,
        default=30,
        help="how long to wait for controller_manager services when starting up [s] (default: 30). <=0 waits indefinitely.",
    )
    parser.add_argument(
        "--no-timeout",
        action="store_true",
        help="wait for controller_manager services indefinitely (same as `--timeout 0`)",
    )
    parser.add_argument("--shutdown-timeout", help="DEPRECATED: this argument has no effect.")
    parser.add_argument("controllers", metavar="controller", nargs="+", help="controllers to load")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program; return 1 if a call of a service fails, but 0 if there is no controller manager."""
    arguments = new_parser().parse_args(rospy.myargv()[1:] if argv is None else argv)
    rospy.init_node("spawner", anonymous=True)
    if arguments.shutdown_timeout is not None:
        rospy.logwarn("DEPRECATION warning: --shutdown-timeout has no effect.")
    namespace = arguments.namespace or ""
    if namespace and not namespace.endswith("/"):
        namespace += "/"
    timeout = None if arguments.no_timeout or arguments.timeout <= 0 else arguments.timeout

    spawner = _Spawner(f"{namespace}controller_manager/")
    try:
        if not spawner.wait_for_services(timeout):
            return 0
        if arguments.wait_for:
            _wait_for_true(arguments.wait_for, timeout)
        rospy.on_shutdown(spawner.take_down)
        spawner.load(_controllers(arguments.controllers))
        if not (rospy.is_shutdown() or arguments.stopped):
            spawner.start()
        rospy.spin()
    except rospy.ROSInterruptException:
        pass
    except (rospy.ServiceException, RosParamException) as error:
        rospy.logerr("%s", error)
        return 1
    return 0


class _Spawner:
    """Loads, starts and stops controllers through the manager's services."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._load = rospy.ServiceProxy(prefix + "load_controller", LoadController)
        self._switch = rospy.ServiceProxy(prefix + "switch_controller", SwitchController)
        self._unload = rospy.ServiceProxy(prefix + "unload_controller", UnloadController)
        self._loaded: list[str] = []

    def wait_for_services(self, timeout: float | None) -> bool:
        """Return whether all services appear within ``timeout`` seconds, excluding the time before the first /clock message."""
        while True:
            try:
                for name in _SERVICES:
                    rospy.loginfo("Controller Spawner: Waiting for service " + self._prefix + name)
                    rospy.wait_for_service(self._prefix + name, timeout=timeout)
                return True
            except rospy.ROSException:
                is_early = rospy.get_param("/use_sim_time", False) and rospy.get_rostime().is_zero()
                if is_early and not rospy.is_shutdown_requested():
                    rospy.loginfo("Waiting for /clock to be available...")
                    continue
                rospy.logwarn(
                    "Controller Spawner couldn't find the expected controller_manager ROS interface."
                )
                return False

    def load(self, names: Sequence[str]) -> None:
        """Load the controllers, omitting those that fail."""
        for name in names:
            rospy.loginfo("Loading controller: " + name)
            if self._load(name).ok:
                self._loaded.append(name)
            else:
                time.sleep(_MESSAGE_SECONDS)
                rospy.logerr("Failed to load %s", name)
        rospy.loginfo("Controller Spawner: Loaded controllers: " + ", ".join(self._loaded))

    def start(self) -> None:
        """Start all loaded controllers, or none of them."""
        names = ", ".join(self._loaded)
        if self._switch(self._loaded, [], SwitchControllerRequest.STRICT, False, 0.0).ok:
            rospy.loginfo("Started controllers: " + names)
        else:
            rospy.logerr("Failed to start controllers: " + names)

    def take_down(self) -> None:
        """Stop and unload the controllers."""
        rospy.loginfo("Shutting down spawner. Stopping and unloading controllers...")
        try:
            rospy.loginfo("Stopping all controllers...")
            if not self._loaded:
                return  # the manager may be busy loading the controller and would not respond
            self._switch([], self._loaded, SwitchControllerRequest.STRICT, False, 0.0)
            rospy.loginfo("Unloading all loaded controllers...")
            for name in reversed(self._loaded):
                rospy.loginfo("Trying to unload %s", name)
                self._unload(name)
                rospy.loginfo("Succeeded in unloading %s", name)
        except (rospy.ServiceException, rospy.ROSException) as error:
            rospy.logwarn("Controller Spawner error while taking down controllers: %s", error)


def _controllers(words: Sequence[str]) -> list[str]:
    """Return the controllers' names. If a word is a file, set its parameters and use the names in it."""
    names: list[str] = []
    for word in words:
        if not Path(word).is_file():
            names.append(word)
            continue
        for values, _ in load_file(word):
            if isinstance(values, dict):
                set_param_raw("", values)
                names += map(str, values)
    return names


def _wait_for_true(topic: str, timeout: float | None) -> None:
    """Wait until a Bool on the topic is true; warn once if no message arrives within ``timeout`` seconds."""
    has_message, is_true = SignalSafeEvent(), SignalSafeEvent()

    def on_message(message: Bool) -> None:
        has_message.set()
        if message.data:
            is_true.set()

    subscriber = rospy.Subscriber(topic, Bool, on_message)

    def interrupt() -> None:
        has_message.set()
        is_true.set()

    with rospy.interrupting(interrupt):
        if not wait_for_event(has_message, timeout):
            rospy.logwarn(f'Controller Spawner hasn\'t heard anything from its "wait for" topic ({topic})')
        wait_for_event(is_true, None)
    subscriber.unregister()
    if rospy.is_shutdown():
        raise rospy.ROSInterruptException("rospy shutdown")
