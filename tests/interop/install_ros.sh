#!/bin/sh
# Real ROS 1 from Debian, the referee of the interop tests: rospy, roscpp, the commands, and what builds a C++ peer.
# And the shells that the tests of setup files run in where they are installed.
# Everything goes to /usr; nothing of it is used by minirospy itself. Does nothing where it is installed already.
set -eu
# One package a line, sorted.
packages="
camera-calibration-parsers-tools
catkin
chromium
cmake
fish
g++
graphviz
image-transport-tools
iproute2
joint-state-publisher
libactionlib-dev
libbondcpp-dev
libdiagnostic-aggregator-dev
libdiagnostic-aggregator-tools
libdynamic-reconfigure-config-init-mutex-dev
libgl1-mesa-dri
liblaser-geometry-dev
libroscpp-dev
libroslib-dev
libsensor-msgs-dev
libstd-srvs-dev
libtf2-dev
libtf2-ros-dev
libtopic-tools-dev
liburdfdom-tools
openssh-client
openssh-server
pkg-config
python3-actionlib
python3-angles
python3-bond
python3-bondpy
python3-camera-calibration-parsers
python3-cv-bridge
python3-diagnostic-msgs
python3-diagnostic-updater
python3-dynamic-reconfigure
python3-image-geometry
python3-interactive-markers
python3-laser-geometry
python3-map-msgs
python3-message-filters
python3-move-base-msgs
python3-nav-msgs
python3-numpy
python3-pcl-msgs
python3-pykdl
python3-resource-retriever
python3-rosbag
python3-roslz4
python3-rosmaster
python3-rospy
python3-rostest
python3-sensor-msgs
python3-shape-msgs
python3-std-srvs
python3-stereo-msgs
python3-tf
python3-tf-conversions
python3-tf2-geometry-msgs
python3-tf2-kdl
python3-tf2-msgs
python3-tf2-ros
python3-tf2-sensor-msgs
python3-topic-tools
python3-trajectory-msgs
python3-visualization-msgs
ros-actionlib-msgs
ros-core
ros-diagnostic-msgs
ros-geometry-msgs
ros-map-msgs
ros-message-generation
ros-move-base-msgs
ros-nav-msgs
ros-pcl-msgs
ros-robot-state-publisher
ros-roscpp-msg
ros-rosgraph-msgs
ros-sensor-msgs
ros-shape-msgs
ros-std-msgs
ros-std-srvs
ros-stereo-msgs
ros-tf2-msgs
ros-topic-tools-srvs
ros-trajectory-msgs
ros-visualization-msgs
rosbash
rviz
shellcheck
tf-tools
tf2-tools
topic-tools
xvfb
zsh
"
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
