"""Tools of the programs that test controllers: a node, a robot's hardware, and a controller whose time the program holds."""

from __future__ import annotations

import json
import threading
from typing import Any

import rospy

rospy.init_node("rig", argv=[])


def show(value: object) -> None:
    """Print the value that the test gets."""
    print(json.dumps(value))


class Received:
    """The messages of a topic."""

    def __init__(self, topic: str, message_class: Any) -> None:
        self._changed = threading.Condition()
        self.messages: list[Any] = []
        self._subscriber = rospy.Subscriber(topic, message_class, self._receive)

    def _receive(self, message: Any) -> None:
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def wait(self, count: int = 1) -> Any:
        """Wait until this many messages have arrived; return the last."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.messages) >= count, 30), self.messages
            return self.messages[-1]


def wait_until(condition: Any) -> None:
    """Wait until a condition holds."""
    for _ in range(3000):
        if condition():
            return
        threading.Event().wait(0.01)
    raise AssertionError("the condition does not become true")
