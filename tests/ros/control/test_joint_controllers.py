"""position_controllers, velocity_controllers and effort_controllers: commands, PID, limits, texts and states."""

from __future__ import annotations

import pytest

from tests.ros.control.conftest import Run


@pytest.mark.parametrize(
    ("kind", "field", "first"),
    [
        ("position_controllers/JointPositionController", "position_command", 0.25),
        ("velocity_controllers/JointVelocityController", "velocity_command", 0.0),
        ("effort_controllers/JointEffortController", "effort_command", 0.0),
    ],
)
def test_commands_reach_a_joint(run: Run, kind: str, field: str, first: float) -> None:
    program = f"""
        from std_msgs.msg import Float64
        rig = Rig("{kind}", {{"joint": "j"}}, "j k")
        rig.joint("j").position = 0.25
        rig.start()
        rig.cycle()
        seen = [rig.joint("j").{field}]
        topic = Publisher("/c/command", Float64)
        values = lambda: rig.controller._command.values[0]
        topic.send(Float64(0.5), lambda: values() == 0.5)
        rig.cycle()
        seen.append(rig.joint("j").{field})
        log = Logged()
        topic.send(Float64(float("nan")), log.has(1))
        topic.send(Float64(0.75), lambda: values() == 0.75)
        topic.send(Float64(float("inf")), lambda: True)
        rig.cycle()
        seen.append(rig.joint("j").{field})
        rig.start()
        rig.cycle()
        seen.append(rig.joint("j").{field})
        claims = [(each.interface, each.resources) for each in rig.resources.claimed(())]
        rig.controller.close()
        show([seen, log.lines, claims])
    """
    shown = run(program, is_simulated=True)  # the time stands still, so a throttled line appears once
    interface = field.removesuffix("_command").title()
    assert shown == [
        [first, 0.5, 0.75, first],
        ["WARNING: Command on /c/command is not finite: [nan]. Ignoring."],
        [[f"hardware_interface::{interface}JointInterface", ["j"]]],
    ]


@pytest.mark.parametrize(
    ("kind", "field", "first"),
    [
        ("position_controllers/JointGroupPositionController", "position_command", [0.25, 0.5]),
        ("velocity_controllers/JointGroupVelocityController", "velocity_command", [0.0, 0.0]),
        ("effort_controllers/JointGroupEffortController", "effort_command", [0.0, 0.0]),
    ],
)
def test_commands_reach_a_group_of_joints(run: Run, kind: str, field: str, first: list[float]) -> None:
    shown = run(f"""
        from std_msgs.msg import Float64MultiArray
        rig = Rig("{kind}", {{"joints": ["j", "k"]}}, "j k l")
        rig.joint("j").position, rig.joint("k").position = 0.25, 0.5
        rig.start()
        rig.cycle()
        now = lambda: [rig.joint(each).{field} for each in "jk"]
        seen = [now()]
        topic = Publisher("/c/command", Float64MultiArray)
        values = lambda: list(rig.controller._command.values)
        topic.send(Float64MultiArray(data=[3.0, 4.0]), lambda: values() == [3.0, 4.0])
        rig.cycle()
        seen.append(now())
        wrong = [[1.0], [1.0, float("nan")], []]
        log = Logged()
        for number, each in enumerate(wrong, 1):
            topic.send(Float64MultiArray(data=each), log.has(number))
        topic.send(Float64MultiArray(data=[5.0, 6.0]), lambda: values() == [5.0, 6.0])
        rig.cycle()
        seen.append(now())
        rig.controller.close()
        show([seen, log.lines, rig.joint("l").{field}])
    """)
    assert shown == [
        [first, [3.0, 4.0], [5.0, 6.0]],
        [
            "ERROR: Dimension of command (1) does not match number of joints (2)! Not executing!",
            "WARNING: Command on /c/command is not finite: [1.0, nan]. Ignoring.",
            "ERROR: Dimension of command (0) does not match number of joints (2)! Not executing!",
        ],
        0.0,
    ]


def test_missing_parameters_have_the_texts_of_ros(run: Run) -> None:
    shown = run("""
        one, group = "position_controllers/JointPositionController", "effort_controllers/JointGroupPositionController"
        pid, gains = "effort_controllers/JointPositionController", {"pid": {"p": 1.0}}
        show([failure(lambda: Rig(kind, values, "j lift", text)) for kind, values, text in (
            (one, {}, ""), (one, {"joint": 5}, ""), (one, {"joint": "x"}, ""),
            (group, {}, ""), (group, {"joints": []}, ""), (group, {"joints": "j"}, ""), (group, {"joints": ["x"]}, ""),
            (group, {"joints": ["lift"]}, ARM),
            (pid, {}, ""), (pid, {"joint": "j"}, ""), (pid, {"joint": "j", **gains}, ""),
            (pid, {"joint": "j", **gains}, ARM),
        )])
    """)
    no_joint = "No joint given (namespace: /c)"
    no_joints = "Failed to getParam 'joints' (namespace: /c)."
    assert shown == [
        no_joint,
        no_joint,
        "Could not find resource 'x' in 'hardware_interface::PositionJointInterface'.",
        no_joints,
        "List of joint names is empty.",
        no_joints,
        "Exception thrown: Could not find resource 'x' in 'hardware_interface::EffortJointInterface'.",
        "Failed to load PID parameters from lift/pid",
        no_joint,
        "No p gain specified for pid.  Namespace: /c/pid",
        "Failed to parse urdf file",
        "Could not find joint 'j' in urdf",
    ]


@pytest.mark.parametrize(
    ("kind", "field"),
    [
        ("effort_controllers/JointPositionController", "effort_command"),
        ("velocity_controllers/JointPositionController", "velocity_command"),
    ],
)
def test_pid_reaches_positions_within_the_limits(run: Run, kind: str, field: str) -> None:
    shown = run(f"""
        from control_msgs.msg import JointControllerState
        from std_msgs.msg import Float64
        gains = {{"p": 10.0, "i": 1.0, "d": 0.0, "i_clamp": 2.0, "antiwindup": True}}
        rig = Rig("{kind}", {{"joint": "lift", "pid": gains}}, "lift", ARM)
        lift = rig.joint("lift")
        states = Received("/c/state", JointControllerState)
        wait_until(lambda: rig.controller._state._publisher.get_num_connections())
        lift.position = 1.5
        rig.start()
        rig.cycle()
        beyond = lift.{field}
        state = states.wait()
        shown = [getattr(state, each) for each in ("set_point process_value process_value_dot error time_step command "
                                                   "p i d i_clamp antiwindup").split()]
        topic = Publisher("/c/command", Float64)
        topic.send(Float64(7.0), lambda: rig.controller._command.values[0] == 7.0)
        for cycle in range(1, 401):
            lift.velocity = lift.{field}
            lift.position += lift.{field} * 0.01
            rig.cycle()
            states.wait(1 + cycle // 10)
        count = len(states.messages)
        lift.position = float("nan")
        rig.cycle()
        lost = lift.{field}
        rig.controller.close()
        show([beyond, shown, state.header.stamp.to_sec(), count, states.messages[-1].process_value, lost])
    """)
    beyond, state, stamp, count, end, lost = shown
    assert beyond == pytest.approx(-5.0 - 0.005)
    assert state == pytest.approx([1.0, 1.5, 0.0, -0.5, 0.01, -5.005, 10.0, 1.0, 0.0, 2.0, True])
    assert (stamp, count, lost) == (100.01, 41, 0.0)
    assert end == pytest.approx(1.0, abs=0.01)


def test_effort_reaches_velocities(run: Run) -> None:
    shown = run("""
        from control_msgs.msg import JointControllerState
        from std_msgs.msg import Float64
        rig = Rig("effort_controllers/JointVelocityController", {"joint": "j", "pid": {"p": 2.0}}, "j")
        states = Received("/c/state", JointControllerState)
        wait_until(lambda: rig.controller._state._publisher.get_num_connections())
        rig.joint("j").velocity = 0.5
        rig.start()
        rig.cycle()
        seen = [rig.joint("j").effort_command]
        Publisher("/c/command", Float64).send(Float64(3.0), lambda: rig.controller._command.values[0] == 3.0)
        rig.cycle()
        seen.append(rig.joint("j").effort_command)
        state = states.wait()
        rig.controller.close()
        show([seen, [state.set_point, state.process_value, state.error, state.command, state.p]])
    """)
    assert shown == [[-1.0, 5.0], [0.0, 0.5, -0.5, -1.0, 2.0]]


def test_efforts_reach_the_positions_of_a_group(run: Run) -> None:
    shown = run("""
        from std_msgs.msg import Float64MultiArray
        names = ["lift", "elbow", "wrist"]
        values = {"joints": names, **{each: {"pid": {"p": 10.0}} for each in names}}
        rig = Rig("effort_controllers/JointGroupPositionController", values, "lift elbow wrist", ARM)
        for each in names: rig.joint(each).position = 3.0
        efforts = lambda: [rig.joint(each).effort_command for each in names]
        rig.start()
        rig.cycle()
        seen = [efforts()]
        target = [0.5, -3.0, -3.0]
        Publisher("/c/command", Float64MultiArray).send(
            Float64MultiArray(data=target), lambda: list(rig.controller._command.values) == target)
        rig.cycle()
        seen.append(efforts())
        rig.controller.close()
        show(seen)
    """)
    assert shown[0] == [-20.0, 0.0, 0.0]
    assert shown[1] == pytest.approx([-25.0, -60.0, 10 * (2 * 3.141592653589793 - 6.0)])
