"""A state machine that stops with its node: in the thread that shuts down, or (with an argument) in another one."""

import sys
import threading

import rospy
import smach
import smach_ros

rospy.init_node("preempted", log_level=rospy.ERROR)
started = threading.Event()


class Waits(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["end"])

    def execute(self, ud):
        started.set()
        if len(sys.argv) == 1:
            rospy.signal_shutdown("done")
        while not self.preempt_requested():
            threading.Event().wait(0.02)
        return "end"


sm = smach.StateMachine(["end"])
with sm:
    smach.StateMachine.add("WAITS", Waits())
smach_ros.set_preempt_handler(sm)
if len(sys.argv) == 1:
    print(sm.execute())
else:
    thread = threading.Thread(target=lambda: print(sm.execute()))
    thread.start()
    started.wait()
    rospy.signal_shutdown("done")
    thread.join()
