#!/bin/sh
# Real ROS 1 from Debian, the referee of the interop tests: rospy, roscpp, the commands, and what builds a C++ peer.
# Everything goes to /usr; nothing of it is used by minirospy itself. Does nothing where it is installed already.
set -eu
packages="ros-core openssh-server openssh-client rosbash python3-rospy python3-rosmaster python3-std-srvs python3-sensor-msgs python3-nav-msgs
python3-diagnostic-msgs python3-tf2-msgs python3-actionlib python3-numpy
ros-std-msgs ros-std-srvs ros-rosgraph-msgs ros-actionlib-msgs ros-geometry-msgs ros-sensor-msgs ros-diagnostic-msgs
ros-nav-msgs ros-roscpp-msg ros-shape-msgs ros-stereo-msgs ros-trajectory-msgs ros-visualization-msgs
ros-map-msgs ros-move-base-msgs ros-pcl-msgs ros-tf2-msgs ros-topic-tools-srvs
python3-shape-msgs python3-stereo-msgs python3-trajectory-msgs python3-visualization-msgs python3-map-msgs
python3-move-base-msgs python3-pcl-msgs python3-bond python3-dynamic-reconfigure python3-message-filters python3-angles python3-cv-bridge libdynamic-reconfigure-config-init-mutex-dev python3-rostest python3-topic-tools topic-tools libtopic-tools-dev libroslib-dev
python3-tf2-ros python3-tf python3-tf2-geometry-msgs python3-tf2-sensor-msgs python3-tf2-kdl python3-tf-conversions python3-pykdl
tf2-tools tf-tools libtf2-dev libtf2-ros-dev
catkin cmake ros-message-generation
python3-rosbag python3-roslz4
g++ pkg-config libroscpp-dev libsensor-msgs-dev libstd-srvs-dev libactionlib-dev iproute2
ros-robot-state-publisher joint-state-publisher liburdfdom-tools tf-tools tf2-tools python3-tf2-ros graphviz"
missing=""
for package in $packages; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || missing="$missing $package"
done
if [ -z "$missing" ]; then
  exit 0
fi
if ! command -v apt-get >/dev/null 2>&1; then
  echo "install_ros.sh: Debian's ROS 1 needs apt-get (Debian or Ubuntu)" >&2
  exit 1
fi
as_root=""
[ "$(id -u)" = 0 ] || as_root="sudo"
echo "Installing Debian's ROS 1 ..."
$as_root env DEBIAN_FRONTEND=noninteractive apt-get update -qq
# shellcheck disable=SC2086
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
