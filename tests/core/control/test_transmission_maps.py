"""Transmissions of a description as maps; test_recorded.py compares their numbers with ROS's."""

from __future__ import annotations

import pytest

from minirospy.core.control.hardware import HardwareError
from minirospy.core.control.transmission_maps import (
    DifferentialTransmission,
    FourBarLinkageTransmission,
    SimpleTransmission,
    load_transmissions,
)

WRIST = """<robot name="r"><transmission name="wrist"><type>transmission_interface/DifferentialTransmission</type>
<actuator name="upper"><role>actuator2</role><mechanicalReduction>-50</mechanicalReduction></actuator>
<actuator name="lower"><role>actuator1</role><mechanicalReduction>50</mechanicalReduction></actuator>
<joint name="roll"><role>joint2</role><offset>0.5</offset><mechanicalReduction>2</mechanicalReduction></joint>
<joint name="pitch"><role>joint1</role></joint></transmission>
<transmission name="arm"><type>transmission_interface/SimpleTransmission</type>
<actuator name="motor"><mechanicalReduction>-10</mechanicalReduction></actuator><joint name="elbow"><offset>0.25</offset></joint>
</transmission><transmission name="x"><type>other/Transmission</type></transmission></robot>"""


def test_parts_are_in_the_order_of_their_roles() -> None:
    loaded = load_transmissions(WRIST)
    wrist, arm = loaded["wrist"], loaded["arm"]
    assert list(loaded) == ["wrist", "arm"]
    assert isinstance(wrist, DifferentialTransmission)
    assert (wrist.actuators, wrist.joints) == (("lower", "upper"), ("pitch", "roll"))
    assert wrist.joint_positions([50.0, -50.0]) == [1.0, 0.5]
    assert wrist.actuator_positions([1.0, 0.5]) == pytest.approx([50.0, -50.0])
    assert isinstance(arm, SimpleTransmission)
    assert (arm.actuators, arm.joints) == (("motor",), ("elbow",))
    assert arm.joint_positions([20.0]) == [-1.75]
    assert (arm.joint_efforts([2.0]), arm.actuator_velocities([3.0])) == ([-20.0], pytest.approx([-30.0]))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            "<role>joint1</role>",
            "<role>joint3</role>",
            "Joint 'pitch' of transmission 'wrist' does not specify a valid <role> element. "
            "Got 'joint3', expected 'joint1' or 'joint2'.",
        ),
        (
            "<role>joint1</role>",
            "",
            "Joint 'pitch' of transmission 'wrist' does not specify the required <role> element.",
        ),
        (
            "<role>actuator1</role>",
            "<role>actuator2</role>",
            "Actuators 'upper' and 'lower' of transmission 'wrist' must have different roles. Both specify 'actuator2'.",
        ),
        (
            "<mechanicalReduction>50</mechanicalReduction>",
            "",
            "Actuator 'lower' of transmission 'wrist' does not specify the required <mechanicalReduction> element.",
        ),
        (
            ">0.5<",
            ">nan<",
            "Joint 'roll' of transmission 'wrist' specifies the <offset> element, but is not a number.",
        ),
        (">50<", ">0<", "Transmission reduction ratios cannot be zero."),
        (">-10<", ">0<", "Transmission reduction ratio cannot be zero."),
        (
            '<actuator name="motor">',
            '<actuator/><actuator name="motor">',
            "Invalid description for transmission 'arm' of type 'transmission_interface/SimpleTransmission'. "
            "Expected 1 actuators, got 2.",
        ),
    ],
)
def test_invalid_transmission_is_refused_with_the_text_of_ros(old: str, new: str, text: str) -> None:
    assert old in WRIST
    with pytest.raises(HardwareError) as caught:
        load_transmissions(WRIST.replace(old, new))
    assert str(caught.value) == text


def test_two_reductions_are_required() -> None:
    with pytest.raises(HardwareError, match="vectors of a four-bar linkage transmission must have size 2"):
        FourBarLinkageTransmission([1.0])


@pytest.mark.parametrize("kind", [DifferentialTransmission, FourBarLinkageTransmission])
@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e-160, 1e160, 1e200, 1e308])
def test_reductions_beyond_the_range_of_numbers_are_refused(
    kind: type[DifferentialTransmission | FourBarLinkageTransmission], size: float
) -> None:
    for actuators, joints in (((size, size), (size, size)), ((size, size), (1.0, 1.0))):
        with pytest.raises(HardwareError, match="too large or too small"):
            kind(actuators, joints)
