"""PID controllers as ROS shows them: dynamic_reconfigure of the gains, and the topic of the terms."""

from __future__ import annotations

from tests.ros.control.conftest import Run


def test_dynamic_reconfigure_shows_and_changes_the_gains(run: Run) -> None:
    shown = run("""
        from control_toolbox import Pid
        from controller_interface import Parameters
        from dynamic_reconfigure.client import Client
        values = {"p": 20, "i_clamp": 5.0}
        rospy.set_param("/arm/pid", values)
        parameters = Parameters("/arm/pid", values)
        pid = Pid.read(parameters)
        pid.serve(parameters)
        client = Client("/arm/pid", timeout=30)
        described = client.get_parameter_descriptions()
        first, gains = client.get_configuration(), pid.gains
        client.update_configuration({"d": 2000.0, "i_clamp_max": 7.0, "antiwindup": True})
        changed, stored = pid.gains, rospy.get_param("/arm/pid")
        client.update_configuration({"p": float("nan")})
        pid.set_gains(pid.gains._replace(p=9.0))
        show([[[each["name"], each["min"], each["max"], each["default"]] for each in described],
              [first[name] for name in ("p", "i", "d", "i_clamp_min", "i_clamp_max", "antiwindup")], gains,
              changed, stored, pid.gains, rospy.get_param("/arm/pid/p")])
        pid.close()
    """)
    described, first, gains, changed, stored, last, p = shown
    assert described == [
        ["p", -100000, 100000, 10.0],
        ["i", -100000, 100000, 0.1],
        ["d", -1000, 1000, 1.0],
        ["i_clamp_min", -100000, 0, -10.0],
        ["i_clamp_max", 0, 100000, 10.0],
        ["antiwindup", False, True, False],
    ]
    assert first == [20.0, 0.0, 0.0, -5.0, 5.0, False]
    assert gains == [20.0, 0.0, 0.0, 5.0, -5.0, False]
    assert changed == [20.0, 0.0, 1000.0, 7.0, -5.0, True]
    assert (stored["d"], stored["i_clamp"], stored["i_clamp_min"]) == (1000.0, 5.0, -5.0)
    assert (last, p) == ([9.0, *changed[1:]], 9.0)


def test_the_terms_are_published_if_a_parameter_is_set(run: Run) -> None:
    shown = run("""
        from control_msgs.msg import PidState
        from control_toolbox import Pid
        from controller_interface import Parameters
        values = {"p": 2.0, "i": 3.0, "d": 0.5, "i_clamp": 4.0, "publish_state": True}
        parameters = Parameters("/arm/pid", values)
        pid = Pid.read(parameters)
        pid.serve(parameters)
        received = Received("/arm/pid/state", PidState)
        wait_until(lambda: pid._state._publisher.get_num_connections())
        pid.compute(1.0, None, 0.0)
        pid.compute(1.0, None, 0.5)
        m = received.wait()
        show([m.timestep.to_sec(), m.error, m.error_dot, m.p_error, m.i_error, m.d_error, m.p_term, m.i_term, m.d_term,
              m.i_max, m.i_min, m.output, m.header.stamp.to_sec() > 0])
        pid.close()
    """)
    assert shown == [0.5, 1.0, 2.0, 1.0, 0.5, 2.0, 2.0, 1.5, 1.0, 4.0, -4.0, 4.5, True]
