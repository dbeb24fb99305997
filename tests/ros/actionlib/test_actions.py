"""Improvements of minirospy's actions over actionlib's; tests/referee compares the common behaviour."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

BEGIN = """
import threading, time
import actionlib, rospy
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from actionlib_msgs.msg import GoalStatus
rospy.init_node("case", argv=[], disable_rosout=True)
def execute(goal):
    if goal.goal == 3:
        while not server.is_preempt_requested() and not rospy.is_shutdown():
            time.sleep(0.001)
        server.set_preempted()
    else:
        server.set_succeeded(TestResult(goal.goal))
server = actionlib.SimpleActionServer("server", TestAction, execute, False)
server.start()
client = actionlib.SimpleActionClient("server", TestAction)
assert client.wait_for_server(rospy.Duration(30))
second = rospy.Duration(30)
"""
SERVER_THAT_DIES = """
import time, actionlib, rospy
from actionlib.msg import TestAction
rospy.init_node("other_server", argv=[], disable_rosout=True)
def got(handle):
    if handle.get_goal().goal == 3:
        handle.set_accepted()
    print("got", handle.get_goal().goal, flush=True)
    while handle.get_goal().goal == 4:  # holds the lock, so that no list with this goal is published
        time.sleep(1)
server = actionlib.ActionServer("other", TestAction, got, auto_start=False)
server.start()
print("ready", flush=True)
rospy.spin()
"""
END = """
rospy.signal_shutdown("")
print("end")
"""


def run(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", BEGIN + code + END], capture_output=True, text=True, timeout=200, check=False
    )
    assert done.stdout.endswith("end\n"), done.stdout + done.stderr
    return done.stdout[: -len("end\n")] + done.stderr


@pytest.mark.usefixtures("master")
class TestActions:
    def test_a_done_callback_sends_the_next_goal(self) -> None:
        said = run("""
over = threading.Event()
def done(state, result):
    print(result.result)
    if result.result < 5:
        client.send_goal(TestGoal(result.result + 1), done)
    else:
        over.set()
client.send_goal(TestGoal(4), done)
assert client.wait_for_result(second)
over.wait(30)
assert client.wait_for_result(second)
print(client.get_result().result)
""")
        assert said == "4\n5\n5\n"

    def test_done_callback_that_raises_does_not_block(self) -> None:
        said = run("""
import logging
class Reported(logging.Handler):
    def emit(self, record):
        reported.set()
reported = threading.Event()
def done(state, result):
    raise ValueError("bad done callback")
# The terminal's handler, which was added before this one, has written the line by then.
logging.getLogger("rosout").addHandler(Reported(logging.ERROR))
client.send_goal(TestGoal(4), done)
print(client.wait_for_result(second), client.simple_state)
# A program that shuts down before it is reported does not report it.
reported.wait(30)
""")
        assert said.startswith("True 2\n")
        assert "ValueError: bad done callback" in said

    def test_cancel_of_all_does_not_overtake_a_goal(self) -> None:
        """A goal from a third-party client is accepted after a short delay; a cancel request is delayed longer."""
        said = run("""
from types import SimpleNamespace
import minirospy.ros.actionlib.actionlib.server as module
from actionlib.msg import TestActionGoal
from actionlib_msgs.msg import GoalID
both, pauses = threading.Barrier(2), {}
def sleep(seconds):
    # Both have come by now; the one whose pause is shorter is done before the other goes on.
    pauses[threading.current_thread()] = seconds
    both.wait(30)
    for thread, pause in pauses.items():
        if pause < seconds:
            thread.join(30)
module.time = SimpleNamespace(sleep=sleep, monotonic=time.monotonic)
actions = server.action_server
goal = TestActionGoal(goal_id=GoalID(id="other-1"), goal=TestGoal(3))
threads = [
    threading.Thread(target=actions.internal_cancel_callback, args=(GoalID(),)),
    threading.Thread(target=actions.internal_goal_callback, args=(goal,)),
]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(actions.status_list[0].status.status in (GoalStatus.PREEMPTING, GoalStatus.PREEMPTED, GoalStatus.RECALLING))
""")
        assert said == "True\n"

    def test_a_cancel_of_a_goal_that_is_done_changes_nothing(self) -> None:
        said = run("""
client.send_goal_and_wait(TestGoal(4))
client.cancel_goal()
from actionlib_msgs.msg import GoalStatusArray
lists = threading.Semaphore(0)
rospy.Subscriber("server/status", GoalStatusArray, lambda message: lists.release())
assert lists.acquire(timeout=30) and lists.acquire(timeout=30)
print(client.gh.get_comm_state() == actionlib.CommState.DONE, client.get_state())
""")
        assert said == "True 3\n"

    def test_statuses_of_many_goals_are_published_less_often(self) -> None:
        """With few goals, each change publishes the list. With 600 goals, lists are at least 60 ms apart."""
        said = run("""
from types import SimpleNamespace
import minirospy.ros.actionlib.actionlib.server as module
now, delays, sizes = [1000.0], [], []
module.time = SimpleNamespace(sleep=time.sleep, monotonic=lambda: now[0])
actions = server.action_server
actions.status_list_timeout = rospy.Duration(1000)
actions._status_thread.stop()
actions._status_thread = SimpleNamespace(hurry=delays.append, stop=lambda: None)
publish = actions.publish_status_now
def publish_status_now():
    sizes.append(len(actions.status_list))
    publish()
actions.publish_status_now = publish_status_now
print({client.send_goal_and_wait(TestGoal(4), second) for _ in range(600)}, len(actions.status_list))
print(max(sizes), len(sizes) < 200, round(max(delays), 6))
now[0] += 0.05
actions.publish_status()
print(max(sizes), round(delays[-1], 6))
now[0] += 0.011
actions.publish_status()
print(max(sizes))
""")
        assert said == "{3} 600\n50 True 0.06\n50 0.01\n600\n"

    def test_timeouts_run_on_simulated_time(self) -> None:
        said = run("""
import minirospy.base.clock
from minirospy.client.session import current_session
clock = current_session().clock = minirospy.base.clock.SimulatedClock(10**9)
client.send_goal(TestGoal(3))
answers = []
waiting = threading.Thread(target=lambda: answers.append(client.wait_for_result(rospy.Duration(100))))
waiting.start()
waiting.join(0.2)
print(waiting.is_alive())
# On a busy machine the wait starts late, after the first of these leaps of the clock.
for leap in range(1, 100):
    clock.set(leap * 102 * 10**9)
    waiting.join(0.3)
    if not waiting.is_alive():
        break
print(answers)
client.cancel_goal()
print(client.wait_for_result())
""")
        assert said == "True\n[False]\nTrue\n"

    def test_goal_and_cancel_callbacks_never_meet_a_lock_crosswise(self) -> None:
        """A goal arrives while another one finishes. actionlib would acquire its two locks in opposite orders."""
        said = run("""
def ask():
    own = actionlib.SimpleActionClient("server", TestAction)
    own.wait_for_server(second)
    for number in range(100):
        own.send_goal(TestGoal(4))
        own.cancel_all_goals()
        ended.append(own.wait_for_result(second))
ended = []
threads = [threading.Thread(target=ask) for _ in range(3)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join(60)
print(len(ended), all(ended))
""")
        assert said == "300 True\n"

    def test_wrong_parameters_are_reported(self) -> None:
        said = run("""
for value in (0, -1, "often"):
    rospy.set_param("/actionlib_status_frequency", value)
    try:
        actionlib.ActionServer("other", TestAction, print, auto_start=False).start()
    except actionlib.ActionException as error:
        print(error)
try:
    actionlib.ActionServer("other", TestAction, None)
except actionlib.ActionException as error:
    print(error)
""")
        assert said == (
            "parameter /actionlib_status_frequency must be a number of Hz above 0, not 0\n"
            "parameter /actionlib_status_frequency must be a number of Hz above 0, not -1\n"
            "parameter /actionlib_status_frequency must be a number of Hz above 0, not 'often'\n"
            "ActionServer 'other' needs a goal callback\n"
        )

    def test_a_server_stops_and_starts_again(self) -> None:
        said = run("""
server.action_server.stop()
print(client.wait_for_server(rospy.Duration.from_sec(0.1)))
server.start()
print(client.wait_for_server(second), client.send_goal_and_wait(TestGoal(4), second))
server.start()
print(client.wait_for_server(second), client.send_goal_and_wait(TestGoal(4), second))
""")
        assert said.splitlines()[1:] == ["True 3", "True 3"]

    def test_server_without_spin_runs_until_ctrl_c(self) -> None:
        import os
        import signal

        if os.name != "posix":
            pytest.skip("Ctrl-C of a single process")
        process = subprocess.Popen(
            [sys.executable, "-c", BEGIN + "print('ready', flush=True)"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout
        assert process.stdout.readline() == "ready\n"
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.3)
        os.kill(process.pid, signal.SIGINT)
        output, errors = process.communicate(timeout=30)
        assert (output, errors, process.returncode) == ("", "", 0)

    @pytest.mark.parametrize("how", ["kill", "terminate"])
    @pytest.mark.parametrize("goal", [3, 4])
    def test_goal_is_lost_when_its_server_dies(self, how: str, goal: int) -> None:
        """A server that does not respond at all (goal 4) dies before it has listed the goal."""
        said = run(f"""
import subprocess, sys
from minirospy.ros.actionlib.actionlib import client as client_module
client_module.SERVER_SECONDS = 0.2
other = subprocess.Popen([sys.executable, "-c", {SERVER_THAT_DIES!r}], stdout=subprocess.PIPE, text=True)
assert other.stdout.readline() == "ready\\n"
client = actionlib.SimpleActionClient("other", TestAction)
assert client.wait_for_server(second)
ended = []
client.send_goal(TestGoal({goal}), lambda state, result: ended.append((state, result)))
assert other.stdout.readline() == "got {goal}\\n"
other.{how}()
other.wait()
print(client.wait_for_result(), client.get_state() == GoalStatus.LOST, client.get_result(), ended)
""")
        first, second = said.splitlines()
        assert first == "True True None [(9, None)]"
        assert re.search(
            r"\[ERROR\] .*: The action server \[/other\] has died or is unreachable: goal /case-\S+ is LOST$",
            second,
        )

    def test_goals_go_on_when_a_connection_to_their_server_breaks(self) -> None:
        said = run("""
from minirospy.ros.actionlib.actionlib import client as client_module
import socket
client_module.SERVER_SECONDS = 0.2
client.send_goal(TestGoal(3))
while client.get_state() != GoalStatus.ACTIVE:
    time.sleep(0.01)
checked = threading.Event()
check = client.action_client._check_server
client.action_client._check_server = lambda goals, last: (check(goals, last), checked.set())
subscription = client.action_client.status_sub.impl.subscription
subscription.links[0].sock.shutdown(socket.SHUT_RDWR)
assert checked.wait(60)
print(client.get_state() == GoalStatus.ACTIVE)
client.cancel_goal()
print(client.wait_for_result(second), client.get_state() == GoalStatus.PREEMPTED)
""")
        assert said == "True\nTrue True\n"

    def test_all_goals_are_lost_although_a_callback_raises(self) -> None:
        said = run(f"""
import subprocess, sys
from minirospy.ros.actionlib.actionlib import client as client_module
client_module.SERVER_SECONDS = 0.2
other = subprocess.Popen([sys.executable, "-c", {SERVER_THAT_DIES!r}], stdout=subprocess.PIPE, text=True)
assert other.stdout.readline() == "ready\\n"
client = actionlib.ActionClient("other", TestAction)
assert client.wait_for_server(second)
check, checked = client._check_server, threading.Event()
def check_server(goals, last):
    try:
        check(goals, last)
    finally:
        if goals[0].state == actionlib.CommState.DONE:
            checked.set()
client._check_server = check_server
def changed(handle):
    if handle.get_comm_state() == actionlib.CommState.DONE and handle in handles[:2]:
        raise SystemExit if handle == handles[0] else ValueError("bad callback of a lost goal")
handles = []
for _ in range(3):
    handles.append(client.send_goal(TestGoal(3), changed))
    assert other.stdout.readline() == "got 3\\n"
other.kill()
other.wait()
print(checked.wait(60), [handle.get_goal_status() for handle in handles])
""")
        assert said.startswith("True [9, 9, 9]\n")
        assert said.count("is LOST\n") == 3
        assert said.count("bad callback: <function changed at ") == 2
        assert "SystemExit\n" in said
        assert "ValueError: bad callback of a lost goal\n" in said

    def test_a_callback_waits_for_the_end_of_another_goal(self) -> None:
        """As in actionlib, one goal's callback does not block those of other goals."""
        said = run("""
def got(handle):
    handle.set_accepted()
    if handle.get_goal().goal == 1:
        handle.publish_feedback(TestFeedback(1))
    else:
        handle.set_succeeded(TestResult(2))
other = actionlib.ActionServer("other", TestAction, got, auto_start=False)
other.start()
client = actionlib.ActionClient("other", TestAction)
assert client.wait_for_server(second)
ended, over, handles = threading.Event(), threading.Event(), []
def changed(handle):
    if handle.get_comm_state() == actionlib.CommState.DONE:
        ended.set()
def heard(handle, feedback):
    handles.append(client.send_goal(TestGoal(2), changed))
    print(ended.wait(30))
    client.stop()
    over.set()
handles.append(client.send_goal(TestGoal(1), None, heard))
print(over.wait(60))
""")
        assert said == "True\nTrue\n"

    def test_another_thread_stops_the_client_in_between(self) -> None:
        said = run("""
class Stopped:
    # A subscriber that another thread unregisters after the first access.
    def __init__(self, subscriber):
        self._impls = [subscriber.impl]
    @property
    def impl(self):
        return self._impls.pop() if self._impls else None
actions = client.action_client
status, result = actions.status_sub, actions.result_sub
actions.status_sub = Stopped(status)
actions._check_server([], None)
actions.status_sub = Stopped(status)
handle = actions.send_goal(TestGoal(4))
actions.status_sub, actions.result_sub = status, Stopped(result)
print(actions.wait_for_server(rospy.Duration.from_sec(0.1)))
actions.result_sub = Stopped(result)
print(actions._is_connected())
""")
        assert said == "False\nTrue\n"

    def test_a_stopped_client_leaves_nothing_in_a_shared_subscription(self) -> None:
        said = run("""
actions = actionlib.ActionClient("server", TestAction)
assert actions.wait_for_server(second)
subscriptions = [each.impl.subscription for each in (actions.status_sub, actions.result_sub, actions.feedback_sub)]
before = [(len(each.on_ended), len(each.on_connected)) for each in subscriptions]
handle = actions.send_goal(TestGoal(4))
print(before, len(subscriptions[0].on_ended))
actions.stop()
actions.stop()
print([(len(each.on_ended), len(each.on_connected)) for each in subscriptions])
print(client.send_goal_and_wait(TestGoal(4), second))
""")
        assert said == "[(0, 0), (0, 2), (0, 2)] 1\n[(0, 0), (0, 1), (0, 1)]\n3\n"
