"""The dashboard in Debian's chromium, used as a person uses it; and the page's codec under node."""

from __future__ import annotations

import json
import random
import shutil
import struct
import subprocess
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from roslib.message import get_message_class
from std_msgs.msg import String

from tests.dashboard.conftest import Served, serve
from tests.interop.browser import CHROMIUM, Page
from tests.interop.test_interop_foreign import FOREIGN

__all__ = ["serve"]

needs_chromium = pytest.mark.skipif(not CHROMIUM, reason="chromium is not installed: make interop")
needs_node = pytest.mark.skipif(
    not shutil.which("node"), reason="node is not installed: apt-get install nodejs"
)
TYPES = sorted(json.loads((Path(__file__).parents[1] / "idl" / "golden.json").read_text())["msg"])
NUMBERS = {"int8": "b", "byte": "b", "uint8": "B", "char": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
           "int64": "q", "uint64": "Q"}  # fmt: skip


# --- the codec


def random_value(chance: random.Random, type_: str) -> Any:
    base, bracket, length = type_.partition("[")
    if bracket:
        count = int(length[:-1]) if length != "]" else chance.randrange(3)
        values = [random_value(chance, base) for _ in range(count)]
        return bytes(values) if base in ("uint8", "char") else values
    if base in NUMBERS:
        return struct.unpack("<" + NUMBERS[base], chance.randbytes(struct.calcsize(NUMBERS[base])))[0]
    if base in ("float32", "float64"):
        return chance.choice((0.0, -1.5, 2.0**40, float("inf")))
    if base == "bool":
        return chance.random() < 0.5
    if base == "string":
        return "".join(chance.choice("aż<\0\U0001f422") for _ in range(chance.randrange(4)))
    if base in ("time", "duration"):
        import rospy

        return (rospy.Time if base == "time" else rospy.Duration)(
            chance.randrange(2**31), chance.randrange(10**9)
        )
    message = get_message_class(base)()
    for name, each in zip(message.__slots__, message._slot_types, strict=True):
        setattr(message, name, random_value(chance, each))
    return message


def run_codec(lines: list[dict[str, str]]) -> list[dict[str, str]]:
    done = subprocess.run(
        ["node", str(FOREIGN / "ros1_roundtrip.mjs")],
        input="".join(json.dumps(line) + "\n" for line in lines),
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@needs_node
def test_codec_of_the_page_reads_and_writes_every_type() -> None:
    chance = random.Random(1)
    lines = []
    for name in TYPES:
        cls = get_message_class(name)
        if cls is None:  # of a package that is not installed
            continue
        for _ in range(3):
            buffer = BytesIO()
            random_value(chance, name).serialize(buffer)
            lines.append({"type": name, "text": cls._full_text, "hex": buffer.getvalue().hex()})
    assert len(lines) > 500
    for line, answer in zip(lines, run_codec(lines), strict=True):
        assert answer.get("hex") == line["hex"], (line, answer)


@needs_node
def test_codec_of_the_page_gives_the_values_and_refuses_what_does_not_fit() -> None:
    text = (
        "uint8 A=1 # no field\nstring B=a#b\nint64 big\nfloat64[] list\nT[2] two\n"
        + "=" * 80
        + "\nMSG: p/T\nstring t\nbool b"
    )
    body = (
        struct.pack("<qI2d", -(2**62), 2, 0.5, -1)
        + struct.pack("<I", 1)
        + b"x\1"
        + struct.pack("<I", 0)
        + b"\0"
    )
    good, short, long, endless, missing, inside, wrong = run_codec(
        [
            {"type": "p/M", "text": text, "hex": body.hex()},
            {"type": "p/M", "text": text, "hex": body[:-1].hex()},
            {"type": "p/M", "text": text, "hex": body.hex() + "00"},
            {"type": "p/M", "text": "string[] s", "hex": "ffffffff"},
            {"type": "p/M", "text": "Other x", "hex": ""},
            {"type": "p/M", "text": "M x", "hex": ""},
            {"type": "p/M", "text": "<b>", "hex": ""},
        ]
    )
    assert json.loads(good["json"]) == {
        "big": str(-(2**62)),
        "list": [0.5, -1],
        "two": [{"t": "x", "b": True}, {"t": "", "b": False}],
    }
    assert short["error"] == endless["error"] == "MessageError: the message is shorter than its definition"
    assert long["error"] == "MessageError: the message is longer than its definition"
    assert missing["error"] == "MessageError: the definition of p/Other is missing"
    assert inside["error"] == "MessageError: the definition of p/M contains itself"
    assert wrong["error"] == 'MessageError: p/M: "<b>" is not a field'


# --- the page


@pytest.fixture
def browse() -> Iterator[Callable[..., Page]]:
    """Return a function that opens a page; at the end none may have logged an error."""
    opened: list[Page] = []

    def browsing(url: str, **options: Any) -> Page:
        opened.append(Page(url, **options))
        return opened[-1]

    yield browsing
    errors = []
    for page in opened:
        page.evaluate("1")  # what it logged before has arrived then
        errors += [each for each in page.errors if "WebSocket connection" not in each]
        page.close()
    assert errors == []


def address(served: Served, view: str = "") -> str:
    return f"http://localhost:{served.port}/#/{view}"


def publisher(served: Served, topic: str, cls: type, **options: Any) -> Any:
    node = served.node("talker" + topic.replace("/", "_"))

    async def advertise() -> Any:
        return await node.advertise(topic, cls, **options)

    return served.run(advertise())


@needs_chromium
def test_topics_show_live_values_and_hostile_text_as_text(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    hostile = "<img src=x onerror=\"document.title='broken'\"><script>document.title='broken'</script>"
    served.run(publisher(served, "/hostile", String, latch=True).publish(hostile))
    moving = publisher(served, "/robot/cmd_vel", Twist, latch=True)
    served.run(moving.publish(Twist()))
    page = browse(address(served, "topics"))
    page.wait_text("#state", "connected")
    assert hostile[:60] in page.wait_text(".row[data-topic='/hostile'] .preview", "<img")
    page.click("button.topic", "/robot/cmd_vel")
    page.wait_text(".row[data-topic='/robot/cmd_vel'] .fields", "angular")
    twist = Twist()
    twist.linear.x = 0.25
    served.run(moving.publish(twist))
    page.wait_text(".row[data-topic='/robot/cmd_vel'] .fields", "0.25")
    assert page.evaluate("document.title") == "Topics · minirospy"
    page.type("input[type=search]", "twist")
    page.wait_text(".bar", "1 of")


@needs_chromium
def test_token_is_taken_out_of_the_address(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from minirospy.bridge.access import Access

    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    page = browse(address(served, "topics?token=read-token-00"))
    page.wait_text("#state", "connected, read-only")
    assert "token" not in page.evaluate("location.href")
    page.call("Page.reload")
    page.wait_text("#state", "connected, read-only")


@needs_chromium
def test_lost_connection_is_shown_and_comes_back(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    page = browse(address(served, "topics"))
    page.wait_text("#state", "connected")

    async def disconnect() -> None:
        assert served.dashboard
        for connection in served.dashboard.bridge.listeners["foxglove"].connections:
            connection.close_websocket(1001, "a test")

    page.evaluate(
        "window.states = []; new MutationObserver(() => states.push(document.getElementById('state').textContent))"
        ".observe(document.getElementById('state'), {childList: true, characterData: true, subtree: true})"
    )
    served.run(disconnect())
    page.wait("return states.some(each => each.startsWith('connection lost'))")
    page.wait_text("#state", "connected")


@needs_chromium
@pytest.mark.parametrize("view", ["topics"])
def test_view_fits_a_phone(serve: Callable[..., Served], browse: Callable[..., Page], view: str) -> None:
    served = serve()
    served.run(publisher(served, "/a/rather/long/name/of/a/topic", String, latch=True).publish("x " * 200))
    page = browse(address(served, view), width=360, height=700, dark=True)
    page.wait_text("#state", "connected")
    page.wait(f"return document.getElementById('view').dataset.view === '{view}'")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert page.evaluate("document.getElementById('view').scrollWidth") <= 360
