"""Write recorded_moveit.json: the messages that MoveIt's controller managers publish, with minirospy's controllers.

    python -m tests.ros.control.manager.make_recorded_moveit MOVEIT.git

The argument is a git directory with the branch master. MoveIt's files are compiled unmodified, with headers that replace
pluginlib. It needs g++, gencpp, and the headers of roscpp, actionlib and Boost.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.core.control.compiled import compile_program, read_file

BRANCH = "master"
ROOT = Path(__file__).parents[4]
ARM = ROOT / "tests" / "core" / "urdf" / "arm.urdf"
SHARE = Path("/usr/share")
GENACTION = "/usr/lib/actionlib_msgs/genaction.py"
GENCPP = "/usr/lib/gencpp/gen_cpp.py"
PACKAGES = ("trajectory_msgs", "control_msgs", "controller_manager_msgs", "moveit_msgs")
"""Packages whose headers are generated; Debian has those of std_msgs, geometry_msgs and actionlib_msgs."""

NAMES = ("RobotTrajectory", "FollowJointTrajectory", "GripperCommand", "JointTolerance", "ListControllers",
         "SwitchController", "ControllerState", "HardwareInterfaceResources", "JointTrajectory",
         "JointTrajectoryPoint", "MultiDOFJointTrajectory", "MultiDOFJointTrajectoryPoint")  # fmt: skip
"""Messages, services and actions that MoveIt's files include, and the parts of these."""

INCLUDED = (
    "moveit_core/controller_manager/include/moveit/controller_manager/controller_manager.h",
    "moveit_core/macros/include/moveit/macros/class_forward.h",
    "moveit_core/macros/include/moveit/macros/declare_ptr.h",
    "moveit_core/utils/include/moveit/utils/xmlrpc_casts.h",
    *(
        "moveit_plugins/moveit_simple_controller_manager/include/moveit_simple_controller_manager/" + name
        for name in (
            "action_based_controller_handle.h",
            "follow_joint_trajectory_controller_handle.h",
            "gripper_controller_handle.h",
        )
    ),
)
COMPILED = (
    "moveit_core/utils/src/xmlrpc_casts.cpp",
    "moveit_plugins/moveit_simple_controller_manager/src/follow_joint_trajectory_controller_handle.cpp",
)
PLUGINS = (
    "moveit_plugins/moveit_simple_controller_manager/src/moveit_simple_controller_manager.cpp",
    "moveit_plugins/moveit_ros_control_interface/src/controller_manager_plugin.cpp",
)
"""Files that MAIN includes, because they define classes that it uses."""

HEADERS = {
    "pluginlib/class_list_macros.hpp": "#define PLUGINLIB_EXPORT_CLASS(...)\n",
    "pluginlib/class_loader.hpp": "",
}

MAIN = r"""
#include <ros/ros.h>
#include "moveit_simple_controller_manager.ipp"
#include "controller_manager_plugin.ipp"

typedef moveit_controller_manager::MoveItControllerHandlePtr Handle;

// A plan as TimeOptimalTrajectoryGeneration makes it: from the present state at 0 s, with all derivatives.
static moveit_msgs::RobotTrajectory plan(std::vector<std::string> joints, double from, double to, double seconds, int count) {
  moveit_msgs::RobotTrajectory plan;
  plan.joint_trajectory.header.frame_id = "base_link";
  plan.joint_trajectory.joint_names = joints;
  for (int i = 0; i <= count; i++) {
    trajectory_msgs::JointTrajectoryPoint point;
    double x = double(i) / count, t = seconds;
    point.time_from_start = ros::Duration(x * t);
    size_t n = joints.size();
    point.positions.assign(n, from + (to - from) * (10 * x * x * x - 15 * x * x * x * x + 6 * x * x * x * x * x));
    point.velocities.assign(n, (to - from) / t * (30 * x * x - 60 * x * x * x + 30 * x * x * x * x));
    point.accelerations.assign(n, (to - from) / t / t * (60 * x - 180 * x * x + 120 * x * x * x));
    plan.joint_trajectory.points.push_back(point);
  }
  return plan;
}

static void send(const char* name, Handle handle, const moveit_msgs::RobotTrajectory& trajectory, double timeout = 10) {
  bool is_sent = handle->sendTrajectory(trajectory), is_done = handle->waitForExecution(ros::Duration(timeout));
  printf("%s %d %d %s\n", name, is_sent, is_done, handle->getLastExecutionStatus().asString().c_str());
}

static void print(const std::vector<std::string>& names) {
  for (auto& name : names) printf(" %s", name.c_str());
  printf("\n");
}

int main(int argc, char** argv) {
  ros::init(argc, argv, "move_group");
  ros::AsyncSpinner spinner(4);
  spinner.start();
  std::vector<std::string> both = {"shoulder", "elbow"}, names;
  {
    moveit_simple_controller_manager::MoveItSimpleControllerManager manager;
    manager.getControllersList(names);
    printf("controllers");
    print(names);
    Handle arm = manager.getControllerHandle("arm"), hand = manager.getControllerHandle("hand");
    Handle jaws = manager.getControllerHandle("/hand");

    send("reached", arm, plan(both, 1.5, 1.4, 0.25, 4));
    arm->sendTrajectory(plan(both, 1.4, 1.5, 30, 2));
    ros::Duration(0.1).sleep();
    send("continued", arm, plan(both, 1.4, 1.4, 0.25, 2));
    arm->sendTrajectory(plan(both, 1.4, 1.5, 30, 2));
    ros::Duration(0.1).sleep();
    arm->cancelExecution();
    ros::Duration(0.2).sleep();  // so that the recorder receives the cancellation before the next goal
    send("after cancel", arm, plan(both, 1.4, 1.4, 0.25, 2));
    send("late", arm, plan(both, 1.4, 1.5, 30, 2), 0.2);
    arm->cancelExecution();
    ros::Duration(0.2).sleep();  // so that the recorder receives the cancellation before the next goal
    send("empty", arm, moveit_msgs::RobotTrajectory());
    send("beyond", arm, plan(both, 1.4, 1.8, 0.25, 2));  // the shoulder ends at 1.57
    send("back", arm, plan(both, 1.57, 1.5, 0.25, 2));

    moveit_msgs::RobotTrajectory grip = plan({"left"}, 0.02, 0.04, 1, 2);
    send("gripped", hand, grip);
    for (auto& point : grip.joint_trajectory.points) point.effort = {3};
    send("gripped with effort", hand, grip);
    send("two jaws", jaws, plan({"right", "left"}, 0.01, 0.015, 1, 2));
    send("stalled", hand, plan({"left"}, 0.03, 1, 1, 2));
    send("opened", hand, plan({"left"}, 0.03, 0.02, 1, 2));
  }
  {
    moveit_ros_control_interface::MoveItMultiControllerManager manager;
    names.clear();
    manager.getControllersList(names);
    printf("all");
    print(names);
    names.clear();
    manager.getActiveControllers(names);
    printf("active");
    print(names);
    names.clear();
    manager.getControllerJoints("/other_arm", names);
    printf("joints");
    print(names);
    printf("switched %d\n", manager.switchControllers({"/other_arm"}, {"/arm"}));
    printf("again %d\n", manager.switchControllers({"/other_arm"}, {}));
    printf("back %d\n", manager.switchControllers({"/arm"}, {}));
    printf("states %d %d\n", manager.getControllerState("/arm").active_, manager.getControllerState("/other_arm").active_);
    Handle arm = manager.getControllerHandle("/arm");
    printf("name %s\n", arm->getName().c_str());
    send("by ros_control", arm, plan(both, 1.5, 1.5, 0.1, 2));
  }
  return 0;
}
"""

SETUP = f"""
import rospy
from controller_manager import controller_manager_interface as cm
rospy.set_param("/robot_description", open({str(ARM)!r}).read())
arm = {{"type": "position_controllers/JointTrajectoryController", "joints": ["shoulder", "elbow"],
       "constraints": {{"shoulder": {{"goal": 0.02}}, "elbow": {{"goal": 0.02}}}}}}
rospy.set_param("/arm", arm)
rospy.set_param("/other_arm", arm)
rospy.set_param("/hand", {{"type": "position_controllers/GripperActionController", "joint": "left", "goal_tolerance": 0.001}})
rospy.set_param("/move_group/controller_list", [
    {{"name": "arm", "action_ns": "follow_joint_trajectory", "type": "FollowJointTrajectory", "default": True,
      "joints": ["shoulder", "elbow"], "goal_tolerance": {{"position": [0.03, 0.04], "velocity": 0.05}},
      "path_tolerance": [{{"name": "elbow", "position": 3.0}}], "goal_time_tolerance": 1.0}},
    {{"name": "hand", "action_ns": "gripper_cmd", "type": "GripperCommand", "joints": ["left"], "max_effort": 2.0}},
    {{"name": "/hand", "action_ns": "gripper_cmd", "type": "GripperCommand", "joints": ["left", "right"], "parallel": True}},
])
"""
INITIAL = "_initial:={shoulder: 1.5, elbow: 1.5, left: 0.02}"
START = """
import rospy
from controller_manager import controller_manager_interface as cm
rospy.wait_for_service("/controller_manager/load_controller")
print([cm.load_controller(each) for each in ("arm", "hand", "other_arm")], cm.start_controllers(["arm", "hand"]))
"""
RECORDER = """
import json
import sys
import rospy
from actionlib_msgs.msg import GoalID
from control_msgs.msg import *
from rospy_message_converter.message_converter import convert_ros_message_to_dictionary as convert
rospy.init_node("recorder")
def listen(name, kind):
    for topic, message_class in (("goal", globals()[kind + "ActionGoal"]), ("cancel", GoalID),
                                 ("result", globals()[kind + "ActionResult"])):
        def receive(message, topic=topic):
            time = rospy.Time.now() if topic == "cancel" else message.header.stamp
            sys.stdout.write(json.dumps([time.to_nsec(), name, topic, convert(message)]) + "\\n")
            sys.stdout.flush()
        rospy.Subscriber(f"{name}/{topic}", message_class, receive)
listen("/arm/follow_joint_trajectory", "FollowJointTrajectory")
listen("/hand/gripper_cmd", "GripperCommand")
print("ready", flush=True)
rospy.spin()
"""


def main() -> None:
    """Compile and run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = _compile(folder, sys.argv[1])
        recorded = _run(program)
    target = Path(__file__).parent / "recorded_moveit.json"
    lists = (",\n  ".join(map(json.dumps, each)) for each in recorded.values())
    printed, messages = lists
    text = f'{{"printed": [\n  {printed}\n ],\n "messages": [\n  {messages}\n ]}}\n'
    target.write_text(text, encoding="utf-8")


def _compile(folder: Path, repository: str) -> Path:
    for package in PACKAGES:
        _generate(package, folder)
    files = dict(HEADERS)
    for path in (*INCLUDED, *COMPILED):
        files[path.partition("/include/")[2] or Path(path).name] = read_file(repository, BRANCH, path)
    for path in PLUGINS:
        files[f"{Path(path).stem}.ipp"] = read_file(repository, BRANCH, path)
    flags = ["pkg-config", "--cflags", "--libs", "actionlib", "roscpp"]
    flags = subprocess.run(flags, capture_output=True, text=True, check=True).stdout.split()
    return compile_program(folder, {**files, "main.cpp": MAIN}, flags)


def _generate(package: str, folder: Path) -> None:
    """Write the C++ headers of a package's messages."""
    source = ROOT / "msgs" / package
    messages = folder / "msg" / package
    messages.mkdir(parents=True)
    for path in source.glob("msg/*.msg"):
        shutil.copy(path, messages)
    for path in source.glob("action/*.action"):
        subprocess.run(["/usr/bin/python3", GENACTION, path, "-o", messages], check=True)
    for path in (*sorted(messages.glob("*.msg")), *source.glob("srv/*.srv")):
        if not path.name.startswith(NAMES):
            continue
        includes = [f"-I{each}:{folder / 'msg' / each}" for each in PACKAGES]
        includes += [
            f"-I{each}:{SHARE / each / 'msg'}" for each in ("std_msgs", "geometry_msgs", "actionlib_msgs")
        ]
        command = [
            "/usr/bin/python3",
            GENCPP,
            path,
            *includes,
            "-p",
            package,
            "-o",
            folder / package,
            "-e",
            SHARE / "gencpp",
        ]
        subprocess.run(command, check=True)


def _run(program: Path) -> dict[str, list[object]]:
    """Return what the program prints, and the messages that it and the controllers publish."""
    binaries = Path(sys.executable).parent
    environment = {**os.environ, "ROS_MASTER_URI": "http://localhost:11533"}

    def start(*command: object) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            list(map(str, command)), env=environment, stdout=subprocess.PIPE, text=True
        )
        running.append(process)
        return process

    running: list[subprocess.Popen[str]] = []
    try:
        roscore = start(binaries / "roscore", "-p", "11533")
        assert roscore.stdout
        while "started core service" not in roscore.stdout.readline():
            pass
        subprocess.run([sys.executable, "-c", SETUP], env=environment, check=True)
        start(binaries / "rosrun", "minirospy_hardware", "loopback", INITIAL)
        subprocess.run([sys.executable, "-c", START], env=environment, check=True)
        recorder = start(sys.executable, "-c", RECORDER)
        assert recorder.stdout
        recorder.stdout.readline()
        printed = subprocess.run(
            [program], env=environment, stdout=subprocess.PIPE, text=True, check=True
        ).stdout
        recorder.terminate()
        messages = [message for _, *message in sorted(json.loads(line) for line in recorder.stdout)]
        return {
            "printed": [line for line in printed.splitlines() if "INFO" not in line],
            "messages": messages,
        }
    finally:
        for process in reversed(running):
            process.terminate()
            process.wait()


if __name__ == "__main__":
    main()
