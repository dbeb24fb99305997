"""moveit_commander, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import moveit_commander as moveit_commander
