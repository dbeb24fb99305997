"""The doctor's findings on frames, from recorded observations and from published frames."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.introspect.doctor import Status
from minirospy.introspect.doctor.frames import Observation, frame_findings
from minirospy.introspect.doctor.frames import check_frames as check
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.ros.robot_state_publisher.conftest import Start, start

__all__ = ["start"]

SECOND = 10**9


def frame(child: str, parent: str, *senders: str, offset: float | None = 0.0, **others: Any) -> Observation:
    nanoseconds = None if offset is None else int(offset * SECOND)
    return Observation(child, set(senders or ("/n",)), {parent}, nanoseconds, **others)


def said(*seen: Observation, **options: bool) -> list[tuple[Status, str]]:
    return [(finding.status, finding.text) for finding in frame_findings(seen, **options)]


def test_tree_that_is_well_is_one_line() -> None:
    static = frame("c", "b", offset=None)
    assert said(frame("b", "a"), static, frame("d", "b", offset=1.0)) == [(Status.OK, "4 in one tree")]


def test_nothing_on_tf_is_a_warning() -> None:
    ((status, text),) = said()
    assert (status, "nothing came on /tf" in text) == (Status.WARNING, True)


def test_two_nodes_of_one_frame_are_named() -> None:
    ((status, text),) = said(frame("b", "a", "/one", "/two"))
    assert status is Status.PROBLEM
    assert text.startswith("[b] is published by 2 nodes (/one, /two)")


def test_two_parents_are_named() -> None:
    both = Observation("b", {"/one", "/two"}, {"a", "x"}, 0)
    texts = [text for _, text in said(both, frame("x", "a"))]
    assert texts == ["[b] has 2 parents (a, x), published by /one, /two: lookups jump from one to the other"]


def test_loop_is_shown_once() -> None:
    findings = said(frame("a", "c"), frame("b", "a"), frame("c", "b"), frame("d", "a"))
    assert findings == [
        (Status.PROBLEM, "a loop, which makes every lookup there fail: a -> c -> b -> a"),
    ]


def test_many_frames_take_no_time() -> None:
    chain = [frame(f"f{number + 1}", f"f{number}") for number in range(20_000)]
    assert said(*chain) == [(Status.OK, "20001 in one tree")]
    assert said(*chain, frame("f0", "f20000"))[0][1].endswith(" -> ... -> f0")
    assert len(said(*chain, frame("y", "x"))) == 1


def test_trees_that_are_not_connected_are_named_with_similar_names() -> None:
    ((status, text),) = said(frame("base_link", "odom"), frame("laser", "base-link"))
    assert status is Status.WARNING
    assert text == (
        "2 trees that are not connected, with the roots [base-link], [odom] "
        "([base-link] is nearly [base_link]: was one of them meant?)"
    )


def test_two_roots_that_are_alike_are_one_hint() -> None:
    ((_, text),) = said(frame("arm", "base_link"), frame("laser", "base-link"))
    assert text.endswith("([base-link] is nearly [base_link]: was one of them meant?)")


@pytest.mark.parametrize(("one", "two"), [("robot1/odom", "robot2/odom"), ("map", "world"), ("arm1", "arm2")])
def test_names_that_are_alike_on_purpose_are_no_hint(one: str, two: str) -> None:
    ((_, text),) = said(frame("x", one), frame("y", two))
    assert "nearly" not in text


@pytest.mark.parametrize(("offset", "words"), [(5.0, "5.0 s ahead"), (-3.0, "3.0 s behind")])
def test_stamps_that_are_far_off_name_their_node(offset: float, words: str) -> None:
    seen = [frame("b", "a", "/late", offset=offset), frame("c", "b", "/late", offset=offset / 2)]
    findings = said(*seen)
    assert [status for status, _ in findings] == [Status.PROBLEM]
    assert findings[0][1].startswith(f"/late stamps its transforms ([b]) {words}")
    assert said(*seen, is_simulated=True) == [(Status.OK, "3 in one tree")]


def test_stamps_of_one_node_ahead_and_behind_are_both_reported() -> None:
    texts = [text for _, text in said(frame("b", "a", offset=5.0), frame("c", "b", offset=-60.0))]
    assert [text.partition(":")[0] for text in texts] == [
        "/n stamps its transforms ([b]) 5.0 s ahead",
        "/n stamps its transforms ([c]) 60.0 s behind",
    ]


def test_wrong_transform_is_reported_with_tf2s_text() -> None:
    ((status, text),) = said(frame("b", "a", faults={"TF_NAN_INPUT: Ignoring transform ..."}))
    assert (status, text) == (Status.PROBLEM, "TF_NAN_INPUT: Ignoring transform ...")


WRONG = """
import rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
rospy.init_node("wrong")
broadcaster = tf2_ros.TransformBroadcaster()
while not rospy.is_shutdown():
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = "a", "b"
    message.header.stamp = rospy.Time.now() - rospy.Duration(30)
    message.transform.rotation.w = 0.5
    broadcaster.sendTransform(message)
    rospy.sleep(0.05)
"""


def test_published_frames_are_examined(master: str, start: Start) -> None:
    start(
        "tf", "static_transform_publisher", *["1", "0", "0", "0", "0", "0", "a", "b", "50"], "__name:=right"
    )
    wrong = subprocess.Popen([sys.executable, "-c", WRONG])
    proxy = MasterProxy(master, "/test")
    try:
        while len((state := proxy.get_system_state()).publishers.get("/tf", ())) < 2:
            pass
        texts = ""
        # The doctor listens for a second and a half, in which a busy machine may deliver nothing.
        while not ("by 2 nodes" in texts and "TF_DENORMALIZED_QUATERNION" in texts):
            texts = " | ".join(finding.text for finding in check(Environment.read(), state))
    finally:
        wrong.terminate()
        wrong.wait()
        proxy.close()
    assert "[b] is published by 2 nodes (/right, /wrong)" in texts
    assert "TF_DENORMALIZED_QUATERNION" in texts
