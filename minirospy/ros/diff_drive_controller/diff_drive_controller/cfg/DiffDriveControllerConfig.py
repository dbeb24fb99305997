"""Parameters that can be changed while a base drives, in the form that catkin_make generates from DiffDriveController.cfg."""

from minirospy.ros.dynamic_reconfigure.definition import Definition

__all__ = ["all_level", "config_description", "defaults", "level", "max", "min", "type"]

_drive = Definition()
_drive.add("left_wheel_radius_multiplier", "double", 0, "Left wheel radius multiplier.", 1.0, 0.5, 1.5)
_drive.add("right_wheel_radius_multiplier", "double", 0, "Right wheel radius multiplier.", 1.0, 0.5, 1.5)
_drive.add("wheel_separation_multiplier", "double", 0, "Wheel separation multiplier.", 1.0, 0.5, 1.5)
_drive.add("publish_rate", "double", 0, "Publish rate of odom.", 50.0, 0.0, 2000.0)
_drive.add("enable_odom_tf", "bool", 0, "Publish odom frame to tf.", True)

config_description = _drive.config_description
defaults = _drive.defaults
min = _drive.min
max = _drive.max
level = _drive.level
type = _drive.type
all_level = 0
