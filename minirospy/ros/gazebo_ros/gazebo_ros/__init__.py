"""The Python package of gazebo_ros. Source: http://wiki.ros.org/gazebo_ros."""

__all__: list[str] = []
