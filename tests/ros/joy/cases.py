"""Inputs for joy_node and teleop_node (drive.py)."""

from __future__ import annotations

BUTTON, AXIS, INIT = 1, 2, 0x80
OPTIONS: dict[str, dict[str, object]] = {
    "usual": {},
    "sticky": {"sticky_buttons": True},
    "triggers": {"default_trig_val": True, "deadzone": 0.0},
    "wide deadzone": {"deadzone": 0.5},
    "old deadzone": {"deadzone": 8000},
    "negative": {"deadzone": -1, "autorepeat_rate": -1},
}
# Each step consists of events that are sent together, and the number of resulting messages.
STEPS = (
    ([(AXIS | INIT, 0, 20000), (AXIS | INIT, 3, -32767), (BUTTON | INIT, 0, 0), (BUTTON | INIT, 2, 1)], 1),
    ([(BUTTON, 0, 1)], 1),
    ([(BUTTON, 0, 0)], 1),
    ([(BUTTON, 1, 1)], 1),
    ([(BUTTON, 1, 0)], 1),
    ([(BUTTON, 1, 1)], 1),
    ([(AXIS, 0, 32767)], 1),
    ([(AXIS, 0, 100), (AXIS, 1, -32767), (AXIS, 2, 16384)], 1),
    ([(AXIS, 1, -32768), (AXIS, 2, 1638), (AXIS, 3, 1639)], 1),
    ([(AXIS, 5, -1639)], 1),
    ([(AXIS, 0, 12345), (BUTTON, 4, 1), (AXIS, 1, 7)], 2),
    ([(BUTTON, 0, 5)], 1),
)
STATES = (
    ([0.5, 1.0, -0.25], [0, 0, 0]),
    ([0.5, 1.0, -0.25], [1, 0, 0]),
    ([0.5, -1.0, -0.25], [1, 0, 0]),
    ([0.5, 1.0, -0.25], [1, 1, 0]),
    ([0.5, 1.0, -0.25], [0, 1, 0]),
    ([0.5], [1, 1, 0]),
    ([], [1]),
    ([0.5, 1.0], []),
    ([0.5, 1.0, 1.0], [0, 0, 1]),
)
TELEOPS: dict[str, dict[str, object]] = {
    "plain": {},
    "turbo": {"enable_turbo_button": 1, "scale_linear": 0.75},
    "maps": {
        "enable_button": 2,
        "enable_turbo_button": 1,
        "axis_linear": {"x": 1, "y": 0, "z": 2},
        "scale_linear": {"x": 0.5, "y": 0.25},
        "scale_linear_turbo": {"x": 2.0, "z": 3.0},
        "axis_angular": {"yaw": 0, "pitch": 1, "roll": 2},
        "scale_angular": {"yaw": 1.0, "pitch": 2.0, "roll": 4.0},
    },
    "angular turbo": {
        "axis_angular": 2,
        "scale_angular": 0.5,
        "scale_angular_turbo": 1.5,
        "enable_turbo_button": 1,
    },
    "other types": {"axis_linear": "left", "scale_linear": "fast", "enable_button": 1.0},
    "far": {"axis_linear": 7, "axis_angular": -1, "enable_button": 9},
}
