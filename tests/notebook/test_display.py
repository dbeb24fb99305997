"""notebook/display: messages as HTML."""

from __future__ import annotations

import base64
import io
import re

import pytest
import rospy
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import Header, String

from minirospy.notebook.display import html_of


def test_fields_are_rows_and_long_values_are_cut() -> None:
    scan = LaserScan(header=Header(stamp=rospy.Time(12, 5), frame_id="laser"), ranges=[0.5] * 1000)
    html = html_of(scan)
    assert "<caption>sensor_msgs/LaserScan</caption>" in html
    assert ">header.frame_id</td><td style='text-align:left'>laser</td>" in html
    assert ">12.000000005 s</td>" in html
    assert "[0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, ...] (1000 values)" in html


def test_text_of_messages_is_no_markup() -> None:
    html = html_of(String("<script>alert(1)</script>" + "x" * 1000))
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert len(html) < 1000


def test_image_has_a_picture_with_its_pixels() -> None:
    pillow = pytest.importorskip("PIL.Image")
    image = Image(height=1, width=2, encoding="rgb8", step=6, data=bytes([255, 0, 0, 0, 0, 255]))
    match = re.search(r"src='data:image/png;base64,([^']+)'", html_of(image))
    assert match
    shown = pillow.open(io.BytesIO(base64.b64decode(match[1])))
    assert [shown.getpixel((x, 0)) for x in (0, 1)] == [(255, 0, 0), (0, 0, 255)]


def test_image_that_cannot_be_shown_says_why() -> None:
    assert "the image cannot be shown" in html_of(Image(height=9, width=9, encoding="rgb8"))
