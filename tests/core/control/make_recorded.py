"""Write recorded.json: what the C++ classes of ros_controllers, control_toolbox and ros_control compute for random numbers.

    python -m tests.core.control.make_recorded ROS_CONTROLLERS.git CONTROL_TOOLBOX.git ROS_CONTROL.git

The arguments are git directories with the branch noetic-devel. It needs g++, and the headers of roscpp and Boost.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.core.control.compiled import output, read_file

BRANCH = "noetic-devel"
SOURCES = {
    "diff_drive_controller/include/diff_drive_controller/odometry.h": "diff_drive_controller/odometry.h",
    "diff_drive_controller/include/diff_drive_controller/speed_limiter.h": "diff_drive_controller/speed_limiter.h",
    "diff_drive_controller/src/odometry.cpp": "drive.cpp",
    "diff_drive_controller/src/speed_limiter.cpp": "limiter.cpp",
    "ackermann_steering_controller/include/ackermann_steering_controller/odometry.h": "ackermann_steering_controller/odometry.h",
    "ackermann_steering_controller/src/odometry.cpp": "ackermann.cpp",
    "include/control_toolbox/pid.h": "control_toolbox/pid.h",
    "src/pid.cpp": "pid.cpp",
    **{
        f"transmission_interface/include/transmission_interface/{name}.h": f"transmission_interface/{name}.h"
        for name in (
            "transmission",
            "transmission_interface_exception",
            "differential_transmission",
            "four_bar_linkage_transmission",
        )
    },
}
"""Files of the repositories, and their names here."""

# pid.cpp publishes and reconfigures; these headers replace what it needs for that.
HEADERS = {
    "control_toolbox/ParametersConfig.h": """
namespace control_toolbox { struct ParametersConfig { double p, i, d, i_clamp_max, i_clamp_min; bool antiwindup; }; }
""",
    "dynamic_reconfigure/server.h": """
#include <functional>
#include <boost/thread/recursive_mutex.hpp>
namespace dynamic_reconfigure {
template <class C> struct Server {
  typedef std::function<void(C&, uint32_t)> CallbackType;
  Server(boost::recursive_mutex&, ros::NodeHandle&) {}
  void updateConfig(C) {}
  void setCallback(CallbackType) {}
};
}
""",
    "control_msgs/PidState.h": """
#include <ros/time.h>
namespace control_msgs {
struct PidState {
  struct { ros::Time stamp; } header;
  ros::Duration timestep;
  double error, error_dot, p_error, i_error, d_error, p_term, i_term, d_term, i_max, i_min, output;
};
}
""",
    "realtime_tools/realtime_buffer.h": """
namespace realtime_tools {
template <class T> struct RealtimeBuffer {
  T value;
  T* readFromRT() { return &value; }
  void writeFromNonRT(const T& other) { value = other; }
};
}
""",
    "realtime_tools/realtime_publisher.h": """
#include <string>
namespace realtime_tools {
template <class T> struct RealtimePublisher {
  T msg_;
  void init(ros::NodeHandle&, std::string, int) {}
  bool trylock() { return true; }
  void unlockAndPublish() {}
};
}
""",
    "tinyxml.h": "struct TiXmlElement { const char* Attribute(const char*) { return nullptr; } };\n",
}

MAIN = r"""
#include <cmath>
#include <cstdio>
#include <vector>
#include <diff_drive_controller/odometry.h>
#include <diff_drive_controller/speed_limiter.h>
#include <ackermann_steering_controller/odometry.h>
#include <control_toolbox/pid.h>
#include <transmission_interface/differential_transmission.h>
#include <transmission_interface/four_bar_linkage_transmission.h>
namespace transmission = transmission_interface;

static unsigned long long state = 88172645463325252ULL;
static const char* between = "";
static const double none = NAN;

static double draw(double low, double high) {
  state ^= state << 13; state ^= state >> 7; state ^= state << 17;
  return low + (high - low) * (state >> 11) / 9007199254740992.0;
}

static int step() { return (int)draw(2e6, 3e7); }

static void begin(const char* name, bool first = false) {
  printf("%s \"%s\": [", first ? "{\n" : "\n ],\n", name);
  between = "";
}

static void row(std::vector<double> numbers) {
  printf("%s\n  [", between);
  between = "";
  for (double each : numbers) {
    if (std::isnan(each)) printf("%snull", between); else printf("%s%.15g", between, each);
    between = ", ";
  }
  printf("]");
  between = ",";
}

static void transmit(double kind, transmission::Transmission& tested, std::vector<double> numbers) {
  double in[6], out[6], back[6];
  for (double& each : in) each = draw(-2, 2);
  transmission::ActuatorData motors, backwards;
  transmission::JointData joints, measured;
  for (int k = 0; k < 2; k++) {
    motors.position.push_back(in + k); joints.position.push_back(out + k);
    motors.velocity.push_back(in + 2 + k); joints.velocity.push_back(out + 2 + k);
    motors.effort.push_back(in + 4 + k); joints.effort.push_back(out + 4 + k);
    measured.position.push_back(in + k); backwards.position.push_back(back + k);
    measured.velocity.push_back(in + 2 + k); backwards.velocity.push_back(back + 2 + k);
    measured.effort.push_back(in + 4 + k); backwards.effort.push_back(back + 4 + k);
  }
  tested.actuatorToJointPosition(motors, joints);
  tested.actuatorToJointVelocity(motors, joints);
  tested.actuatorToJointEffort(motors, joints);
  tested.jointToActuatorPosition(measured, backwards);
  tested.jointToActuatorVelocity(measured, backwards);
  tested.jointToActuatorEffort(measured, backwards);
  numbers.insert(numbers.begin(), kind);
  for (double* all : {in, out, back}) numbers.insert(numbers.end(), all, all + 6);
  row(numbers);
}

int main() {
  begin("diff_drive", true);
  {
    diff_drive_controller::Odometry odometry(5);
    odometry.setWheelParams(0.43, 0.11, 0.12);
    ros::Time time(100, 0);
    odometry.init(time);
    double left = 0.3, right = -0.2;
    for (int k = 0; k < 40; k++) {
      double forward = draw(-0.4, 0.5);
      left += forward;
      right += k % 7 == 0 ? forward * 11 / 12 : draw(-0.3, 0.5);  // straight ahead, or not
      int ns = k % 9 == 4 ? 50000 : step();
      time += ros::Duration(0, ns);
      if (k == 20) odometry.init(time);
      odometry.update(left, right, time);
      row({(double)ns, (double)(k == 20), left, right, odometry.getX(), odometry.getY(), odometry.getHeading(),
           odometry.getLinear(), odometry.getAngular()});
    }
  }
  begin("open_loop");
  {
    diff_drive_controller::Odometry odometry(5);
    ros::Time time(100, 0);
    odometry.init(time);
    for (int k = 0; k < 15; k++) {
      double linear = draw(-2, 2), angular = k % 5 == 0 ? 0 : draw(-3, 3);
      int ns = step();
      time += ros::Duration(0, ns);
      odometry.updateOpenLoop(linear, angular, time);
      row({(double)ns, linear, angular, odometry.getX(), odometry.getY(), odometry.getHeading(),
           odometry.getLinear(), odometry.getAngular()});
    }
  }
  begin("ackermann");
  {
    ackermann_steering_controller::Odometry odometry(10);
    odometry.setWheelParams(1.3, 0.27);
    ros::Time time(100, 0);
    odometry.init(time);
    double wheel = 0;
    for (int k = 0; k < 25; k++) {
      wheel += draw(-0.4, 0.8);
      double angle = k % 6 == 0 ? 0 : draw(-0.9, 0.9);
      int ns = step();
      time += ros::Duration(0, ns);
      odometry.update(wheel, angle, time);
      row({(double)ns, wheel, angle, odometry.getX(), odometry.getY(), odometry.getHeading(),
           odometry.getLinear(), odometry.getAngular()});
    }
  }
  begin("speed_limiter");
  for (int k = 0; k < 48; k++) {
    int flags = k % 8;
    double limits[] = {draw(-2, 0), draw(0, 2), draw(-3, 0), draw(0, 3), draw(-40, 0), draw(0, 40)};
    diff_drive_controller::SpeedLimiter limiter(flags & 1, flags & 2, flags & 4, limits[0], limits[1], limits[2],
                                                limits[3], limits[4], limits[5]);
    double wanted = draw(-3, 3), last = draw(-2, 2), before = draw(-2, 2), dt = draw(0, 0.2), limited = wanted;
    limiter.limit(limited, last, before, dt);
    row({(double)flags, limits[0], limits[1], limits[2], limits[3], limits[4], limits[5], wanted, last, before, dt,
         limited});
  }
  begin("pid");
  for (int k = 0; k < 6; k++) {
    bool antiwindup = k % 2;
    double p = draw(0, 20), i = k == 4 ? 0 : draw(-10, 30), d = draw(0, 3), high = draw(0, 3), low = -draw(0, 3);
    control_toolbox::Pid pid(p, i, d, high, low, antiwindup);
    for (int n = 0; n < 15; n++) {
      double error = n == 7 ? none : draw(-1, 1), rate = n % 5 == 3 ? draw(-2, 2) : none;
      int ns = n == 9 ? 0 : n == 11 ? -10000000 : step();
      ros::Duration dt(0, ns);
      bool is_reset = n == 13;
      if (is_reset) pid.reset();
      double command = std::isnan(rate) ? pid.computeCommand(error, dt) : pid.computeCommand(error, rate, dt);
      double unused, integral;
      pid.getCurrentPIDErrors(&unused, &integral, &unused);
      row({p, i, d, high, low, (double)antiwindup, (double)is_reset, error, rate, (double)ns, command, integral});
    }
  }
  begin("transmissions");
  for (int k = 0; k < 10; k++) {
    std::vector<double> numbers;
    for (int n = 0; n < 6; n++) numbers.push_back(draw(0.1, 3) * (draw(0, 1) < 0.3 ? -1 : 1));
    std::vector<double> actuators(numbers.begin(), numbers.begin() + 2), joints(numbers.begin() + 2, numbers.begin() + 4);
    std::vector<double> offsets(numbers.begin() + 4, numbers.end());
    transmission::DifferentialTransmission differential(actuators, joints, offsets);
    transmission::FourBarLinkageTransmission linkage(actuators, joints, offsets);
    transmit(0, differential, numbers);
    transmit(1, linkage, numbers);
  }
  printf("\n ]\n}\n");
}
"""


def main() -> None:
    """Compile and run."""
    files = dict(HEADERS)
    for path, target in SOURCES.items():
        package = path.partition("/")[0]
        number = 1 if package.endswith("_controller") else 3 if package.endswith("_interface") else 2
        files[target] = read_file(sys.argv[number], BRANCH, path)
    libraries = "roscpp rostime rosconsole roscpp_serialization xmlrpcpp boost_thread boost_system pthread"
    recorded = output({**files, "main.cpp": MAIN}, [f"-l{each}" for each in libraries.split()])
    (Path(__file__).parent / "recorded.json").write_text(recorded)


if __name__ == "__main__":
    main()
