"""Write recorded_grippers.json: what ROS's GripperActionController does with goals drawn at random.

    python -m tests.core.control.make_recorded_grippers ROS_CONTROLLERS.git

The argument is a git directory with the branch noetic-devel. The controller is compiled with headers that replace ROS's nodes,
actions and hardware; a goal's outcome is reported immediately, not at action_monitor_rate. It needs g++ and roscpp's headers.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.core.control.compiled import list_files, output, read_file

BRANCH = "noetic-devel"
FOLDER = "gripper_action_controller/include/"
EMPTY = ["ros/node_handle.h", "control_toolbox/pid.h", "hardware_interface/internal/demangle_symbol.h",
         "hardware_interface/joint_command_interface.h", "controller_interface/controller.h", "urdf/model.h",
         "control_msgs/GripperCommandAction.h", "actionlib/server/action_server.h", "realtime_tools/realtime_buffer.h",
         "realtime_tools/realtime_server_goal_handle.h"]  # fmt: skip
"""Headers that the controller includes; all they define is in STUBS."""

STUBS = r"""
#pragma once
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>
#include <boost/shared_ptr.hpp>
#include <ros/time.h>

#define ROS_ERROR_STREAM(args) do {} while (0)
#define ROS_WARN_STREAM(args) do {} while (0)
#define ROS_DEBUG_NAMED(...) do {} while (0)
#define ROS_ERROR_NAMED(...) do {} while (0)
#define ROS_ERROR_STREAM_NAMED(name, args) do {} while (0)
#define ROS_DEBUG_STREAM_NAMED(name, args) do {} while (0)

namespace ros {
struct TimerEvent {};
struct Timer { void start() {} };
struct NodeHandle {
  static std::map<std::string, double>& numbers() { static std::map<std::string, double> all; return all; }
  NodeHandle() {}
  NodeHandle(const NodeHandle&, const std::string&) {}
  std::string getNamespace() const { return "/c"; }
  bool getParam(const std::string& name, double& value) const {
    auto found = numbers().find(name);
    if (found == numbers().end()) return false;
    value = found->second;
    return true;
  }
  bool getParam(const std::string& name, std::string& value) const { value = "a"; return true; }
  template <class T> void param(const std::string& name, T& value, const T& otherwise) const {
    if (!getParam(name, value)) value = otherwise;
  }
  template <class... All> Timer createTimer(All...) { return Timer(); }
};
}

namespace actionlib_msgs {
struct GoalStatus { enum { PENDING, ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED }; int status = PENDING; };
}

namespace control_msgs {
struct GripperCommandGoal { struct { double position, max_effort; } command; };
struct GripperCommandResult { double position = 0, effort = 0; bool stalled = false, reached_goal = false; };
typedef boost::shared_ptr<GripperCommandResult> GripperCommandResultPtr;
struct GripperCommandAction {};
}

namespace actionlib {
struct State {
  control_msgs::GripperCommandGoal goal;
  actionlib_msgs::GoalStatus status;
  control_msgs::GripperCommandResult result;
};
struct GoalHandle {
  typedef control_msgs::GripperCommandResult Result;
  std::shared_ptr<State> state;
  const control_msgs::GripperCommandGoal* getGoal() const { return &state->goal; }
  actionlib_msgs::GoalStatus getGoalStatus() const { return state->status; }
  void set(int status, const Result& result) { state->status.status = status; state->result = result; }
  void setAccepted() { set(1, Result()); }
  void setRejected(const Result& result) { set(5, result); }
  void setCanceled() { set(2, Result()); }
  bool operator==(const GoalHandle& other) const { return state == other.state; }
};
template <class Action> struct ActionServer {
  typedef actionlib::GoalHandle GoalHandle;
  std::function<void(GoalHandle)> goal, cancel;
  ActionServer(ros::NodeHandle, std::string, std::function<void(GoalHandle)> goal, std::function<void(GoalHandle)> cancel, bool)
      : goal(goal), cancel(cancel) { last() = this; }
  static ActionServer*& last() { static ActionServer* one; return one; }
  void start() {}
};
}

namespace realtime_tools {
template <class T> struct RealtimeBuffer {
  T value;
  T* readFromRT() { return &value; }
  void initRT(const T& other) { value = other; }
  void writeFromNonRT(const T& other) { value = other; }
};
template <class Action> struct RealtimeServerGoalHandle {
  actionlib::GoalHandle gh_;
  RealtimeServerGoalHandle(actionlib::GoalHandle& gh) : gh_(gh) {}
  void setAborted(control_msgs::GripperCommandResultPtr result) { gh_.set(4, *result); }
  void setSucceeded(control_msgs::GripperCommandResultPtr result) { gh_.set(3, *result); }
  void runNonRealtime(const ros::TimerEvent&) {}
};
}

namespace control_toolbox {
struct Pid {
  bool init(const ros::NodeHandle&) { return true; }
  void reset() {}
  double computeCommand(double error, double rate, ros::Duration) { return 100 * error + 10 * rate; }
};
}

namespace hardware_interface {
struct JointHandle {
  std::string getName() const { return "a"; }
  static double* values() { static double all[3]; return all; }  // position, velocity, command
  double getPosition() const { return values()[0]; }
  double getVelocity() const { return values()[1]; }
  void setCommand(double command) { values()[2] = command; }
};
struct PositionJointInterface { JointHandle getHandle(const std::string&) { return JointHandle(); } };
struct EffortJointInterface : PositionJointInterface {};
namespace internal { template <class T> std::string demangledTypeName() { return ""; } }
}

namespace controller_interface {
template <class Hardware> struct Controller {
  bool is_running = false;
  virtual ~Controller() {}
  bool isRunning() { return is_running; }
  std::string getHardwareInterfaceType() { return ""; }
};
}

namespace urdf {
struct Joint {};
typedef std::shared_ptr<const Joint> JointConstSharedPtr;
struct Model {
  bool initString(const std::string&) { return true; }
  bool initParam(const std::string&) { return true; }
  JointConstSharedPtr getJoint(const std::string&) const { return std::make_shared<Joint>(); }
};
typedef std::shared_ptr<Model> ModelSharedPtr;
}
"""

MAIN = r"""
#include <stubs.h>
#include <gripper_action_controller/gripper_action_controller.h>
using namespace std;

static unsigned long long state = 88172645463325252ULL;

static double draw(double low, double high) {
  state ^= state << 13; state ^= state >> 7; state ^= state << 17;
  return low + (high - low) * (state >> 11) / 9007199254740992.0;
}
static bool chance(double probability) { return draw(0, 1) < probability; }
static double rounded(double low, double high) { return round(draw(low, high) * 1000) / 1000; }

template <class Hardware> void run(const char* kind, bool is_first) {
  auto& numbers = ros::NodeHandle::numbers();
  numbers.clear();
  numbers["goal_tolerance"] = rounded(-0.03, 0.03);
  numbers["max_effort"] = rounded(-9, 9);
  numbers["stall_velocity_threshold"] = rounded(0, 0.5);
  numbers["stall_timeout"] = rounded(0, 0.2);
  printf("%s{\"kind\": \"%s\"", is_first ? "[\n" : ",\n", kind);
  for (auto& each : numbers) printf(", \"%s\": %.12g", each.first.c_str(), each.second);

  double* values = hardware_interface::JointHandle::values();
  values[0] = rounded(0, 1); values[1] = 0; values[2] = 0;
  Hardware hardware;
  ros::NodeHandle handle;
  gripper_action_controller::GripperActionController<Hardware> tested;
  tested.init(&hardware, handle, handle);
  auto* server = actionlib::ActionServer<control_msgs::GripperCommandAction>::last();
  vector<actionlib::GoalHandle> goals;
  string cycles, outcomes;
  vector<bool> reported;
  bool is_stuck = false;
  ros::Time time(100, 0);
  tested.starting(time);
  tested.is_running = true;
  printf(", \"start\": %.12g, \"events\": [", values[0]);
  const char* between = "";
  for (int tick = 1; tick <= 120; ++tick) {
    ros::Time next = time + ros::Duration(0, 10000000);
    if (chance(0.06)) {
      double which = draw(0, 1);
      ros::Time::setNow(time + ros::Duration(0, (int)draw(0, 1e7)));
      printf("%s[%d, %ld", between, tick, (long)ros::Time::now().toNSec());
      between = ", ";
      if (which < 0.15 && !goals.empty()) {
        printf(", \"cancel\"]");
        if (goals.back().state->status.status == 1) server->cancel(goals.back());  // as the action server does
      } else if (which < 0.25 && tested.is_running) {
        printf(", \"stop\"]");
        tested.stopping(time);
        tested.is_running = false;
      } else if (!tested.is_running && which < 0.8) {  // else the goal is rejected
        printf(", \"start\"]");
        tested.starting(time);
        tested.is_running = true;
      } else {
        actionlib::GoalHandle goal;
        goal.state = make_shared<actionlib::State>();
        goal.state->goal.command.position = rounded(0, 1);
        goal.state->goal.command.max_effort = chance(0.2) ? 0 : rounded(-20, 20);
        printf(", \"goal\", %.12g, %.12g]", goal.state->goal.command.position, goal.state->goal.command.max_effort);
        goals.push_back(goal);
        server->goal(goal);
        is_stuck = chance(0.4);
      }
    }
    time = next;
    if (tested.is_running) tested.update(time, ros::Duration(0, 10000000));
    char text[200];
    snprintf(text, sizeof text, "%s[%.12g, %.12g, %.9g]", tick > 1 ? ", " : "", values[0], values[1], values[2]);
    cycles += text;
    for (size_t g = 0; g < goals.size(); ++g) {
      reported.resize(goals.size());
      auto& goal = *goals[g].state;
      if (reported[g] || goal.status.status < 2) continue;
      reported[g] = true;
      auto& result = goal.result;
      snprintf(text, sizeof text, "%s[%d, %zu, %d, %.12g, %.9g, %d, %d]", outcomes.empty() ? "" : ", ", tick, g,
               goal.status.status, result.position, result.effort, result.stalled, result.reached_goal);
      outcomes += text;
    }
    double before = values[0];
    double target = tested.command_.readFromRT()->position_;
    if (!is_stuck || chance(0.03)) values[0] = round((before + (target - before) * draw(0, 0.3)) * 1000) / 1000;
    values[1] = round((values[0] - before) * 100 * 1000) / 1000;
  }
  printf("],\n \"cycles\": [%s],\n \"outcomes\": [%s]}", cycles.c_str(), outcomes.c_str());
}

int main() {
  ros::Time::init();
  for (int k = 0; k < 8; ++k) {
    run<hardware_interface::PositionJointInterface>("position", k == 0);
    run<hardware_interface::EffortJointInterface>("effort", false);
  }
  printf("\n]\n");
}
"""


def main(repository: str) -> None:
    """Compile and run."""
    files = dict.fromkeys(EMPTY, "#include <stubs.h>\n")
    for path in list_files(repository, BRANCH, FOLDER):
        files[path.removeprefix(FOLDER)] = read_file(repository, BRANCH, path)
    files |= {"stubs.h": STUBS, "main.cpp": MAIN}
    recorded = output(files, ["-lrostime", "-lpthread"])
    (Path(__file__).parent / "recorded_grippers.json").write_text(recorded)


if __name__ == "__main__":
    main(sys.argv[1])
