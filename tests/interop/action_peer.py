"""One end of an action, for the interop tests: runs on actionlib and on ours alike. action_peer.cpp is its twin.

`serve` prints "ready" and serves /interop_action until its input ends; `ask` sends goals and prints how they ended.
Goal 1 succeeds with feedback, 2 aborts, 3 runs until it is preempted. None ends immediately: a client of actionlib in
Python does not take an answer that comes before its send_goal() has returned.
"""

import sys
import threading

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from actionlib_msgs.msg import GoalStatus

NAMES = {value: name for name, value in vars(GoalStatus).items() if name.isupper() and value}
SECONDS = 40.0


def say(*words):
    print(*words, flush=True)


def serve():
    def execute(goal):
        if goal.goal == 1:
            for number in (10, 11, 12):
                server.publish_feedback(TestFeedback(number))
            # Feedback and result have separate connections: after its result a goal gets no feedback.
            rospy.sleep(0.2)
            server.set_succeeded(TestResult(1), "reached")
        elif goal.goal == 2:
            rospy.sleep(0.1)
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


def ask():
    client = actionlib.SimpleActionClient("interop_action", TestAction)
    say("server", client.wait_for_server(rospy.Duration.from_sec(SECONDS)))

    def send(goal):
        heard, done = [], threading.Event()
        client.send_goal(
            TestGoal(goal),
            lambda state, result: (heard.append((NAMES[state], result.result)), done.set()),
            None,
            lambda feedback: heard.append(feedback.feedback),
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
        TestGoal(3), rospy.Duration.from_sec(0.3), rospy.Duration.from_sec(SECONDS)
    )
    say("out of time", NAMES[state])
    state = client.send_goal_and_wait(TestGoal(2), rospy.Duration.from_sec(SECONDS))
    say("in time", NAMES[state])


rospy.init_node("action_peer", anonymous=True)
{"serve": serve, "ask": ask}[sys.argv[1]]()
