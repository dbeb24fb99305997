"""Parameters of a wrong type or value: a controller is loaded, or refused with one of the errors that the manager logs."""

from __future__ import annotations

from tests.ros.control.conftest import Run


def test_wrong_parameters_are_refused_or_have_no_effect(run: Run) -> None:
    shown = run("""
        limits = {f"{bound}_{name}": 1.0 for bound in ("min", "max") for name in ("velocity", "acceleration", "jerk")}
        limits |= {f"has_{name}_limits": True for name in ("velocity", "acceleration", "jerk")}
        base = {
            "publish_rate": 50, "open_loop": True, "velocity_rolling_window_size": 10, "cmd_vel_timeout": 1.0,
            "allow_multiple_cmd_vel_publishers": True, "base_frame_id": "b", "odom_frame_id": "o", "enable_odom_tf": True,
            "linear/x": limits, "wheel_radius": 0.1, "wheel_radius_multiplier": 1.0, "publish_cmd": True,
            "pose_covariance_diagonal": [1] * 6, "twist_covariance_diagonal": [1.0] * 6,
        }
        gains = {"p": 1.0, "i": 1.0, "d": 1.0, "i_clamp": 1.0, "i_clamp_min": -1.0, "antiwindup": True, "publish_state": True}
        cases = {
            "position_controllers/JointPositionController": {"joint": "lift"},
            "velocity_controllers/JointGroupVelocityController": {"joints": ["lift"]},
            "velocity_controllers/JointPositionController": {"joint": "lift", "pid": gains},
            "effort_controllers/JointVelocityController": {"joint": "lift", "pid": gains},
            "effort_controllers/JointGroupPositionController": {"joints": ["lift"], "lift": {"pid": gains}},
            "joint_state_controller/JointStateController": {
                "publish_rate": 50, "joints": ["lift"],
                "extra_joints": [{"name": "x", "position": 1.0, "velocity": 1.0, "effort": 1.0}]},
            "imu_sensor_controller/ImuSensorController": {"publish_rate": 50},
            "diff_drive_controller/DiffDriveController": {
                **base, "left_wheel": "elbow", "right_wheel": ["wrist"], "wheel_separation": 1.0,
                "publish_wheel_joint_controller_state": True},
            "ackermann_steering_controller/AckermannSteeringController": {
                **base, "rear_wheel": "elbow", "front_steer": "wrist", "wheel_separation_h": 1.0},
        }
        wrong = ["", "x", [], {}, -1, 0, float("nan"), float("inf"), 1e300, True, [1], ["lift", "lift"], [{}], {"a": 1}, [[]]]

        tried = []  # gains, which the same code reads for all controllers

        def changed(value, known=()):
            yield from wrong
            if isinstance(value, dict) and value not in tried:
                if value is gains:
                    tried.append(gains)
                for key, inner in value.items():
                    if key in known:
                        continue
                    yield {name: other for name, other in value.items() if name != key}
                    yield from ({**value, key: each} for each in changed(inner))
            elif isinstance(value, list):
                for index, inner in enumerate(value):
                    yield from ([*value[:index], each, *value[index + 1:]] for each in changed(inner))

        plugins = find_plugins()
        Rig.__init__.__globals__["find_plugins"] = lambda: plugins  # read once
        loaded = refused = 0
        for kind, values in cases.items():
            for each in changed(values, base if kind.startswith("ackermann") else ()):  # base: read as for diff_drive
                if not isinstance(each, dict):
                    continue
                try:
                    rig = Rig(kind, each, "lift elbow wrist", ARM)
                    rig.start()
                    rig.cycle(2)
                    rig.controller.stopping(rig.now)
                    rig.controller.close()
                    for joint in rig.hardware.joints.values():
                        numbers = [joint.position_command, joint.velocity_command, joint.effort_command]
                        assert all(abs(number) < float("inf") for number in numbers), (kind, each, numbers)
                    loaded += 1
                except (MinirospyError, ValueError):
                    refused += 1
        show([loaded, refused])
    """)
    loaded, refused = shown
    assert loaded > 100
    assert refused > 100
