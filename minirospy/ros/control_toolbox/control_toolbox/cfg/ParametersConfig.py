"""The gains of a PID controller, in the form that catkin_make generates from control_toolbox's Parameters.cfg."""

from minirospy.ros.dynamic_reconfigure.definition import Definition

__all__ = ["all_level", "config_description", "defaults", "level", "max", "min", "type"]

_gains = Definition()
_gains.add("p", "double", 1, "Proportional gain.", 10.0, -100000, 100000)
_gains.add("i", "double", 1, "Integral gain.", 0.1, -100000, 100000)
_gains.add("d", "double", 1, "Derivative gain.", 1.0, -1000, 1000)
_gains.add("i_clamp_min", "double", 1, "Min bounds for the integral windup", -10.0, -100000, 0)
_gains.add("i_clamp_max", "double", 1, "Max bounds for the integral windup", 10.0, 0, 100000)
_gains.add("antiwindup", "bool", 1, "Antiwindup.", False)

config_description = _gains.config_description
defaults = _gains.defaults
min = _gains.min
max = _gains.max
level = _gains.level
type = _gains.type
all_level = 1
