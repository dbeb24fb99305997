"""Publishes containers' structure and status, and receives the initial states for their next execution.

Topics: NAME/smach/container_structure, NAME/smach/container_status, NAME/smach/container_init.
Source: http://wiki.ros.org/smach/Tutorials/Smach%20Viewer.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

from smach_msgs.msg import SmachContainerInitialStatusCmd, SmachContainerStatus, SmachContainerStructure
from std_msgs.msg import Header

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.core.idl.protocols import Message
from minirospy.ros.rostopic import rostopic
from minirospy.ros.smach.smach.container import Container
from minirospy.ros.smach.smach.user_data import UserData
from minirospy.ros.smach_ros.smach_ros.pickled import pickle_userdata, unpickle_userdata

__all__ = [
    "INIT_TOPIC",
    "STATUS_TOPIC",
    "STRUCTURE_TOPIC",
    "ContainerProxy",
    "IntrospectionClient",
    "IntrospectionServer",
]

STATUS_TOPIC = "/smach/container_status"
INIT_TOPIC = "/smach/container_init"
STRUCTURE_TOPIC = "/smach/container_structure"

_QUEUE_SIZE = 20
_CONNECT_SECONDS = 2.0
"""Time in seconds that a command waits for a connection to the server."""
_RESEND_SECONDS = 0.3


class IntrospectionClient:
    """Finds introspection servers, and sets the initial states of their containers."""

    def get_servers(self) -> list[str]:
        """Return the names of the servers that are publishing."""
        topics = rostopic.find_by_type(SmachContainerStatus._type)
        return [topic[: topic.rfind(STATUS_TOPIC)] for topic in topics]

    def set_initial_state(
        self,
        server: str,
        path: str,
        initial_states: Sequence[str],
        initial_userdata: UserData | None = None,
        timeout: rospy.Duration | None = None,
    ) -> bool | None:
        """Set the initial states of the container at a path and add values to its userdata.

        Return whether the container confirmed the change within ``timeout``, or None without a timeout.
        """
        data = {} if initial_userdata is None else initial_userdata._data
        local_data, _ = pickle_userdata(data)
        command = SmachContainerInitialStatusCmd(
            path=path, initial_states=list(initial_states), local_data=local_data
        )
        has_answered = SignalSafeEvent()

        def check(status: SmachContainerStatus) -> None:
            if status.path == path and _is_set(status, initial_states, data):
                has_answered.set()

        subscriber = rospy.Subscriber(server + STATUS_TOPIC, SmachContainerStatus, check)
        publisher: rospy.Publisher[Message] = rospy.Publisher(
            server + INIT_TOPIC, SmachContainerInitialStatusCmd, queue_size=1
        )
        try:
            _wait_for_connection(publisher)
            publisher.publish(command)
            if timeout is None:
                return None
            end = rospy.Time.now() + timeout
            while not has_answered.wait(_RESEND_SECONDS) and rospy.Time.now() < end:
                publisher.publish(command)
            return has_answered.is_set()
        finally:
            subscriber.unregister()


def _wait_for_connection(publisher: rospy.Publisher[Message]) -> None:
    pause = SignalSafeEvent()
    for _ in range(int(_CONNECT_SECONDS / 0.02)):
        if publisher.get_num_connections() or rospy.is_shutdown():
            return
        pause.wait(0.02)


def _is_set(status: SmachContainerStatus, initial_states: Sequence[str], data: dict[str, object]) -> bool:
    if not set(initial_states) <= set(status.initial_states):
        return False
    try:
        found = unpickle_userdata(status.local_data)
    except ValueError:
        return False
    return all(key in found and found[key] == value for key, value in data.items())


class ContainerProxy:
    """Publishes the structure and status of one container on a server's topics."""

    def __init__(
        self,
        server_name: str,
        container: Container,
        path: str,
        update_rate: rospy.Duration = rospy.Duration(2.0),  # noqa: B008 - a Duration does not change
    ) -> None:
        """Create the proxy. ``update_rate`` is the interval between status messages while the status does not change."""
        self._path = path
        self._container = container
        self._update_rate = update_rate
        self._status_pub_lock = threading.Lock()
        self._has_stopped = SignalSafeEvent()
        self._left_out: set[str] = set()
        self._init_cmd = rospy.Subscriber(
            server_name + INIT_TOPIC, SmachContainerInitialStatusCmd, self._init_cmd_cb
        )

        self._structure_pub: rospy.Publisher[Message] = rospy.Publisher(
            server_name + STRUCTURE_TOPIC, SmachContainerStructure, queue_size=_QUEUE_SIZE
        )
        self._status_pub: rospy.Publisher[Message] = rospy.Publisher(
            server_name + STATUS_TOPIC, SmachContainerStatus, queue_size=_QUEUE_SIZE
        )
        container.register_transition_cb(self._transition_cb)
        self._thread = threading.Thread(
            name=f"{server_name}:introspection", target=self._publish_regularly, daemon=True
        )

    def start(self) -> None:
        """Start publishing periodically."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the periodic messages. Transitions are still published."""
        self._has_stopped.set()

    def _publish_regularly(self) -> None:
        while not rospy.is_shutdown() and not self._has_stopped.is_set():
            self._publish_status("HEARTBEAT")
            self._publish_structure("HEARTBEAT")
            self._has_stopped.wait(self._update_rate.to_sec())

    def _publish_structure(self, info_str: str = "") -> None:
        edges = self._container.get_internal_edges()
        message = SmachContainerStructure(
            Header(stamp=rospy.Time.now()),
            self._path,
            list(self._container.get_children()),
            [str(outcome) for outcome, _, _ in edges],
            [str(label) for _, label, _ in edges],
            [str(target) for _, _, target in edges],
            list(self._container.get_registered_outcomes()),
        )
        self._publish(self._structure_pub, message)

    def _publish_status(self, info_str: str = "") -> None:
        with self._status_pub_lock:
            local_data, left_out = pickle_userdata(self._container.userdata._data)
            for key in set(left_out) - self._left_out:
                rospy.logwarn(
                    f"Userdata key '{key}' of '{self._path}' cannot be pickled, and is not published."
                )
            self._left_out.update(left_out)
            message = SmachContainerStatus(
                Header(stamp=rospy.Time.now()),
                self._path,
                self._container.get_initial_states(),
                self._container.get_active_states(),
                local_data,
                info_str,
            )
            self._publish(self._status_pub, message)

    def _publish(self, publisher: rospy.Publisher[Message], message: Message) -> None:
        try:
            publisher.publish(message)
        except rospy.ROSException as error:
            if not rospy.is_shutdown():
                rospy.logerr(f"Publishing SMACH introspection of '{self._path}' failed: {error}")

    def _transition_cb(self, *args: object, **kwargs: object) -> None:
        self._publish_status(f"{args}, {kwargs}")

    def _init_cmd_cb(self, msg: SmachContainerInitialStatusCmd) -> None:
        if msg.path != self._path:
            return
        children = self._container.get_children()
        if not set(msg.initial_states) <= set(children):
            rospy.logerr(
                f"Attempting to set initial state in container '{self._path}' to '{msg.initial_states}', but this container "
                f"only has states: {children}"
            )
            return
        userdata = UserData()
        try:
            userdata._data.update(unpickle_userdata(msg.local_data))
        except ValueError as error:
            rospy.logerr(f"Attempting to set initial state in container '{self._path}': {error}")
            return
        self._container.set_initial_state(msg.initial_states, userdata)
        self._publish_status("REMOTE_INIT")


class IntrospectionServer:
    """Publishes the state of a container and of all nested containers."""

    def __init__(self, server_name: str, state: Container, path: str) -> None:
        """Create the server; ``path`` is the container's name, for example "/SM_ROOT"."""
        self._proxies: list[ContainerProxy] = []
        self._server_name = server_name
        self._state = state
        self._path = path

    def start(self) -> None:
        """Start publishing."""
        self.construct(self._server_name, self._state, self._path)

    def stop(self) -> None:
        """Stop the periodic messages. Transitions are still published."""
        for proxy in self._proxies:
            proxy.stop()

    def construct(self, server_name: str, state: Container, path: str) -> None:
        """Create the proxies for a container and all nested containers."""
        proxy = ContainerProxy(server_name, state, path)
        prefix = "" if path == "/" else path
        for label, child in state.get_children().items():
            if isinstance(child, Container):
                self.construct(server_name, child, f"{prefix}/{label}")
        proxy._publish_status("Initial state")
        proxy.start()
        self._proxies.append(proxy)

    def clear(self) -> None:
        """Remove all containers from the server."""
        self._proxies = []
