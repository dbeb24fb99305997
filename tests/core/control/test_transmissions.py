"""Transmissions of a description: hardware interfaces in the old and in the new place, and those that are skipped."""

from __future__ import annotations

import pytest

from minirospy.base.errors import UrdfError
from minirospy.core.control.hardware import Interface
from minirospy.core.control.transmissions import read_transmissions

SIMPLE = "transmission_interface/SimpleTransmission"


def read(*transmissions: str) -> tuple[dict[str, tuple[Interface, ...]], list[str]]:
    """Return the interfaces of each joint, and the warnings."""
    warnings: list[str] = []
    found = read_transmissions(f"<robot name='r'>{''.join(transmissions)}</robot>", warnings.append)
    return {each.joint: each.interfaces for each in found}, warnings


def simple(joint: str, in_joint: str = "", in_actuator: str = "", kind: str = SIMPLE) -> str:
    return (
        f'<transmission name="t"><type>{kind}</type><joint name="{joint}">{in_joint}</joint>'
        f'<actuator name="m">{in_actuator}<mechanicalReduction>1</mechanicalReduction></actuator></transmission>'
    )


def interface(name: str) -> str:
    return f"<hardwareInterface>{name}</hardwareInterface>"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("hardware_interface/EffortJointInterface", Interface.EFFORT),
        ("PositionJointInterface", Interface.POSITION),
        ("hardware_interface::VelocityJointInterface", Interface.VELOCITY),
    ],
)
def test_interface_in_either_place(name: str, expected: Interface) -> None:
    assert read(simple("j", interface(name))) == ({"j": (expected,)}, [])
    assert read(simple("j", in_actuator=interface(name))) == ({"j": (expected,)}, [])


def test_interface_of_the_joint_hides_the_actuators() -> None:
    both = simple("j", interface("PositionJointInterface"), interface("EffortJointInterface"))
    assert read(both)[0] == {"j": (Interface.POSITION,)}


def test_several_interfaces_keep_their_order() -> None:
    found, _ = read(simple("j", interface("VelocityJointInterface") + interface("PositionJointInterface")))
    assert found == {"j": (Interface.VELOCITY, Interface.POSITION)}


def test_transmission_without_an_actuator_or_interface_is_skipped() -> None:
    found, warnings = read(
        f'<transmission name="t"><type>{SIMPLE}</type><joint name="j"/></transmission>', simple("k")
    )
    assert found == {}
    assert warnings == [
        "transmission 't': it is skipped, because it has no actuator",
        "transmission 't': joint 'k' is skipped, because it has no hardware interface",
    ]


def test_unknown_interface_is_skipped() -> None:
    found, warnings = read(simple("j", interface("MagicJointInterface") + interface("EffortJointInterface")))
    assert found == {"j": (Interface.EFFORT,)}
    assert warnings == [
        "transmission 't': unknown hardware interface 'MagicJointInterface', so it is skipped"
    ]


def test_interface_of_another_package_is_named_once_for_all_joints() -> None:
    found, warnings = read(*(simple(joint, interface("franka_hw/FrankaStateInterface")) for joint in "jk"))
    assert found == {}
    assert warnings == [
        "transmission 't': unknown hardware interface 'franka_hw/FrankaStateInterface', so it is skipped"
    ]


def test_differential_is_read_as_independent_joints() -> None:
    kind = "transmission_interface/DifferentialTransmission"
    pair = simple("j", interface("EffortJointInterface"), kind=kind).replace(
        "<actuator",
        f'<joint name="k">{interface("EffortJointInterface")}</joint><actuator name="n"/><actuator',
    )
    assert read(pair) == ({"j": (Interface.EFFORT,), "k": (Interface.EFFORT,)}, [])


def test_text_that_is_not_xml() -> None:
    with pytest.raises(UrdfError):
        read("<transmission>")
