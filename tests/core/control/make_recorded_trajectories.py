"""Write recorded_trajectories.json: what ROS's JointTrajectoryController does with messages drawn at random.

    python -m tests.core.control.make_recorded_trajectories ROS_CONTROLLERS.git

The argument is a git directory with the branch noetic-devel. The controller is compiled with headers that replace ROS's nodes,
actions and hardware. It needs g++, and the headers of roscpp, actionlib and Boost.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.core.control.compiled import list_files, output, read_file

BRANCH = "noetic-devel"
FOLDER = "joint_trajectory_controller/include/"
EMPTY = ["ros/node_handle.h", "control_toolbox/pid.h", "hardware_interface/internal/demangle_symbol.h",
         "hardware_interface/posvel_command_interface.h", "hardware_interface/posvelacc_command_interface.h",
         "hardware_interface/joint_command_interface.h", "controller_interface/controller.h", "urdf/model.h",
         "control_msgs/FollowJointTrajectoryAction.h", "control_msgs/JointTrajectoryControllerState.h",
         "control_msgs/QueryTrajectoryState.h", "trajectory_msgs/JointTrajectory.h",
         "trajectory_msgs/JointTrajectoryPoint.h", "actionlib/server/action_server.h", "realtime_tools/realtime_box.h",
         "realtime_tools/realtime_buffer.h", "realtime_tools/realtime_publisher.h",
         "realtime_tools/realtime_server_goal_handle.h", "angles/angles.h", "ros/console.h"]  # fmt: skip
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
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>
#include <ros/time.h>
#include <xmlrpcpp/XmlRpcValue.h>
#include <actionlib/enclosure_deleter.h>

#define IGNORED(...) do {} while (0)
#define ROS_DEBUG_STREAM(args) IGNORED()
#define ROS_WARN_STREAM(args) IGNORED()
#define ROS_ERROR_STREAM(args) IGNORED()
#define ROS_WARN(...) IGNORED()
#define ROS_DEBUG_NAMED(...) IGNORED()
#define ROS_ERROR_NAMED(...) IGNORED()
#define ROS_WARN_STREAM_NAMED(name, args) IGNORED()
#define ROS_ERROR_STREAM_NAMED(name, args) IGNORED()
#define ROS_DEBUG_STREAM_NAMED(name, args) IGNORED()
#define ROS_DEBUG_STREAM_THROTTLE_NAMED(rate, name, args) IGNORED()

struct Header { ros::Time stamp; };

namespace ros {
struct Subscriber {};
struct ServiceServer {};
struct TimerEvent {};
struct Timer { void start() {} };
struct NodeHandle {
  std::string prefix;
  static std::map<std::string, double>& numbers() { static std::map<std::string, double> all; return all; }
  NodeHandle() {}
  NodeHandle(const NodeHandle& other, const std::string& name) : prefix(other.prefix + name + "/") {}
  std::string getNamespace() const { return "/c"; }
  template <class T> bool getParam(const std::string& name, T& value) const {
    auto found = numbers().find(prefix + name);
    if (found == numbers().end()) return false;
    value = found->second;
    return true;
  }
  bool getParam(const std::string& name, std::string& value) const { value = ""; return true; }
  bool getParam(const std::string& name, XmlRpc::XmlRpcValue& value) const {
    value[0] = std::string("a"); value[1] = std::string("b");
    return true;
  }
  template <class T> void param(const std::string& name, T& value, const T& otherwise) const {
    if (!getParam(name, value)) value = otherwise;
  }
  template <class... All> Subscriber subscribe(All...) { return Subscriber(); }
  template <class... All> ServiceServer advertiseService(All...) { return ServiceServer(); }
  template <class... All> Timer createTimer(All...) { return Timer(); }
};
}

namespace angles {
inline double shortest_angular_distance(double from, double to) { return remainder(to - from, 2 * M_PI); }
}

namespace trajectory_msgs {
struct JointTrajectoryPoint {
  std::vector<double> positions, velocities, accelerations, effort;
  ros::Duration time_from_start;
};
struct JointTrajectory {
  Header header;
  std::vector<std::string> joint_names;
  std::vector<JointTrajectoryPoint> points;
  typedef boost::shared_ptr<JointTrajectory const> ConstPtr;
};
}

namespace control_msgs {
struct JointTolerance { std::string name; double position, velocity, acceleration; };
struct FollowJointTrajectoryGoal {
  trajectory_msgs::JointTrajectory trajectory;
  std::vector<JointTolerance> path_tolerance, goal_tolerance;
  ros::Duration goal_time_tolerance;
};
struct FollowJointTrajectoryResult {
  enum { SUCCESSFUL = 0, INVALID_GOAL = -1, INVALID_JOINTS = -2, OLD_HEADER_TIMESTAMP = -3,
         PATH_TOLERANCE_VIOLATED = -4, GOAL_TOLERANCE_VIOLATED = -5 };
  int error_code = 0;
  std::string error_string;
};
struct JointTrajectoryControllerState {
  Header header;
  std::vector<std::string> joint_names;
  trajectory_msgs::JointTrajectoryPoint desired, actual, error;
};
typedef JointTrajectoryControllerState FollowJointTrajectoryFeedback;
struct FollowJointTrajectoryAction {};
struct QueryTrajectoryState {
  struct Request { ros::Time time; };
  struct Response { std::vector<std::string> name; std::vector<double> position, velocity, acceleration; };
};
}

namespace actionlib {
enum Status { PENDING, ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED };
struct State {
  boost::shared_ptr<control_msgs::FollowJointTrajectoryGoal> goal;
  Status status = PENDING;
  control_msgs::FollowJointTrajectoryResult result;
};
struct GoalHandle {
  typedef control_msgs::FollowJointTrajectoryResult Result;
  std::shared_ptr<State> state;
  boost::shared_ptr<const control_msgs::FollowJointTrajectoryGoal> getGoal() const { return state->goal; }
  void set(Status status, const Result& result) {
    if (state->status == PENDING || state->status == ACTIVE) { state->status = status; state->result = result; }
  }
  void setAccepted() { set(ACTIVE, Result()); }
  void setRejected(const Result& result) { set(REJECTED, result); }
  void setCanceled() { set(PREEMPTED, Result()); }
  bool operator==(const GoalHandle& other) const { return state == other.state; }
};
template <class Action> struct ActionServer {
  typedef actionlib::GoalHandle GoalHandle;
  template <class... All> ActionServer(All...) {}
  void start() {}
};
}

namespace realtime_tools {
template <class T> struct RealtimeBox {
  T value;
  void get(T& other) { other = value; }
  void set(const T& other) { value = other; }
};
template <class T> struct RealtimeBuffer {
  T value;
  T* readFromRT() { return &value; }
  void initRT(const T& other) { value = other; }
  void writeFromNonRT(const T& other) { value = other; }
};
template <class T> struct RealtimePublisher {
  T msg_;
  template <class... All> RealtimePublisher(All...) {}
  bool trylock() { return true; }
  void lock() {}
  void unlock() {}
  void unlockAndPublish() {}
};
template <class Action> struct RealtimeServerGoalHandle {
  typedef boost::shared_ptr<control_msgs::FollowJointTrajectoryResult> ResultPtr;
  actionlib::GoalHandle gh_;
  ResultPtr preallocated_result_ = boost::make_shared<control_msgs::FollowJointTrajectoryResult>();
  boost::shared_ptr<control_msgs::FollowJointTrajectoryFeedback> preallocated_feedback_ =
      boost::make_shared<control_msgs::FollowJointTrajectoryFeedback>();
  RealtimeServerGoalHandle(actionlib::GoalHandle& gh) : gh_(gh) {}
  void setAborted(ResultPtr result) { gh_.set(actionlib::ABORTED, *result); }
  void setSucceeded(ResultPtr result) { gh_.set(actionlib::SUCCEEDED, *result); }
  template <class T> void setFeedback(T) {}
  void runNonRealtime(const ros::TimerEvent&) {}
};
}

namespace control_toolbox {
struct Pid {
  bool init(const ros::NodeHandle&) { return true; }
  void reset() {}
  double computeCommand(double, double, ros::Duration) { return 0; }
};
}

namespace hardware_interface {
struct JointHandle {
  std::string name;
  double* values = nullptr;  // position, velocity, command
  std::string getName() const { return name; }
  double getPosition() const { return values[0]; }
  double getVelocity() const { return values[1]; }
  void setCommand(double command, double = 0, double = 0) { values[2] = command; }
};
struct PosVelJointHandle : JointHandle {};
struct PosVelAccJointHandle : JointHandle {};
template <class Handle, int kind> struct CommandInterface {
  typedef Handle ResourceHandleType;
  double values[2][3] = {};
  Handle getHandle(const std::string& name) {
    Handle handle;
    handle.name = name;
    handle.values = values[name == "a" ? 0 : 1];
    return handle;
  }
};
typedef CommandInterface<JointHandle, 0> PositionJointInterface;
typedef CommandInterface<JointHandle, 1> VelocityJointInterface;
typedef CommandInterface<JointHandle, 2> EffortJointInterface;
typedef CommandInterface<PosVelJointHandle, 3> PosVelJointInterface;
typedef CommandInterface<PosVelAccJointHandle, 4> PosVelAccJointInterface;
namespace internal { template <class T> std::string demangledTypeName() { return ""; } }
}

namespace controller_interface {
template <class Hardware> struct Controller {
  virtual ~Controller() {}
  bool isRunning() { return true; }
  std::string getHardwareInterfaceType() { return ""; }
};
}

namespace urdf {
struct Joint { enum { REVOLUTE, CONTINUOUS }; int type; };
typedef std::shared_ptr<const Joint> JointConstSharedPtr;
struct Model {
  static bool* continuous() { static bool all[2]; return all; }
  bool initString(const std::string&) { return true; }
  bool initParam(const std::string&) { return true; }
  JointConstSharedPtr getJoint(const std::string& name) const {
    auto joint = std::make_shared<Joint>();
    joint->type = continuous()[name == "a" ? 0 : 1] ? Joint::CONTINUOUS : Joint::REVOLUTE;
    return joint;
  }
};
typedef std::shared_ptr<Model> ModelSharedPtr;
}
"""

MAIN = r"""
#include <stubs.h>
#include <trajectory_interface/quintic_spline_segment.h>
#include <joint_trajectory_controller/joint_trajectory_controller.h>
using namespace std;

static unsigned long long state = 88172645463325252ULL;

static double draw(double low, double high) {
  state ^= state << 13; state ^= state >> 7; state ^= state << 17;
  return low + (high - low) * (state >> 11) / 9007199254740992.0;
}
static bool chance(double probability) { return draw(0, 1) < probability; }
static int pick(int count) { return (int)draw(0, count); }

static const long TICK = 10000000, BEGIN = 100;

typedef joint_trajectory_controller::JointTrajectoryController<trajectory_interface::QuinticSplineSegment<double>,
                                                               hardware_interface::PositionJointInterface> Base;
struct Tested : Base {
  hardware_interface::PositionJointInterface hardware;
  vector<actionlib::GoalHandle> goals;

  void command(const trajectory_msgs::JointTrajectory& message) {
    trajectoryCommandCB(boost::make_shared<trajectory_msgs::JointTrajectory>(message));
  }
  void send(const control_msgs::FollowJointTrajectoryGoal& goal) {
    actionlib::GoalHandle handle;
    handle.state = make_shared<actionlib::State>();
    handle.state->goal = boost::make_shared<control_msgs::FollowJointTrajectoryGoal>(goal);
    goals.push_back(handle);
    successful_joint_traj_.reset();  // else a new goal inherits the joints that had reached the old one
    goalCB(handle);
  }
  bool query(control_msgs::QueryTrajectoryState::Request& request, control_msgs::QueryTrajectoryState::Response& response) {
    return queryStateService(request, response);
  }
  vector<double> states() {
    return {desired_state_.time_from_start, current_state_.time_from_start, desired_state_.acceleration[0],
            desired_state_.acceleration[1], state_error_.velocity[0], state_error_.velocity[1]};
  }
  void cancel() {
    if (rt_active_goal_) cancelCB(actionlib::GoalHandle(rt_active_goal_->gh_));
  }
};

static trajectory_msgs::JointTrajectory make_message(ros::Time now) {
  trajectory_msgs::JointTrajectory message;
  const char* names[] = {"ab", "ba", "ab", "ba", "a", "b", "ax", "abx", ""};
  string chosen = names[chance(0.8) ? pick(4) : pick(9)];
  for (char name : chosen) message.joint_names.push_back(string(1, name));
  if (chance(0.4)) message.header.stamp = now + ros::Duration(draw(-0.4, 0.4));
  if (chance(0.05)) return message;

  int count = 1 + pick(4), kind = 1 + pick(3);
  long time = chance(0.3) ? 0 : (long)draw(2e7, 4e8);
  for (int k = 0; k < count; ++k) {
    trajectory_msgs::JointTrajectoryPoint point;
    point.time_from_start.fromNSec(time);
    if (chance(0.1)) kind = 1 + pick(3);
    for (size_t j = 0; j < chosen.size(); ++j) {
      point.positions.push_back(draw(-3, 3));
      if (kind > 1) point.velocities.push_back(draw(-1, 1));
      if (kind > 2) point.accelerations.push_back(draw(-2, 2));
    }
    if (chance(0.02)) point.velocities.push_back(0);
    // Without positions in the first point ROS crashes.
    bool is_later = k > 1 && message.header.stamp.isZero();
    if (is_later && chance(0.05)) point.positions.clear();
    if (is_later && chance(0.05)) { point.positions.clear(); point.velocities.clear(); point.accelerations.clear(); }
    message.points.push_back(point);
    time += chance(0.02) ? 0 : (long)draw(2e7, 4e8);
  }
  return message;
}

static void print(const vector<double>& numbers) {
  printf("[");
  for (size_t i = 0; i < numbers.size(); ++i) printf("%s%.9g", i ? ", " : "", numbers[i]);
  printf("]");
}

static void print(const trajectory_msgs::JointTrajectory& message) {
  printf("\"names\": \"");
  for (auto& name : message.joint_names) printf("%s", name.c_str());
  printf("\", \"stamp\": %ld, \"points\": [", (long)message.header.stamp.toNSec());
  for (size_t k = 0; k < message.points.size(); ++k) {
    auto& point = message.points[k];
    printf("%s[%ld, ", k ? ", " : "", (long)point.time_from_start.toNSec());
    print(point.positions); printf(", "); print(point.velocities); printf(", "); print(point.accelerations);
    printf("]");
  }
  printf("]");
}

static void print(const char* name, const vector<control_msgs::JointTolerance>& tolerances) {
  printf(", \"%s\": [", name);
  for (size_t i = 0; i < tolerances.size(); ++i) {
    auto& each = tolerances[i];
    printf("%s[\"%s\", %.9g, %.9g]", i ? ", " : "", each.name.c_str(), each.position, each.velocity);
  }
  printf("]");
}

static vector<control_msgs::JointTolerance> make_tolerances() {
  vector<control_msgs::JointTolerance> tolerances;
  double values[] = {-1, 0, draw(0.01, 0.1)}, velocities[] = {-1, 0, draw(0.1, 3)};
  for (const char* name : {"b", "x", "a"})
    if (chance(0.2)) tolerances.push_back({name, values[pick(3)], velocities[pick(3)], 0});
  return tolerances;
}

static string escaped(const string& text) {
  string result;
  for (char c : text) if (c == '\n') result += "\\n"; else result += c;
  return result;
}

static void run(bool is_first) {
  auto& numbers = ros::NodeHandle::numbers();
  numbers.clear();
  bool* continuous = urdf::Model::continuous();
  continuous[0] = chance(0.5); continuous[1] = chance(0.3);
  double stop = chance(0.5) ? draw(0.05, 0.4) : 0, goal_time = chance(0.5) ? draw(0, 0.3) : 0;
  double path = chance(0.5) ? draw(0.01, 0.06) : 0, goal = chance(0.6) ? draw(0.005, 0.06) : 0;
  double velocity = chance(0.5) ? 0 : draw(0.01, 3);
  bool partial = chance(0.5);
  numbers["stop_trajectory_duration"] = stop;
  numbers["allow_partial_joints_goal"] = partial;
  numbers["constraints/goal_time"] = goal_time;
  numbers["constraints/stopped_velocity_tolerance"] = velocity;
  for (string joint : {"a", "b"}) {
    numbers["constraints/" + joint + "/trajectory"] = path;
    numbers["constraints/" + joint + "/goal"] = goal;
  }
  printf("%s {\"continuous\": [%d, %d], \"stop\": %.12g, \"goal_time\": %.12g, \"path\": %.12g, \"goal\": %.12g, "
         "\"velocity\": %.12g, \"partial\": %d, \"events\": [", is_first ? "" : ",\n", continuous[0], continuous[1], stop,
         goal_time, path, goal, velocity, partial);

  Tested tested;
  ros::NodeHandle handle;
  for (auto& each : tested.hardware.values) each[0] = draw(-3, 3);
  vector<double> start = {tested.hardware.values[0][0], tested.hardware.values[1][0]};
  tested.init(&tested.hardware, handle, handle);
  ros::Time time(BEGIN, 0);
  tested.starting(time);
  vector<double> commands, states;
  vector<string> outcomes;
  vector<bool> reported;
  const char* between = "";
  for (int tick = 1; tick <= 220; ++tick) {
    ros::Time next = time + ros::Duration(0, TICK);
    if (tick > 45 && chance(0.06)) {  // before, a stamp in the past has no uptime
      double kind = draw(0, 1);
      printf("%s\n  {\"tick\": %d, ", between, tick);
      between = ",";
      if (kind < 0.1) {
        printf("\"kind\": \"cancel\"}");
        tested.cancel();
      } else {
        auto message = make_message(next);
        printf("\"kind\": \"%s\", ", kind < 0.3 ? "command" : "goal");
        print(message);
        if (kind < 0.3) tested.command(message);
        else {
          control_msgs::FollowJointTrajectoryGoal goal;
          goal.trajectory = message;
          goal.path_tolerance = make_tolerances();
          goal.goal_tolerance = make_tolerances();
          if (chance(0.3)) goal.goal_time_tolerance.fromSec(draw(-0.2, 0.3));
          print("path", goal.path_tolerance);
          print("goal", goal.goal_tolerance);
          printf(", \"goal_time\": %ld", (long)goal.goal_time_tolerance.toNSec());
          tested.send(goal);
        }
        printf("}");
      }
    } else if (tick > 45 && chance(0.02)) {
      control_msgs::QueryTrajectoryState::Request request;
      control_msgs::QueryTrajectoryState::Response response;
      request.time = time + ros::Duration(draw(-0.3, 0.6));
      printf("%s\n  {\"tick\": %d, \"kind\": \"query\", \"time\": %ld, \"state\": [", between, tick,
             (long)request.time.toNSec());
      between = ",";
      if (tested.query(request, response)) {
        print(response.position); printf(", "); print(response.velocity); printf(", "); print(response.acceleration);
      }
      printf("]}");
    }
    time = next;
    tested.update(time, ros::Duration(0, TICK));
    if (tick % 10 == 0) for (double each : tested.states()) states.push_back(each);
    for (size_t g = 0; g < tested.goals.size(); ++g) {
      reported.resize(tested.goals.size());
      auto& goal = *tested.goals[g].state;
      if (reported[g] || goal.status == actionlib::PENDING || goal.status == actionlib::ACTIVE) continue;
      reported[g] = true;
      char text[1000];
      snprintf(text, sizeof text, "[%d, %zu, %d, %d, \"%s\"]", tick, g, goal.status, goal.result.error_code,
               escaped(goal.result.error_string).c_str());
      outcomes.push_back(text);
    }
    for (auto& each : tested.hardware.values) {
      double position = each[2] * 0.99;
      each[1] = (position - each[0]) * 100.0;
      each[0] = position;
      if (tick % 10 == 0) commands.push_back(each[2]);
    }
  }
  printf("],\n  \"start\": "); print(start);
  printf(",\n  \"commands\": "); print(commands);
  printf(",\n  \"states\": "); print(states);
  printf(",\n  \"outcomes\": [");
  for (size_t i = 0; i < outcomes.size(); ++i) printf("%s%s", i ? ", " : "", outcomes[i].c_str());
  printf("]}");
}

int main(int count, char** words) {
  int runs = atoi(words[1]);
  printf("[\n");
  for (int k = 0; k < runs; ++k) run(k == 0);
  printf("\n]\n");
}
"""


def main(repository: str, runs: int = 50) -> None:
    """Compile and run."""
    files = dict.fromkeys(EMPTY, "#include <stubs.h>\n")
    for path in list_files(repository, BRANCH, FOLDER):
        files[path.removeprefix(FOLDER)] = read_file(repository, BRANCH, path)
    files |= {"stubs.h": STUBS, "main.cpp": MAIN}
    recorded = output(
        files, ["-lrostime", "-lxmlrpcpp", "-lboost_thread", "-lboost_system", "-lpthread"], str(runs)
    )
    (Path(__file__).parent / "recorded_trajectories.json").write_text(recorded)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
