"""The Python package catkin_pkg, for programs and setup.py files that import it."""
