"""``rosrun controller_manager unspawner``: stop the given controllers every three seconds, and restart them on exit.

Source: http://wiki.ros.org/controller_manager.
"""

from __future__ import annotations

import sys

from controller_manager_msgs.srv import ListControllers, SwitchController, SwitchControllerRequest

from minirospy import client as rospy

__all__ = ["main"]

_PERIOD_SECONDS = 3
_HELP = """./unspawner name1 name2 name3

\tStops a set of controllers until killed.
\tUseful in roslaunch files to temporarily stop controllers"""


def main() -> int:
    """Run the program; return 1 after printing the help, else 0."""
    if len(sys.argv) == 1 or sys.argv[1] in ("-h", "--help"):
        print(_HELP)
        return 1
    rospy.init_node("unspawner", anonymous=True)
    names = set(rospy.myargv()[1:])
    switch = rospy.ServiceProxy("controller_manager/switch_controller", SwitchController)
    list_ = rospy.ServiceProxy("controller_manager/list_controllers", ListControllers)
    stopped: set[str] = set()

    def stop() -> None:
        running = names & {each.name for each in list_().controller if each.state == "running"}
        if running:
            rospy.loginfo("Inhibiting controllers: " + ", ".join(sorted(running)))
            switch(strictness=SwitchControllerRequest.BEST_EFFORT, stop_controllers=sorted(running))
            stopped.update(running)

    def stop_again(_: object) -> None:
        try:
            stop()
        except rospy.ServiceException as error:  # keep running: the manager may come back later
            rospy.logwarn("%s", error)

    def start() -> None:
        timer.shutdown()
        try:
            switch(strictness=SwitchControllerRequest.BEST_EFFORT, start_controllers=sorted(stopped))
        except rospy.ServiceException as error:
            rospy.logwarn("%s", error)

    try:
        switch.wait_for_service()
        list_.wait_for_service()
        stop()
        timer = rospy.Timer(rospy.Duration(_PERIOD_SECONDS), stop_again)
        rospy.on_shutdown(start)
        rospy.spin()
    except rospy.ROSInterruptException:
        return 1
    except rospy.ServiceException as error:
        rospy.logerr("%s", error)
        return 1
    return 0
