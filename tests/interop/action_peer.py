"""An action client or server for the interop tests; runs on actionlib and on minirospy. action_peer.cpp is its C++ counterpart.

`serve` prints "ready" and serves /interop_action until stdin is closed; `ask` sends goals and prints their final states.
The last digit of a goal's number selects what the server does: 1 succeeds with feedback, 2 aborts, 3 runs until it is
preempted; the other digits count the goals. The client reports its progress in parameters, for which the server waits: /sent
is the last goal that was sent, because a client of actionlib in Python ignores everything that arrives before send_goal()
returns; /heard is the last goal whose feedback has arrived, because feedback and result use separate connections.
"""

import itertools
import sys
import threading

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from actionlib_msgs.msg import GoalStatus

NAMES = {value: name for name, value in vars(GoalStatus).items() if name.isupper() and value}
SECONDS = 200.0


def say(*words):
    print(*words, flush=True)


def wait_for(report, goal):
    while rospy.get_param(report, 0) < goal.goal and not rospy.is_shutdown():
        rospy.sleep(0.01)


def serve():
    def execute(goal):
        kind = goal.goal % 10
        if kind == 1:
            wait_for("/sent", goal)
            for number in (10, 11, 12):
                server.publish_feedback(TestFeedback(number))
            wait_for("/heard", goal)
            server.set_succeeded(TestResult(1), "reached")
        elif kind == 2:
            wait_for("/sent", goal)
            server.set_aborted(TestResult(2), "failed")
        else:
            while not server.is_preempt_requested() and not rospy.is_shutdown():
                rospy.sleep(0.01)
            server.set_preempted(TestResult(3), "made way")

    server = actionlib.SimpleActionServer("interop_action", TestAction, execute, False)
    server.start()
    say("ready")
    sys.stdin.read()
    rospy.signal_shutdown("")


class Client(actionlib.SimpleActionClient):
    def send_goal(self, goal, *callbacks):
        super().send_goal(goal, *callbacks)
        rospy.set_param("/sent", goal.goal)


def ask():
    client = Client("interop_action", TestAction)
    say("server", client.wait_for_server(rospy.Duration.from_sec(SECONDS)))
    tens = itertools.count(10, 10)

    def numbered(kind):
        return TestGoal(next(tens) + kind)

    def send(kind):
        heard, done, goal = [], threading.Event(), numbered(kind)

        def on_feedback(feedback):
            heard.append(feedback.feedback)
            if feedback.feedback == 12:
                rospy.set_param("/heard", goal.goal)

        client.send_goal(
            goal,
            lambda state, result: (heard.append((NAMES[state], result.result)), done.set()),
            None,
            on_feedback,
        )
        return heard, done

    def until_active():
        for _ in range(int(SECONDS / 0.01)):
            if client.get_state() == GoalStatus.ACTIVE:
                break
            rospy.sleep(0.01)
        say("state", NAMES[client.get_state()])

    def tell(what, heard, done):
        done.wait(SECONDS)
        finished = client.wait_for_result(rospy.Duration.from_sec(SECONDS))
        feedback = [entry for entry in heard if isinstance(entry, int)]
        say(
            what,
            finished,
            NAMES[client.get_state()],
            client.get_goal_status_text(),
            client.get_result().result,
        )
        say(what, "feedback", *feedback)

    heard, done = send(1)
    tell("succeeds", heard, done)
    heard, done = send(2)
    tell("aborts", heard, done)
    heard, done = send(3)
    until_active()
    client.cancel_goal()
    tell("cancelled", heard, done)
    send(3)
    until_active()
    heard, done = send(1)
    tell("after another", heard, done)
    heard, done = send(3)
    until_active()
    client.cancel_all_goals()
    tell("all cancelled", heard, done)
    heard, done = send(3)
    until_active()
    client.cancel_goals_at_and_before_time(rospy.Time.now())
    tell("cancelled by time", heard, done)
    state = client.send_goal_and_wait(
        numbered(3), rospy.Duration.from_sec(0.3), rospy.Duration.from_sec(SECONDS)
    )
    # The state is RECALLED if the cancel request, which uses another connection, overtakes the goal.
    say("out of time", NAMES[state] in ("PREEMPTED", "RECALLED"))
    state = client.send_goal_and_wait(numbered(2), rospy.Duration.from_sec(SECONDS))
    say("in time", NAMES[state])


rospy.init_node("action_peer", anonymous=True)
{"serve": serve, "ask": ask}[sys.argv[1]]()
