"""interactive_markers in cases in which ROS's server raises an exception, and after the clock has jumped back.

tests/referee/cases/interactive_markers_server.py compares the other messages with real ROS.
"""

from __future__ import annotations

from unittest.mock import Mock

import pytest
from geometry_msgs.msg import Pose
from interactive_markers import interactive_marker_server as module
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from interactive_markers.menu_handler import MenuHandler
from rospy import Time
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerFeedback

from minirospy import client


class Clock:
    now = 100.0


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> InteractiveMarkerServer:
    assert module
    Clock.now = 100.0
    monkeypatch.setattr(Time, "now", staticmethod(lambda: Time.from_sec(Clock.now)))
    for name in ("Publisher", "Subscriber", "Timer"):
        monkeypatch.setattr(client, name, Mock())
    return InteractiveMarkerServer("cubes")


def add(server: InteractiveMarkerServer, name: str) -> None:
    server.insert(InteractiveMarker(name=name))
    server.applyChanges()


def test_feedback_without_a_callback_is_ignored(server: InteractiveMarkerServer) -> None:
    add(server, "a")
    server.processFeedback(InteractiveMarkerFeedback(marker_name="a"))


def test_callback_that_raises_key_error_is_called_once(server: InteractiveMarkerServer) -> None:
    add(server, "a")
    default = Mock()
    server.setCallback("a", default)
    server.setCallback("a", Mock(side_effect=KeyError), InteractiveMarkerFeedback.BUTTON_CLICK)
    with pytest.raises(KeyError):
        server.processFeedback(
            InteractiveMarkerFeedback(marker_name="a", event_type=InteractiveMarkerFeedback.BUTTON_CLICK)
        )
    assert not default.called


def test_callback_of_a_type_that_has_none_can_be_removed(server: InteractiveMarkerServer) -> None:
    add(server, "a")
    assert server.setCallback("a", None, InteractiveMarkerFeedback.BUTTON_CLICK)


def test_feedback_is_taken_after_the_clock_jumped_back(server: InteractiveMarkerServer) -> None:
    add(server, "a")
    callback = Mock()
    server.setCallback("a", callback)
    server.processFeedback(InteractiveMarkerFeedback(marker_name="a", client_id="one"))
    assert not callback.called
    Clock.now = 5.0
    server.processFeedback(InteractiveMarkerFeedback(marker_name="a", client_id="one"))
    assert callback.call_count == 1


def test_new_marker_that_was_erased_cannot_be_moved(server: InteractiveMarkerServer) -> None:
    server.insert(InteractiveMarker(name="a"))
    assert server.erase("a")
    assert not server.setPose("a", Pose())


def test_menu_of_no_marker_is_not_applied(server: InteractiveMarkerServer) -> None:
    menu = MenuHandler()
    assert not menu.apply(server, "nothing")
    assert menu.reApply(server)


def test_menu_entry_without_a_callback_is_ignored() -> None:
    menu = MenuHandler()
    handle = menu.insert("Top")
    menu.processFeedback(InteractiveMarkerFeedback(menu_entry_id=handle))
