"""Transforms of whole objects and conversions between types, with registered and unregistered types."""

from __future__ import annotations

from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped

from minirospy.base import times
from minirospy.ros.tf2_ros.tf2_ros.interface import (
    BufferInterface,
    ConvertRegistration,
    NotImplementedException,
    Stamped,
    TransformRegistration,
    TypeException,
    convert,
)


class Thing:
    """A program's own type."""

    def __init__(self, x: float = 0.0) -> None:
        self.x = x
        self.header: Any = None


class Other(Thing):
    """A type to which a Thing can be converted."""


class OneTransform(BufferInterface):
    """A buffer that returns one transform."""

    def lookup_transform(self, *arguments: Any, **_: Any) -> TransformStamped:
        """Return a transform with the frames of the query."""
        found = TransformStamped()
        found.header.frame_id, found.child_frame_id = arguments[:2]
        found.transform.translation.x = 2.0
        return found

    def lookup_transform_full(self, *arguments: Any, **_: Any) -> TransformStamped:
        """Return a transform with the frames of the query."""
        return self.lookup_transform(arguments[0], arguments[2])


def moved(thing: Thing, transform: TransformStamped) -> Thing:
    result = Thing(thing.x + transform.transform.translation.x)
    result.header = transform.header
    return result


@pytest.fixture(autouse=True)
def _registered(monkeypatch: pytest.MonkeyPatch) -> None:
    for registry in (
        TransformRegistration._registry,
        ConvertRegistration._convert,
        ConvertRegistration._to_msg,
        ConvertRegistration._from_msg,
    ):
        monkeypatch.setattr(registry, "functions", dict(registry.functions))


def test_registered_types_are_transformed_and_converted() -> None:
    TransformRegistration().add(Thing, moved)
    thing = Stamped(Thing(3.0), times.Time(5), "base")
    buffer = OneTransform()
    result = buffer.transform(thing, "map")
    assert (type(result), result.x, result.header.frame_id) == (Thing, 5.0, "map")
    assert buffer.transform_full(thing, "odom", times.Time(6), "map").header.frame_id == "odom"

    with pytest.raises(TypeException, match="Thing'> if not loaded or supported"):
        buffer.transform(thing, "map", new_type=Other)
    ConvertRegistration().add_convert((Thing, Other), lambda each: Other(-each.x))
    assert buffer.transform(thing, "map", new_type=Other).x == -5.0


def test_conversions_go_by_way_of_a_message_or_are_copies() -> None:
    thing = Thing(1.0)
    copied = convert(thing, Thing)
    assert copied is not thing
    assert copied.x == 1.0
    ConvertRegistration().add_to_msg(Thing, lambda each: {"x": each.x})
    ConvertRegistration().add_from_msg(Other, lambda message: Other(message["x"] + 1))
    assert convert(thing, Other).x == 2.0


def test_unknown_types_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(TypeException, match="Type <class 'int'> if not loaded or supported") as caught:
        OneTransform().transform(5, "map")
    assert caught.value.errstr == str(caught.value)
    TransformRegistration().print_me()
    assert capsys.readouterr().out.startswith("{")


def test_methods_that_a_subclass_lacks() -> None:
    class Half(BufferInterface):
        """A buffer interface without lookups."""

    with pytest.raises(NotImplementedException) as caught:
        Half().can_transform("a", "b", times.Time())
    assert caught.value.errstr == "CanTransform or LookupTransform not implemented"
