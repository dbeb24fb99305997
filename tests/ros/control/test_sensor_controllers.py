"""joint_state_controller, imu_sensor_controller and force_torque_sensor_controller."""

from __future__ import annotations

from tests.ros.control.conftest import Run


def test_joint_states_are_published_at_the_rate(run: Run) -> None:
    shown = run("""
        from sensor_msgs.msg import JointState
        rig = Rig("joint_state_controller/JointStateController", {"publish_rate": 20}, "b a c")
        states = Received("/joint_states", JointState)
        wait_until(lambda: rig.controller._publisher._publisher.get_num_connections())
        rig.joint("a").position, rig.joint("b").velocity, rig.joint("c").effort = float("nan"), 2.0, 3.0
        rig.start()
        for cycle in range(17):
            rig.cycle()
            states.wait(1 + cycle // 5)
        rig.start()
        rig.cycle(4)
        states.wait(5)
        first = states.messages[0]
        rig.controller.close()
        show([first.name, str(first.position), first.velocity, first.effort,
              [each.header.stamp.to_nsec() // 10**6 - 100000 for each in states.messages]])
    """)
    assert shown == [
        ["a", "b", "c"],
        "(nan, 0.0, 0.0)",
        [0.0, 2.0, 0.0],
        [0.0, 0.0, 3.0],
        [10, 60, 110, 160, 210],
    ]


def test_chosen_and_extra_joints(run: Run) -> None:
    shown = run("""
        from sensor_msgs.msg import JointState
        extra = [
            {"name": "wheel", "position": 1.5, "effort": 2.5}, {"name": "a"}, {"position": 1.0}, "x", 5,
            {"name": "p", "position": 1}, {"name": "v", "velocity": "fast"}, {"name": "e", "effort": True}, {"name": "last"},
        ]
        log = Logged()
        values = {"publish_rate": 50, "joints": ["c", "a"], "extra_joints": extra}
        rig = Rig("joint_state_controller/JointStateController", values, "a b c")
        states = Received("/joint_states", JointState)
        wait_until(lambda: rig.controller._publisher._publisher.get_num_connections())
        rig.joint("c").position = 4.0
        rig.start()
        rig.cycle()
        state = states.wait()
        rig.controller.close()
        show([log.lines, state.name, state.position, state.velocity, state.effort])
    """)
    assert shown[0] == [
        "INFO: Joints parameter specified, publishing specified joints in desired order.",
        "WARNING: Joint state interface already contains specified extra joint 'a'.",
        "ERROR: Extra joint does not specify name. Ignoring.",
        "ERROR: Extra joint specification is not a struct, but rather '4'. Ignoring.",
        "ERROR: Extra joint specification is not a struct, but rather '2'. Ignoring.",
        "ERROR: Extra joint 'p' does not specify a valid default position. Ignoring.",
        "ERROR: Extra joint 'v' does not specify a valid default velocity. Ignoring.",
        "ERROR: Extra joint 'e' does not specify a valid default effort. Ignoring.",
    ]
    assert shown[1:] == [
        ["c", "a", "wheel", "last"],
        [4.0, 0.0, 1.5, 0.0],
        [0.0] * 4,
        [0.0, 0.0, 2.5, 0.0],
    ]


def test_wrong_parameters_have_the_texts_of_ros(run: Run) -> None:
    shown = run("""
        log = Logged()
        kind = "joint_state_controller/JointStateController"
        show([failure(lambda: Rig(kind, {}, "a")),
              failure(lambda: Rig(kind, {"publish_rate": 50, "joints": ["x"]}, "a")),
              failure(lambda: Rig(kind, {"publish_rate": float("nan")}, "a")),
              failure(lambda: Rig("imu_sensor_controller/ImuSensorController", {}, "a")),
              [Rig(kind, {"publish_rate": 50, "extra_joints": {}}, "a") and log.lines[-1]]])
    """)
    assert shown == [
        "Parameter 'publish_rate' not set",
        "Could not find resource 'x' in 'hardware_interface::JointStateInterface'.",
        "parameter /c/publish_rate is nan: it must be a finite number",
        "Parameter 'publish_rate' not set",
        ["ERROR: Extra joints specification is not an array. Ignoring."],
    ]


def test_inertial_sensors_are_published(run: Run) -> None:
    shown = run("""
        from hardware_interface import ImuSensor
        from sensor_msgs.msg import Imu
        hardware = RobotHardware()
        hardware.imus["full"] = ImuSensor("full", "imu_link", (0.1, 0.2, 0.3, 0.9), [1.0] * 9, (1.0, 2.0, 3.0), None,
                                          (float("nan"), 5.0, 9.81), [3.0] * 9)
        hardware.imus["bare"] = ImuSensor("bare", "bare_link")
        rig = Rig("imu_sensor_controller/ImuSensorController", {"publish_rate": 50}, "", hardware=hardware)
        topics = [Received("/" + name, Imu) for name in ("bare", "full")]
        wait_until(lambda: all(each._publisher.get_num_connections() for _, each in rig.controller._topics))
        rig.start()
        rig.cycle(3)
        bare, full = (each.wait() for each in topics)
        rig.controller.close()
        numbers = lambda part: [round(getattr(part, each), 3) for each in part.__slots__]
        show([[str(numbers(each)) for each in (full.orientation, full.angular_velocity, full.linear_acceleration)],
              [full.header.frame_id, full.header.stamp.to_sec()],
              [each.orientation_covariance[:2] + each.angular_velocity_covariance[:2] + each.linear_acceleration_covariance[:2]
               for each in (full, bare)]])
    """)
    assert shown == [
        ["[0.1, 0.2, 0.3, 0.9]", "[1.0, 2.0, 3.0]", "[nan, 5.0, 9.81]"],
        ["imu_link", 100.03],
        [[1.0, 1.0, 0.0, 0.0, 3.0, 3.0], [-1.0, 0.0, -1.0, 0.0, -1.0, 0.0]],
    ]


def test_forces_and_torques_are_published(run: Run) -> None:
    shown = run("""
        from geometry_msgs.msg import WrenchStamped
        from hardware_interface import ForceTorqueSensor
        hardware = RobotHardware()
        hardware.force_torque_sensors["wrist"] = ForceTorqueSensor("wrist", "tool0", (1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
        kind = "force_torque_sensor_controller/ForceTorqueSensorController"
        rig = Rig(kind, {"publish_rate": 50}, "", hardware=hardware)
        topic = Received("/wrist", WrenchStamped)
        wait_until(lambda: rig.controller._topics[0][1]._publisher.get_num_connections())
        rig.start()
        rig.cycle(3)
        m = topic.wait()
        rig.controller.close()
        f, t = m.wrench.force, m.wrench.torque
        show([m.header.frame_id, m.header.stamp.to_sec(), f.x, f.y, f.z, t.x, t.y, t.z])
    """)
    assert shown == ["tool0", 100.03, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
