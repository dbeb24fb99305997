"""The types that ros_controllers' packages export, as ROS names them, and their hardware interfaces."""

from __future__ import annotations

from minirospy.core.control.hardware import Interface
from minirospy.ros.controller_manager.plugins import find_plugins

TYPES = {
    "ackermann_steering_controller/AckermannSteeringController": (Interface.POSITION, Interface.VELOCITY),
    "diff_drive_controller/DiffDriveController": (Interface.VELOCITY,),
    "effort_controllers/JointEffortController": (Interface.EFFORT,),
    "effort_controllers/JointGroupEffortController": (Interface.EFFORT,),
    "effort_controllers/JointGroupPositionController": (Interface.EFFORT,),
    "effort_controllers/JointPositionController": (Interface.EFFORT,),
    "effort_controllers/JointVelocityController": (Interface.EFFORT,),
    "force_torque_sensor_controller/ForceTorqueSensorController": (Interface.FORCE_TORQUE,),
    "four_wheel_steering_controller/FourWheelSteeringController": (),
    "imu_sensor_controller/ImuSensorController": (Interface.IMU,),
    "joint_state_controller/JointStateController": (Interface.JOINT_STATE,),
    "position_controllers/JointGroupPositionController": (Interface.POSITION,),
    "position_controllers/JointPositionController": (Interface.POSITION,),
    "velocity_controllers/JointGroupVelocityController": (Interface.VELOCITY,),
    "velocity_controllers/JointPositionController": (Interface.VELOCITY,),
    "velocity_controllers/JointVelocityController": (Interface.VELOCITY,),
}


def test_types() -> None:
    plugins = find_plugins()
    for name, interfaces in TYPES.items():
        assert plugins[name].python == name.replace("/", ".")
        assert plugins[name].load().interfaces == interfaces
