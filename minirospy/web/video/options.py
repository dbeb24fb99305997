"""Parse web_video_server's URLs, and format the parts of its streams. Pure.

Source: http://wiki.ros.org/web_video_server.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from urllib.parse import urlencode

from minirospy.base.errors import BridgeError
from minirospy.introspect.graph import why_illegal

__all__ = ["BOUNDARY", "Picture", "VideoRequest", "part", "request_of", "topics_page", "viewer_page"]

BOUNDARY = "boundarydonotcross"
START = f"--{BOUNDARY}\r\n".encode()

_STREAMS = {"mjpeg": "jpeg", "png": "png", "ros_compressed": ""}
_SNAPSHOTS = {"jpeg": "jpeg", "jpg": "jpeg", "mjpeg": "jpeg", "png": "png", "ros_compressed": ""}
_NOT_OFFERED = ("vp8", "vp9", "h264")
_MAX_PIXELS = 10_000


@dataclass(frozen=True)
class Picture:
    """The requested encoding of an image.

    ``format``: jpeg or png, or "" to pass a compressed image unchanged. If a size is None, the image's size is kept.
    """

    format: str = "jpeg"
    quality: int = 95
    width: int | None = None
    height: int | None = None
    is_inverted: bool = False


@dataclass(frozen=True)
class VideoRequest:
    """A request for the images on a topic, in one encoding."""

    topic: str
    picture: Picture


def request_of(query: Mapping[str, str], *, is_snapshot: bool = False) -> VideoRequest:
    """Parse a request's query. Raise BridgeError if the topic is missing, the type is unsupported, or a number is invalid."""
    topic = query.get("topic", "")
    if not topic:
        raise BridgeError("the topic is missing: give ?topic=/camera/image_raw")
    why = why_illegal(topic)
    if why:
        raise BridgeError(f"topic [{topic[:200]}]: {why}")

    formats = _SNAPSHOTS if is_snapshot else _STREAMS
    type_ = query.get("type") or next(iter(formats))
    if type_ not in formats:
        why = (
            "needs a video encoder, which minirospy does not have" if type_ in _NOT_OFFERED else "is unknown"
        )
        raise BridgeError(f"type={type_[:50]} {why}: there is {', '.join(formats)}")
    picture = Picture(
        formats[type_],
        _number(query, "quality", 95, 1, 100) or 95,
        _number(query, "width", None, 1, _MAX_PIXELS),
        _number(query, "height", None, 1, _MAX_PIXELS),
        "invert" in query and query["invert"].lower() not in ("false", "0"),
    )
    # As in web_video_server, this type subscribes to the topic's "compressed" subtopic.
    return VideoRequest(f"{topic}/compressed" if type_ == "ros_compressed" else topic, picture)


def _number(query: Mapping[str, str], name: str, default: int | None, low: int, high: int) -> int | None:
    text = query.get(name, "")
    if text in ("", "-1"):
        return default
    try:
        found = int(text)
    except ValueError:
        raise BridgeError(f"{name}={text[:50]} is not a number") from None
    if not low <= found <= high:
        raise BridgeError(f"{name}={found} is not between {low} and {high}")
    return found


def part(data: bytes, content_type: str, nanoseconds: int) -> bytes:
    """Return the header of one image in a stream; ``data`` and :data:`END` must follow it."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return (
        f"Content-Type: {content_type}\r\nX-Timestamp: {seconds}.{rest:09d}\r\nContent-Length: {len(data)}\r\n\r\n"
    ).encode()


END = b"\r\n" + START
"""The end of an image, with the next boundary: a browser does not show an image before it receives that boundary."""


def topics_page(topics: Mapping[str, str], token: str) -> bytes:
    """Return the page that lists the image topics and their types. ``token`` is the token of the request."""
    rows = []
    for topic, type_ in sorted(topics.items()):
        links = " ".join(
            f'<a href="{escape(_url(path, {"topic": topic, **more}, token))}">{text}</a>'
            for path, more, text in (
                ("/stream_viewer", {}, "view"),
                ("/stream", {"type": "mjpeg"}, "stream"),
                ("/snapshot", {}, "snapshot"),
            )
        )
        rows.append(f"<li>{escape(topic)} ({escape(type_)}): {links}</li>")
    listed = "\n".join(rows) or "<li>no topic has images</li>"
    return _page("ROS Image Topics", f"<h1>Available ROS Image Topics:</h1>\n<ul>\n{listed}\n</ul>")


def viewer_page(query: Mapping[str, str], token: str) -> bytes:
    """Return the page that shows a stream."""
    request = request_of(query)
    rest = {name: value for name, value in query.items() if name != "token"}
    source = escape(_url("/stream", rest, token))
    return _page(
        request.topic,
        f'<h1>{escape(query["topic"])}</h1>\n<img src="{source}" alt="{escape(query["topic"])}">',
    )


def _url(path: str, query: Mapping[str, str], token: str) -> str:
    return f"{path}?{urlencode({**query, **({'token': token} if token else {})})}"


def _page(title: str, body: str) -> bytes:
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title></head>\n'
        f"<body>\n{body}\n</body></html>\n"
    ).encode()
