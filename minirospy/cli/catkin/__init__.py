"""The commands of catkin and catkin_tools: workspaces without CMake."""
