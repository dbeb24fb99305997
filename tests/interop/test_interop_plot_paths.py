"""Plot in Debian's chromium: joints by name, angles of quaternions, readable numbers, all series removed."""

from __future__ import annotations

import math
from collections.abc import Callable

from geometry_msgs.msg import QuaternionStamped
from sensor_msgs.msg import JointState

from tests.interop.browser import Page
from tests.interop.test_interop_aio import until
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher, serve
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "serve"]


@needs_chromium
def test_joint_is_plotted_by_name_wherever_it_is_in_the_array(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    talker = publisher(served, "/joint_states", JointState, queue_size=None)
    page = browse(address(served, "plot?path=/joint_states/position[elbow]"))

    served.run(until(lambda: talker.num_connections == 1))
    served.run(talker.publish(JointState(name=["elbow", "wrist"], position=[1.5, 9.0])))
    page.wait_text(".series .num", "1.5")
    served.run(talker.publish(JointState(name=["wrist", "elbow"], position=[9.0, 2.5])))
    page.wait_text(".series .num", "2.5")
    page.wait_text(".series .label", "/joint_states/position[elbow]")
    page.wait_text(".series .count", "2 points")


@needs_chromium
def test_links_of_the_topics_name_joints_and_angles(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    joints = publisher(served, "/joint_states", JointState, latch=True)
    turned = publisher(served, "/turned", QuaternionStamped, latch=True)
    served.run(joints.publish(JointState(name=["elbow", "wrist"], position=[1.5, 9.0])))
    message = QuaternionStamped()
    message.quaternion.z = message.quaternion.w = math.sqrt(0.5)
    served.run(turned.publish(message))

    page = browse(address(served, "topics?open=/joint_states"))
    page.click("button.field", "position")
    page.wait_text("a.plot[title='Plot /joint_states/position[elbow]']", "plot")
    page.open(address(served, "topics?open=/turned"))
    page.click("a.plot", "plot the angles")
    page.wait("return document.querySelectorAll('.series').length === 3")
    page.wait("return [...document.querySelectorAll('.series .num')].at(-1).textContent === '1.570796'")


@needs_chromium
def test_all_series_are_removed_at_once(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    talker = publisher(served, "/joint_states", JointState, latch=True)
    served.run(talker.publish(JointState(name=["elbow", "wrist"], position=[1.5, 9.0])))
    page = browse(
        address(
            served, "plot?path=/joint_states/position&path=/late/x&show=derivative+/joint_states/position[0]"
        )
    )
    page.wait("return document.querySelectorAll('.series').length === 2")
    page.wait_text(".series-missing .muted", "waiting for /late/x")

    page.click("button", "Remove all")
    page.wait("return !document.querySelector('.series, .series-missing, canvas')")
    page.wait("return location.hash === '#/plot'")
    # What was removed can be added again.
    page.type("form input", "/joint_states/position")
    page.click("form button", "Plot")
    page.wait("return document.querySelectorAll('.series').length === 2")
