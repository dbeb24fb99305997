"""Joints whose state is not a number, infinite or huge: the controllers' commands stay finite."""

from __future__ import annotations

from tests.ros.control.conftest import Run


def test_commands_stay_finite_whatever_the_hardware_reads(run: Run) -> None:
    shown = run("""
        import random
        gains = {"p": 100.0, "i": 10.0, "d": 5.0, "i_clamp": 3.0}
        base = {"publish_rate": 50, "wheel_radius": 0.1, "cmd_vel_timeout": 1e9,
                "pose_covariance_diagonal": [1] * 6, "twist_covariance_diagonal": [1.0] * 6}
        cases = {
            "position_controllers/JointGroupPositionController": {"joints": ["lift", "elbow"]},
            "velocity_controllers/JointPositionController": {"joint": "elbow", "pid": gains},
            "effort_controllers/JointPositionController": {"joint": "wrist", "pid": gains},
            "effort_controllers/JointVelocityController": {"joint": "lift", "pid": {**gains, "antiwindup": True}},
            "effort_controllers/JointGroupPositionController": {"joints": ["lift", "elbow", "wrist"],
                **{name: {"pid": gains} for name in ("lift", "elbow", "wrist")}},
            "joint_state_controller/JointStateController": {"publish_rate": 50},
            "diff_drive_controller/DiffDriveController": {**base, "left_wheel": "elbow", "right_wheel": "wrist",
                "wheel_separation": 1.0, "publish_wheel_joint_controller_state": True},
            "ackermann_steering_controller/AckermannSteeringController": {**base, "rear_wheel": "elbow",
                "front_steer": "wrist", "wheel_separation_h": 1.0},
        }
        states = [0.0, 1.0, -2.5, float("nan"), float("inf"), -float("inf"), 1e308, -1e308]
        draw = random.Random(5).choice
        wrong = []
        for kind, values in cases.items():
            rig = Rig(kind, values, "lift elbow wrist", ARM)
            for cycle in range(400):
                for joint in rig.hardware.joints.values():
                    joint.position, joint.velocity, joint.effort = draw(states), draw(states), draw(states)
                if cycle % 40 == 0:
                    rig.start()
                rig.cycle(1, draw([10, 0, 1]))
                for joint in rig.hardware.joints.values():
                    numbers = [joint.position_command, joint.velocity_command, joint.effort_command]
                    if not all(abs(number) < float("inf") for number in numbers):
                        wrong.append([kind, str(numbers)])
            rig.controller.close()
        show(wrong)
    """)
    assert shown == []
