"""Images over HTTP with web_video_server's URLs: the encodings, and streams with real sockets."""

from __future__ import annotations

import asyncio
import base64
import http.client
import json
import struct
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image as Pillow
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from minirospy.aio.handle import serialized
from minirospy.base.errors import BridgeError
from minirospy.base.name_filter import NameFilter
from minirospy.web.access import Access
from minirospy.web.graph import Filters
from minirospy.web.video import pictures
from minirospy.web.video.options import Picture, VideoRequest, request_of
from minirospy.web.video.pictures import encoded

if TYPE_CHECKING:
    from tests.web.conftest import Running


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let requests wait longer for an image than a machine may stall."""
    monkeypatch.setattr("minirospy.web.video.pages.SNAPSHOT_SECONDS", 60.0)


def image(encoding: str, array: np.ndarray[Any, Any]) -> Image:
    height, width = array.shape[:2]
    return Image(
        height=height, width=width, encoding=encoding, step=array.nbytes // height, data=array.tobytes()
    )


RED = image("rgb8", np.full((4, 6, 3), (255, 0, 0), np.uint8))


def opened(message: Image | CompressedImage, picture: Picture) -> Any:
    data, content_type = encoded(message._type, serialized(message), picture)
    found = Pillow.open(BytesIO(data))
    assert content_type == f"image/{(found.format or '').lower()}"
    return found


# --- what is asked for


def test_query_names_topic_and_picture() -> None:
    assert request_of({"topic": "/x"}) == VideoRequest("/x", Picture())
    query = {"topic": "/x", "type": "png", "quality": "50", "width": "320", "height": "240", "invert": ""}
    assert request_of(query) == VideoRequest("/x", Picture("png", 50, 320, 240, True))
    assert request_of({"topic": "/x", "type": "ros_compressed"}) == VideoRequest("/x/compressed", Picture(""))
    assert request_of({"topic": "/x"}, is_snapshot=True).picture.format == "jpeg"


@pytest.mark.parametrize(
    ("query", "text"),
    [
        ({}, "the topic is missing"),
        ({"topic": "/x y"}, "topic [/x y]: "),
        ({"topic": "/x", "type": "vp8"}, "type=vp8 needs a video encoder, which minirospy does not have"),
        ({"topic": "/x", "type": "gif"}, "type=gif is unknown: there is mjpeg, png, ros_compressed"),
        ({"topic": "/x", "quality": "0"}, "quality=0 is not between 1 and 100"),
        ({"topic": "/x", "width": "wide"}, "width=wide is not a number"),
        ({"topic": "/x", "height": "99999"}, "height=99999 is not between"),
    ],
)
def test_wrong_query_is_refused(query: dict[str, str], text: str) -> None:
    with pytest.raises(BridgeError) as error:
        request_of(query)
    assert str(error.value).startswith(text)


# --- encodings


def test_color_stays_the_same_in_png_and_about_so_in_jpeg() -> None:
    assert opened(RED, Picture("png")).getpixel((0, 0)) == (255, 0, 0)
    red, green, blue = opened(RED, Picture()).getpixel((2, 2))
    assert (red > 240, green < 20, blue < 20) == (True, True, True)


@pytest.mark.parametrize(
    ("encoding", "array", "expected"),
    [
        ("bgr8", np.full((2, 2, 3), (1, 2, 3), np.uint8), (3, 2, 1)),
        ("bgra8", np.full((2, 2, 4), (1, 2, 3, 9), np.uint8), (3, 2, 1)),
        ("mono8", np.full((2, 2), 7, np.uint8), 7),
        ("mono16", np.full((2, 2), 257 * 7, np.uint16), 7),
        ("16UC1", np.array([[0, 1000], [2000, 4000]], np.uint16), 0),
        ("32FC1", np.array([[1.0, np.nan], [2.0, 1.0]], np.float32), 127),
        ("32FC1", np.zeros((2, 2), np.float32), 0),
        ("bayer_rggb8", np.array([[200, 100], [50, 30]], np.uint8), (200, 75, 30)),
        ("rgb16", np.full((2, 2, 3), (257, 0, 65535), np.uint16), (1, 0, 255)),
    ],
)
def test_encoding_becomes_a_picture(encoding: str, array: np.ndarray[Any, Any], expected: object) -> None:
    assert opened(image(encoding, array), Picture("png")).getpixel((0, 0)) == expected


RECORDED = json.loads(
    (Path(__file__).parents[1] / "core" / "images" / "colors.json").read_text(encoding="utf-8")
)
"""Conversions by OpenCV, recorded by tests/core/images/record_colors.py."""


@pytest.mark.parametrize("has_opencv", [False, True])
@pytest.mark.parametrize("encoding", RECORDED["encodings"])
def test_colors_are_those_of_opencv(encoding: str, has_opencv: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if has_opencv:
        pytest.importorskip("cv2", exc_type=ImportError)
    else:
        monkeypatch.setattr(pictures, "opencv", lambda: None)
    case = RECORDED["encodings"][encoding]
    array = np.array(case["data"], np.uint16 if "16" in encoding else np.uint8)
    found = np.asarray(opened(image(encoding, array), Picture("png")).convert("RGB"))
    assert found[..., ::-1].tolist() == case["bgr"]


def test_compressed_images_of_16_bits_keep_their_order_and_range() -> None:
    gray = RECORDED["png"]["gray"]
    values = np.array(gray["values"])
    message = CompressedImage(format="16UC1; png compressed ", data=base64.b64decode(gray["file"]))
    expected = (values * (255 / values.max())).astype(np.uint8)
    assert np.asarray(opened(message, Picture("png"))).tolist() == expected.tolist()
    message.format = "mono16; png compressed "
    assert np.asarray(opened(message, Picture("png"))).tolist() == np.rint(values / 257).tolist()


@pytest.mark.parametrize(("encoding", "a", "b"), [("16UC1", 0.0, 0.0), ("32FC1", 10100.0, -1009.0)])
def test_compressed_depths_are_decoded_behind_their_header(encoding: str, a: float, b: float) -> None:
    gray = RECORDED["png"]["gray"]
    data = struct.pack("<iff", 0, a, b) + base64.b64decode(gray["file"])
    message = CompressedImage(format=f"{encoding}; compressedDepth png", data=data)
    depths = np.array(gray["values"], np.float64)
    if a:
        depths = (a / (depths - b)).astype(np.float32).astype(np.float64)
    expected = (depths * (255 / depths.max())).astype(np.uint8)
    assert np.asarray(opened(message, Picture("png"))).tolist() == expected.tolist()


def test_picture_is_resized_and_inverted() -> None:
    array = np.zeros((4, 6), np.uint8)
    array[0, 0] = 255
    found = opened(image("mono8", array), Picture("png", is_inverted=True))
    assert (found.getpixel((0, 0)), found.getpixel((5, 3))) == (0, 255)
    assert opened(RED, Picture("png", width=12)).size == (12, 4)
    assert opened(RED, Picture("jpeg", width=3, height=2)).size == (3, 2)


def test_picture_is_not_resized_to_any_size() -> None:
    with pytest.raises(BridgeError, match="10000x10000 pixels is too large"):
        opened(RED, Picture("png", width=10_000, height=10_000))


def test_compressed_image_passes_as_it_came() -> None:
    data = encoded(RED._type, serialized(RED), Picture())[0]
    message = CompressedImage(format="jpeg", data=data)
    assert encoded(message._type, serialized(message), Picture("")) == (data, "image/jpeg")
    assert encoded(message._type, serialized(message), Picture())[0] == data
    assert opened(message, Picture("png", width=3)).size == (3, 4)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (image("wrong", np.zeros((2, 2), np.uint8)), "Unrecognized image encoding [wrong]"),
        (Image(height=9, width=9, encoding="mono8", data=b"x"), "needs 81 bytes"),
        (CompressedImage(data=b"nothing"), "not an image"),
        (String("x"), "messages of [std_msgs/String] are not images"),
    ],
)
def test_invalid_image_is_refused(message: Any, text: str) -> None:
    with pytest.raises(BridgeError) as error:
        encoded(message._type, serialized(message), Picture())
    assert text in str(error.value)


@pytest.mark.parametrize("picture", [Picture("png"), Picture("jpeg", width=2)])
def test_missing_library_is_named_without_paths_of_the_server(
    picture: Picture, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("cv2", "PIL", "simplejpeg"):
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(sys, "executable", "/home/me/.venv/bin/python")
    with pytest.raises(BridgeError, match=r"minirospy\[images\]") as error:
        encoded(RED._type, serialized(RED), picture)
    assert "/home/me" not in str(error.value)


# --- pages


class Browser:
    """An HTTP client of a bridge."""

    def __init__(self, bridge: Running) -> None:
        self._port = bridge.bridge.listeners["video"].port

    def get(self, path: str, **headers: str) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=30)
        connection.request(
            "GET", path, headers={name.replace("_", "-"): each for name, each in headers.items()}
        )
        return connection.getresponse()


@pytest.fixture
def camera(run_bridge: Callable[..., Running]) -> Running:
    """Return a bridge with a latched image on /camera/image."""
    bridge = run_bridge(video_port=0)
    publisher = bridge.publisher(bridge.node("camera"), "/camera/image", Image, latch=True)
    bridge.run(publisher.publish(RED))
    return bridge


def part_of(stream: http.client.HTTPResponse) -> tuple[str, Any]:
    assert stream.readline() == b"--boundarydonotcross\r\n"
    headers = http.client.parse_headers(stream)
    found = Pillow.open(BytesIO(stream.read(int(headers["Content-Length"]))))
    assert stream.readline() == b"\r\n"
    assert float(headers["X-Timestamp"]) > 0
    return headers["Content-Type"], found


@pytest.mark.parametrize(("type_", "content_type"), [("mjpeg", "image/jpeg"), ("png", "image/png")])
def test_stream_sends_each_image_as_a_part(camera: Running, type_: str, content_type: str) -> None:
    stream = Browser(camera).get(f"/stream?topic=/camera/image&type={type_}&width=12&height=8")
    assert stream.headers["Content-Type"] == "multipart/x-mixed-replace;boundary=boundarydonotcross"
    found_type, found = part_of(stream)
    assert (found_type, found.size) == (content_type, (12, 8))
    # A second client of the same stream need not wait for the next image.
    assert part_of(Browser(camera).get(f"/stream?topic=/camera/image&type={type_}&width=12&height=8"))[
        1
    ].size == (12, 8)
    stream.close()


def test_snapshot_is_one_image(camera: Running) -> None:
    for query, format_ in (("", "JPEG"), ("&type=png", "PNG")):
        answer = Browser(camera).get(f"/snapshot?topic=/camera/image{query}")
        assert (answer.status, Pillow.open(BytesIO(answer.read())).format) == (200, format_)


def test_encodings_at_a_time_are_limited(camera: Running) -> None:
    streams = [Browser(camera).get(f"/stream?topic=/camera/image&quality={each}") for each in range(1, 33)]
    assert {stream.status for stream in streams} == {200}
    assert Browser(camera).get("/stream?topic=/camera/image&quality=50").status == 503
    assert Browser(camera).get("/stream?topic=/camera/image&quality=5").status == 200


def test_page_of_another_site_embeds_no_image(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(
        video_port=0, access=Access(origins=("https://robot.example",), write_token="write-token")
    )
    publisher = bridge.publisher(bridge.node("camera"), "/camera/image", Image, latch=True)
    bridge.run(publisher.publish(RED))
    path = "/snapshot?topic=/camera/image"
    embedded = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Dest": "image"}
    for headers, status in (
        (embedded, 403),
        ({**embedded, "Referer": "https://evil.example/x"}, 403),
        ({**embedded, "Referer": "https://robot.example/x"}, 200),
        ({**embedded, "Sec_Fetch_Dest": "iframe"}, 403),
        ({**embedded, "Sec_Fetch_Dest": "document"}, 200),
        ({**embedded, "Sec_Fetch_Site": "same-site"}, 200),
    ):
        assert Browser(bridge).get(path, **headers).status == status, headers
    assert Browser(bridge).get(f"{path}&token=write-token", **embedded).status == 200


def test_topics_with_images_are_listed(camera: Running) -> None:
    camera.publisher(camera.node("talker"), "/chatter", String)
    page = Browser(camera).get("/").read().decode()
    assert 'href="/stream_viewer?topic=%2Fcamera%2Fimage"' in page
    assert "/chatter" not in page
    viewer = Browser(camera).get("/stream_viewer?topic=/camera/image&width=3").read().decode()
    assert '<img src="/stream?topic=%2Fcamera%2Fimage&amp;width=3"' in viewer


@pytest.mark.parametrize(
    ("path", "status", "text"),
    [
        ("/stream", 400, "the topic is missing"),
        ("/stream?topic=/camera/image&type=h264", 400, "type=h264 needs a video encoder"),
        ("/stream_viewer?topic=/a&type=x", 400, "type=x is unknown"),
        ("/stream?topic=/nothing", 404, "topic [/nothing] is not published"),
        ("/snapshot?topic=/rosout", 404, "topic [/rosout] is not published"),
        ("/other", 404, "there is no such page"),
    ],
)
def test_wrong_url_gets_one_line(camera: Running, path: str, status: int, text: str) -> None:
    answer = Browser(camera).get(path)
    assert (answer.status, answer.read().decode().startswith(text)) == (status, True)


def test_hidden_topic_is_not_shown(run_bridge: Callable[..., Running]) -> None:
    access = Access(read_token="read-token", requires_token=True)
    bridge = run_bridge(video_port=0, access=access, filters=Filters(topics=NameFilter.of((), ["/camera/*"])))
    publisher = bridge.publisher(bridge.node("camera"), "/camera/image", Image, latch=True)
    bridge.run(publisher.publish(RED))
    assert Browser(bridge).get("/stream?topic=/camera/image").status == 401
    assert Browser(bridge).get("/stream?topic=/camera/image&token=read-token").status == 404
    assert Browser(bridge).get("/snapshot?topic=camera/image&token=read-token").status == 404


@pytest.mark.parametrize("path", ["/stream", "/snapshot"])
def test_client_that_leaves_early_leaves_no_subscription(camera: Running, path: str) -> None:
    """The client disconnects during a refresh of the graph."""
    bridge = camera.bridge
    request = SimpleNamespace(query={"topic": "/camera/image"})
    exchange: Any = Mock(request=request, is_open=False)

    async def serve() -> None:
        bridge.video.handlers[path](exchange)
        await asyncio.gather(*bridge.graph.tasks)

    camera.run(serve())
    assert not bridge.video.feeds
    assert "/camera/image" not in bridge.graph.topics
