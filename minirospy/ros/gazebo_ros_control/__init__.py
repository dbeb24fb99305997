"""ros_control in the simulation. Source: https://classic.gazebosim.org/tutorials?tut=ros_control."""
