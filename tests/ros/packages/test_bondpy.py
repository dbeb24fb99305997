"""bondpy: the state machine, and endpoints in one process. tests/interop uses real ROS's endpoints."""

from __future__ import annotations

import subprocess
import sys

import pytest

from minirospy.ros.bondpy.bondpy.machine import Action, Event, State, next_state

PROGRAM = """
import logging, queue, threading
import rospy
from bond.msg import Status
from bondpy.bondpy import Bond, Timeout, as_float_duration, as_ros_duration

rospy.init_node("bonds")
said = queue.Queue()
print(as_ros_duration(1.5), as_float_duration(rospy.Duration(2)), Timeout(5).left().to_sec() == 0)
one = Bond("bonds", "pair", lambda: said.put("one broken"), lambda: said.put("one formed"))
other = Bond("bonds", "pair", lambda: said.put("other broken"), lambda: said.put("other formed"))
one.set_heartbeat_timeout(rospy.Duration(5))
print(one.connect_timeout, one.heartbeat_timeout.to_sec(), one.disconnect_timeout, one.heartbeat_period)
print(one.wait_until_formed(rospy.Duration(0.1)), one.is_broken())
for bond in one, other:
    bond.start()
try:
    one.connect_timeout = 3
except AssertionError as error:
    print(error)
print(one.wait_until_formed(30), other.wait_until_formed())
print(sorted(said.get(timeout=30) for _ in range(2)), one.wait_until_broken(0.1))

third = rospy.Publisher("bonds", Status, queue_size=1)
third.wait_for_subscribers()
third.publish(Status(id="pair", instance_id="a third one", active=False))
third.publish(Status(id="another pair", instance_id="a fourth one", active=False))
print(one.is_broken(), repr(one) == f"[Bond pair, Instance {one.instance_id} (SM.Alive)]")

other.break_bond()
print(one.wait_until_broken(30), other.wait_until_broken(30))
print(sorted(said.get(timeout=30) for _ in range(2)))

alone = Bond("bonds", "alone", lambda: said.put("alone broken"), lambda: said.put("alone formed"))
alone.break_bond()
print(alone.is_broken(), alone.wait_until_formed(1), said.get(timeout=30))
alone.shutdown()
alone.shutdown()
for bond in one, other:
    bond.shutdown()

rospy.set_param("/bond_disable_heartbeat_timeout", True)
held = Bond("bonds", "held")
held.heartbeat_timeout = 0.1
held.start()
disabled = threading.Event()

def watch(record):
    if record.getMessage().startswith("Heartbeat timeout is disabled."):
        disabled.set()
    return True

logging.getLogger("rosout").addFilter(watch)
third.wait_for_subscribers()
while not held.wait_until_formed(0.2):
    third.publish(Status(id="held", instance_id="silent", active=True))
disabled.wait(60)
print(held.wait_until_broken(0.5))
rospy.set_param("/bond_disable_heartbeat_timeout", False)
print(held.wait_until_broken(30))
"""
PRINTED = """\
1500000000 2.0 True
10.0 5.0 2.0 1.0
False False
the bond has started
True True
['one formed', 'other formed'] False
False True
True True
['one broken', 'other broken']
True True alone broken
False
True
"""


def test_ends_form_and_break(master: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.stdout == PRINTED, done.stderr
    assert "More than two locations are trying to use a single bond (topic: bonds, id: pair)" in done.stderr
    assert "Heartbeat timeout is disabled.  Not breaking bond (topic: bonds, id: held)" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("events", "state", "actions"),
    [
        ([Event.SISTER_ALIVE], State.ALIVE, [Action.CONNECTED, Action.HEARTBEAT]),
        ([Event.SISTER_DEAD], State.DEAD, [Action.CONNECTED, Action.SISTER_DIED, Action.DEATH]),
        ([Event.CONNECT_TIMEOUT, Event.SISTER_ALIVE], State.DEAD, [Action.DEATH]),
        ([Event.DIE, Event.DIE], State.DEAD, [Action.DEATH]),
        (
            [Event.SISTER_ALIVE, Event.DIE, Event.SISTER_ALIVE, Event.HEARTBEAT_TIMEOUT],
            State.AWAIT_DEATH,
            None,
        ),
        ([Event.SISTER_ALIVE, Event.DIE, Event.DISCONNECT_TIMEOUT], State.DEAD, None),
        ([Event.SISTER_ALIVE, Event.DIE, Event.SISTER_DEAD], State.DEAD, None),
        ([Event.SISTER_ALIVE, Event.HEARTBEAT_TIMEOUT], State.DEAD, None),
        ([Event.SISTER_ALIVE, Event.CONNECT_TIMEOUT], State.ALIVE, None),
    ],
)
def test_events_lead_to_states(events: list[Event], state: State, actions: list[Action] | None) -> None:
    found, done = State.WAITING, []
    for event in events:
        found, more = next_state(found, event)
        done += more
    assert found is state
    if actions is not None:
        assert done == actions


def test_dead_bond_stays_dead() -> None:
    assert all(next_state(State.DEAD, event) == (State.DEAD, ()) for event in Event)
