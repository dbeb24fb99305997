"""The commands of catkin and catkin_tools, for workspaces without CMake."""
