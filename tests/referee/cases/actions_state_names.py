"""The names of states, which actionlib adds to GoalStatus, too."""

import actionlib
import actionlib.action_client
import actionlib_msgs.msg
from referee import outcome, show

show(actionlib.GoalStatus is actionlib_msgs.msg.GoalStatus)
for number in (*range(1, 11), 255, -1):
    outcome(number, lambda n=number: actionlib_msgs.msg.GoalStatus.to_string(n))
for number in (*range(9), 99, -1):
    outcome(number, lambda n=number: actionlib.CommState.to_string(n))
    outcome(number, lambda n=number: actionlib.TerminalState.to_string(n))
    outcome(number, lambda n=number: actionlib.SimpleGoalState.to_string(n))
show(actionlib_msgs.msg.GoalStatus(status=3).to_string(3))
