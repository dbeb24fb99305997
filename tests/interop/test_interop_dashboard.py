"""The dashboard in Debian's chromium, operated as by a user, and the page's codec under node."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import csv
import json
import os
import random
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from roslib.message import get_message_class
from std_msgs.msg import String

from minirospy.web.dashboard.views import VIEWS
from tests.interop.browser import CHROMIUM, PATIENCE, Page
from tests.interop.page_modules import run_script
from tests.interop.test_interop_foreign import FOREIGN
from tests.ros.robot_state_publisher.conftest import start
from tests.web.dashboard.conftest import TOKEN, Served, serve

__all__ = ["serve", "start"]

needs_chromium = pytest.mark.skipif(not CHROMIUM, reason="chromium is not installed: make interop")
needs_node = pytest.mark.skipif(
    not shutil.which("node"), reason="node is not installed: apt-get install nodejs"
)
TYPES = sorted(
    json.loads((Path(__file__).parents[1] / "core" / "idl" / "golden.json").read_text(encoding="utf-8"))[
        "msg"
    ]
)
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
        timeout=PATIENCE,
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
        if cls is None:  # its package is not installed
            continue
        for _ in range(3):
            buffer = BytesIO()
            random_value(chance, name).serialize(buffer)
            lines.append({"type": name, "text": cls._full_text, "hex": buffer.getvalue().hex()})
    assert len(lines) > 500
    for line, answer in zip(lines, run_codec(lines), strict=True):
        assert answer.get("hex") == line["hex"], (line, answer)


@needs_node
def test_codec_of_the_page_decodes_values_and_refuses_invalid_bytes() -> None:
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


CONNECTION_ERRORS = ("WebSocket connection", "status of 401", "net::ERR_CONNECTION_REFUSED")
"""Texts that the browser logs while a server is gone or refuses the page."""


@pytest.fixture
def browse() -> Iterator[Callable[..., Page]]:
    """Return a function that opens a page; assert at teardown that no page logged an error."""
    opened: list[Page] = []

    def browsing(url: str, **options: Any) -> Page:
        opened.append(Page(url, **options))
        return opened[-1]

    yield browsing
    errors = []
    with contextlib.ExitStack() as stack:
        for page in opened:
            stack.callback(page.close)
        for page in opened:
            page.evaluate("1")  # after this call, errors logged before it have arrived
            errors += [each for each in page.errors if not any(text in each for text in CONNECTION_ERRORS)]
    assert errors == []


def address(served: Served, view: str = "") -> str:
    """Return the URL of a view, with the owner's token unless it already has one."""
    words = "" if "token=" in view else f"{'&' if '?' in view else '?'}token={TOKEN}"
    return f"http://localhost:{served.port}/#/{view}{words}"


def publisher(served: Served, topic: str, cls: type, **options: Any) -> Any:
    node = served.node("talker" + topic.replace("/", "_"))

    async def advertise() -> Any:
        return await node.advertise(topic, cls, **options)

    return served.run(advertise())


@needs_chromium
def test_topic_of_a_link_is_scrolled_to(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    many = [f"/topic_{number:02d}" for number in range(40)]
    node = served.node("talker")

    async def advertise() -> None:
        for topic in many:
            await node.advertise(topic, String)

    served.run(advertise())
    page = browse(address(served, "topics?open=/topic_39"))
    # The browser scrolls by whole pixels, and the bar above may end at a part of one.
    page.wait(
        "const box = document.querySelector(\".row[data-topic='/topic_39']\")?.getBoundingClientRect();"
        "return box && document.querySelectorAll('.row').length >= 40 && box.top >= 0 && box.bottom < innerHeight + 1"
    )


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
    from minirospy.web.access import Access

    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    page = browse(address(served, "topics?token=read-token-00"))
    page.wait_text("#state", "connected, read-only")
    assert "token" not in page.evaluate("location.href")
    page.reload()
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


def logger(served: Served) -> Callable[..., None]:
    """Return a function that publishes lines to /rosout_agg, as roscore's rosout node does."""
    from rosgraph_msgs.msg import Log

    publishing = publisher(served, "/rosout_agg", Log, latch=True, queue_size=None)

    def log(*lines: tuple[int, str, str]) -> None:
        async def run() -> None:
            for level, name, text in lines:
                await publishing.publish(
                    Log(level=level, name=name, msg=text, file="a.py", line=7, function="run")
                )

        served.run(run())

    return log


@needs_chromium
def test_console_filters_pauses_and_shows_text_as_text(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    log = logger(served)
    log((2, "/first", "hello <img src=x onerror=alert(1)>"))
    page = browse(address(served, "console"))
    page.wait_text(".line .text", "hello <img src=x")
    log((1, "/first", "detail"), (4, "/second", "battery low"), (8, "/second", "motor 3 failed"))
    page.wait_text(".bar", "4 of 4 lines")
    page.click("button.level", "Debug")
    page.wait_text(".bar", "3 of 4 lines")
    page.choose("select[aria-label=Node]", "/second")
    page.wait_text(".bar", "2 of 4 lines")
    page.type("input[type=search]", "MOTOR")
    page.wait_text(".bar", "1 of 4 lines")
    page.click("label", "regex")
    page.type("input[type=search]", "motor [0-9")
    page.wait_text(".error", "regular expression")
    page.type("input[type=search]", "motor [0-9]|low")
    page.wait_text(".bar", "2 of 4 lines")
    page.click(".line", "motor 3 failed")
    page.wait_text(".details", "a.py:7 run")
    page.click("button", "Pause")
    log((16, "/second", "motor 4 gone"))
    page.wait_text(".bar", "paused, 1 new")
    page.click("button", "Continue")
    page.wait_text(".bar", "3 of 5 lines")


@needs_chromium
def test_console_holds_many_lines_with_few_elements(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    log = logger(served)
    log((2, "/many", "the first"))
    page = browse(address(served, "console"))
    page.wait_text(".bar", "1 of 1 lines")
    for first in range(0, 20_000, 2000):
        log(*((2, "/many", f"line {number}") for number in range(first, first + 2000)))
        # Publish in parts, because a browser that is slower than this test would drop lines, as intended.
        page.wait_text(".bar", f"{first + 2001} of {first + 2001} lines")
    page.wait_text(".line .text", "line 19999")
    assert page.evaluate("document.querySelectorAll('.line').length") < 100
    page.evaluate("document.querySelector('.virtual').scrollTop = 0")
    page.wait_text(".line .text", "the first")
    page.click("button", "Latest")
    page.wait_text(".line .text", "line 19999")


@needs_node
def test_log_files_of_each_kind_are_read() -> None:
    text = """1795414410.408634901  Node Startup
1795414411.500000000 INFO /talker [talker.py:10(main)] [topics: /rosout, /chat] hello [x] (y)
1795414412.250000000 WARN /talker [:0()] two
  lines
[rospy.client][INFO] 2026-11-23 06:46:25,120: init_node
[rosout][CRITICAL] 2026-11-23 06:46:25,121: no memory
\x1b[33m[ WARN] [1795414413.100000]: printed\x1b[0m
[ERROR] [1795414413.200000, 12.500000]: of a simulation
"""
    body = f"return linesOf({json.dumps(text)}, 'a.log').map(({{stamp: _, ...rest}}) => Object.values(rest));"
    assert run_script("linesOf", "js/logs.js", body) == [
        [2, "a.log", "1795414410.408634901  Node Startup", "a.log", 0, ""],
        [2, "/talker", "hello [x] (y)", "talker.py", 10, "main"],
        [4, "/talker", "two\n  lines", "", 0, ""],
        [2, "rospy.client", "init_node", "a.log", 0, ""],
        [16, "rosout", "no memory", "a.log", 0, ""],
        [4, "a.log", "printed", "a.log", 0, ""],
        [8, "a.log", "of a simulation", "a.log", 0, ""],
    ]
    body = f"return linesOf({json.dumps(text)}, 'a.log').map(each => each.stamp);"
    stamps = run_script("linesOf", "js/logs.js", body)
    assert stamps[1:3] + stamps[5:] == [1795414411.5, 1795414412.25, 1795414413.1, 1795414413.2]
    assert run_script("linesOf", "js/logs.js", "return linesOf('\\n\\n', 'a.log');") == []


@needs_chromium
def test_console_keeps_long_texts_in_their_rows(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from rosgraph_msgs.msg import Log

    served = serve()
    page = browse(address(served, "console"))
    text = "Traceback:\n  line 1\r\n  line 2\n" + "x" * 100_000
    log = publisher(served, "/rosout_agg", Log, latch=True, queue_size=None)
    served.run(log.publish(Log(level=8, name="/n" + "n" * 2000, msg=text)))
    page.wait_text(".line .text", "Traceback: ↵   line 1 ↵   line 2 ↵ xxx")
    # A click shows the whole line.
    page.click(".line")
    page.wait(f"return document.querySelector('.details pre').textContent === {json.dumps(text)}")
    widths = "['.bar select', '.bar'].map(find => document.querySelector(find).getBoundingClientRect().width)"
    select, bar = page.evaluate(widths)
    assert select < bar / 2
    # The view must follow the newest line even if the list shrinks before its scroll event arrives.
    for number in range(60):
        served.run(log.publish(Log(level=2, name="/n", msg=f"line {number}")))
    page.wait_text(".line .text", "line 59")
    page.evaluate(
        "{ document.querySelector('.lines').style.maxHeight = '9rem';"
        "document.querySelector('.virtual').dispatchEvent(new Event('scroll')); }"
    )
    served.run(log.publish(Log(level=2, name="/n", msg="newest")))
    page.wait_text(".bar", "62 of 62 lines")
    page.wait(
        "const box = [...document.querySelectorAll('.line')].find(e => e.textContent.includes('newest'))"
        "?.getBoundingClientRect();"
        "return box && box.bottom <= document.querySelector('.virtual').getBoundingClientRect().bottom + 1"
    )


@needs_chromium
def test_console_opens_a_log_file_and_marks_lines(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    page = browse(address(served, "console"))
    page.wait_text("button", "Open log")
    text = "".join(
        f"1795414411.{number:09d} INFO /talker [talker.py:10(main)] [topics: ] line {number} {HOSTILE}\n"
        for number in range(30)
    )
    page.evaluate(
        f"(() => {{ const data = new DataTransfer(); data.items.add(new File([{json.dumps(text)}], 'rosout.log'));"
        "const field = document.querySelector('input[type=file]'); field.files = data.files;"
        "field.dispatchEvent(new Event('change')); })()"
    )
    page.wait_text(".bar", "30 of 30 lines")
    page.wait_text(".line .text", f"line 29 {HOSTILE}")
    page.click("label", "highlight")
    page.type("input[type=search]", "line 29")
    page.wait(
        "const marked = [...document.querySelectorAll('.line.marked:not([hidden])')];"
        "return marked.length === 1 && marked[0].textContent.includes('line 29')"
    )
    page.wait_text(".bar", "30 of 30 lines")
    assert "mark=1" in page.evaluate("location.hash")
    page.click("label", "highlight")
    page.wait_text(".bar", "1 of 30 lines")
    page.wait("return !document.querySelector('.line.marked:not([hidden])')")


@needs_chromium
def test_console_sets_levels_of_loggers(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from roscpp.msg import Logger
    from roscpp.srv import GetLoggers, GetLoggersResponse, SetLoggerLevel, SetLoggerLevelResponse

    served = serve()
    node = served.node("worker")
    levels = {"rosout": "info"}
    changed = threading.Event()

    def set_level(request: Any) -> Any:
        levels[request.logger] = request.level
        changed.set()
        return SetLoggerLevelResponse()

    async def offer() -> None:
        await node.serve(
            "/other/get_loggers",
            GetLoggers,
            lambda _: GetLoggersResponse([Logger("rosout", levels["rosout"])]),
        )
        await node.serve("/other/set_logger_level", SetLoggerLevel, set_level)

    served.run(offer())
    page = browse(address(served, "console"))
    page.wait_text("#state", "connected")
    page.wait(
        "document.querySelector('.loggers select')?.options.length > 1 || "
        "([...document.querySelectorAll('button')].find(e => e.textContent === 'Logger levels').click(), false);"
        "return document.querySelector('.loggers select')?.options.length > 1"
    )
    page.choose(".loggers select", "/other")
    page.choose(".loggers .grid select", "debug")
    assert changed.wait(PATIENCE)
    assert levels == {"rosout": "debug"}


@needs_chromium
def test_plot_draws_fields_of_a_topic_without_loss(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from geometry_msgs.msg import Vector3

    served = serve()
    moving = publisher(served, "/odometry", Vector3, latch=True, queue_size=None)
    served.run(moving.publish(0.0, 0.0, 0.0))
    page = browse(address(served, "plot?path=/odometry/x&path=/odometry.y"))
    page.wait_text(".series[data-label='/odometry/x']", "1 points")

    async def publish() -> None:
        for number in range(1, 5000):
            await moving.publish(float(number), 1.5, 0.0)

    served.run(publish())
    page.wait_text(".series[data-label='/odometry/x']", "5000 points")
    page.wait_text(".series[data-label='/odometry/x'] .num", "4999")
    page.wait_text(".series[data-label='/odometry/y'] .num", "1.5")
    page.type("input[list=paths]", "/odometry/z")
    page.click("button[type=submit]")
    page.wait_text(".series[data-label='/odometry/z']", "/odometry/z")
    assert "path=%2Fodometry%2Fz" in page.evaluate("location.href")
    page.wait("return document.querySelector('.chart canvas').width > 300")
    left, right = page.evaluate(
        "['.series .swatch', '.series .num'].map(e => document.querySelector(e).getBoundingClientRect().left)"
    )
    assert (
        left < page.evaluate("document.querySelector('.series .label').getBoundingClientRect().left") < right
    )
    page.click(".series[data-label='/odometry/z'] button[title^=Remove]")
    page.wait("return !document.querySelector(\".series[data-label='/odometry/z']\")")


@needs_chromium
def test_plot_takes_slices_and_waits_for_a_topic(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from std_msgs.msg import Float64MultiArray

    served = serve()
    page = browse(address(served, "plot?path=/late/data[1:3]"))
    page.wait_text(".series-missing .muted", "waiting for /late/data[1:3]")
    served.run(publisher(served, "/late", Float64MultiArray, latch=True).publish(data=[1.0, 2.0, 3.0, 4.0]))
    page.wait_text(".series[data-label='/late/data[1]'] .num", "2")
    page.wait_text(".series[data-label='/late/data[2]'] .num", "3")
    assert page.evaluate("document.querySelectorAll('.series').length") == 2


@needs_chromium
def test_paths_without_a_number_are_named_and_removed(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from std_msgs.msg import Bool

    served = serve()
    served.run(publisher(served, "/button", Bool, latch=True).publish(Bool(False)))
    page = browse(address(served, "plot?path=/button&path=/missing"))
    for number in range(4):
        page.type("form input", f"/button/wrong{number}")
        page.click("form button", "Plot")
        page.wait_text(".series-missing .error", f"/button/wrong{number}: no number there")
    page.wait_text(".series-missing .muted", "waiting for /missing")
    for _ in range(5):
        page.click(".series-missing button")
    page.wait("return !document.querySelector('.series-missing') && !location.hash.includes('missing')")
    assert "wrong" not in page.evaluate("location.hash")
    page.wait_text(".series[data-label='/button/data'] .num", "0")


@needs_chromium
def test_graph_shows_nodes_and_topics_and_their_details(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    listener = served.node("listener")
    publisher(served, "/chatter", String)

    async def listen() -> Any:
        return await listener.subscribe("/chatter", String)

    subscription = served.run(listen())
    page = browse(address(served, "graph"))
    page.wait_text(".node text", "/talker_chatter")
    page.wait_text(".node text", "/listener")
    page.wait("return document.querySelectorAll('.edge').length === 2")
    page.click(".graph .topic", "/chatter")
    # The view subscribes to a selected topic, so its list changes once.
    page.wait_text(".side", "std_msgs/String")
    page.wait_text(".side button", "/dashboard")
    page.evaluate("[...document.querySelectorAll('.side button')].forEach(button => button.isOld = true)")
    publisher(served, "/other", String)
    page.wait_text(".node text", "/talker_other")
    assert page.evaluate("[...document.querySelectorAll('.side button')].every(button => button.isOld)")
    page.click(".side button", "/listener")
    page.wait_text(".side", "Subscribes to (1)")
    page.choose("select[aria-label='What is shown']", "nodes")
    page.wait_text(".edge text", "/chatter")
    assert page.evaluate("document.querySelectorAll('.graph .topic').length") == 0
    page.choose("select[aria-label='What is shown']", "all")
    page.wait_text(".graph .topic text", "/chatter")
    assert "/rosout" not in page.evaluate("document.querySelector('svg.graph').textContent")
    page.click("label", "hide debug")
    page.wait_text(".graph .topic text", "/rosout")
    served.run(subscription.close())
    page.wait("return ![...document.querySelectorAll('.edge')].some(e => e.dataset.to === 'n/listener')")


@needs_chromium
def test_board_lights_and_is_pressed(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from minirospy.board.board import Board

    served = serve()
    with Board() as board:
        page = browse(address(served, "board"))
        page.wait("return document.querySelector('[aria-label=\"LED GPIO 7 red off\"]')")
        board.set(7, 1)
        page.wait("return document.querySelector('.lit[aria-label=\"LED GPIO 7 red on\"]')")
        edges = board.watch([11, 12], timeout=PATIENCE)
        page.press(".push[data-pin='11']")
        assert next(edges)[:2] == (11, 1)
        page.wait("return document.querySelector('.push.down[data-pin=\"11\"]')")
        page.release(".push[data-pin='11']")
        assert next(edges)[:2] == (11, 0)
        for kind, level in (("keyDown", 1), ("keyUp", 0)):
            page.call("Input.dispatchKeyEvent", type=kind, key="2", code="Digit2", text="2" if level else "")
            assert next(edges)[:2] == (12, level)
        page.click("button", "Let a person come")
        page.wait_text(".panel", "0.60 m ahead")
        board.move_person((0.3, 0.0))
        page.wait_text(".panel", "in the protective field")
        # The field names can be read in front of the person, who can still be dragged.
        for name in ("warning field", "protective field"):
            label = f"[...document.querySelectorAll('.room text')].find(e => e.textContent === '{name}')"
            assert page.evaluate(
                f"[document.querySelector('.person').compareDocumentPosition({label}), getComputedStyle({label}).paintOrder]"
            ) == [4, "stroke"]
        assert page.evaluate(
            f"(r => document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2))({label}.getBoundingClientRect())"
            ".closest('.person') !== null"
        )


@needs_chromium
def test_image_is_drawn_and_its_pixels_have_values(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from sensor_msgs.msg import CompressedImage, Image

    served = serve()
    raw = Image(
        height=2,
        width=2,
        encoding="bgr8",
        step=8,
        data=bytes((1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12, 0, 0)),
    )
    served.run(publisher(served, "/camera/image_raw", Image, latch=True).publish(raw))
    one_red_pixel = base64.b64decode(
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"
    )
    packed = CompressedImage(format="png", data=one_red_pixel)
    served.run(publisher(served, "/camera/compressed", CompressedImage, latch=True).publish(packed))
    page = browse(address(served, "image?topic=/camera/image_raw"))
    page.wait_text(".status", " 2 · bgr8")
    pixel = "Array.from(document.querySelector('canvas').getContext('2d').getImageData(%d, %d, 1, 1).data)"
    assert page.evaluate(pixel % (0, 0)) == [3, 2, 1, 255]
    assert page.evaluate(pixel % (1, 1)) == [12, 11, 10, 255]
    page.choose("select", "/camera/compressed")
    page.wait_text(".status", " 1 · png")
    assert page.evaluate(pixel % (0, 0)) == [255, 0, 0, 255]


@needs_chromium
def test_service_is_called_by_its_form(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from rospy_tutorials.srv import AddTwoInts, AddTwoIntsResponse

    served = serve()
    node = served.node("adder")

    async def offer() -> None:
        await node.serve("/add", AddTwoInts, lambda request: AddTwoIntsResponse(request.a + request.b))

    served.run(offer())
    page = browse(address(served, "services?service=/add"))
    page.wait_text(".form", "int64")
    page.type("input[name=a]", "40")
    page.type("input[name=b]", "2")
    page.click("button", "Call")
    page.wait_text(".answer", "sum: 42")
    page.type("input[name=b]", "2.5")
    page.click("button", "Call")
    page.wait_text(".answer.error", 'b: "2.5" is not a whole number')


@needs_chromium
def test_message_is_published_by_its_form(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    publisher(served, "/cmd_vel", Twist)
    robot = served.node("robot")

    async def listen() -> Any:
        return await robot.subscribe("/cmd_vel", Twist)

    subscription = served.run(listen())
    page = browse(address(served, "publish?topic=/cmd_vel"))
    page.wait_text(".form", "angular")
    page.type("input[name=x]", "0.5")
    page.click("button", "Repeat")
    assert served.run(subscription.next(PATIENCE)).linear.x == 0.5
    page.wait_text("p[role=status]", "published")
    page.click("button", "Stop")
    page.type("input[name=x]", "fast")
    page.click("button", "Publish once")
    page.wait_text("p.error", 'x: "fast" is not a number')


@needs_chromium
def test_form_stays_when_the_publisher_of_its_topic_leaves(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    leaving = publisher(served, "/cmd_vel", Twist)
    robot = served.node("robot")

    async def listen() -> Any:
        return await robot.subscribe("/cmd_vel", Twist)

    subscription = served.run(listen())
    page = browse(address(served, "publish"))
    page.choose("select[aria-label=Topic]", "/cmd_vel")
    page.wait_text(".form", "angular")
    page.type("input[name=x]", "0.5")
    page.evaluate("document.querySelector('.form').isOld = true")
    served.run(leaving.close())
    page.wait("return document.querySelector(\"input[aria-label='Its type']\").checkVisibility()")
    page.click("button", "Publish once")
    assert served.run(subscription.next(PATIENCE)).linear.x == 0.5
    assert page.evaluate("document.querySelector('.form').isOld")


@needs_chromium
def test_topic_without_publisher_is_published(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    robot = served.node("robot")

    async def listen(topic: str, cls: type) -> Any:
        return await robot.subscribe(topic, cls)

    turning = served.run(listen("/turtle1/cmd_vel", Twist))
    page = browse(address(served, "publish"))
    # The topic's subscriber provides the type.
    page.choose("select[aria-label=Topic]", "/turtle1/cmd_vel")
    page.wait_text(".form", "angular")
    page.type("input[name=x]", "2")
    page.click("button", "Publish once")
    assert served.run(turning.next(PATIENCE)).linear.x == 2.0
    page.wait_text("p[role=status]", "1 published")
    assert page.evaluate("document.querySelector('input[name=x]').value") == "2"

    # Enter a new name and type.
    page.choose("select[aria-label=Topic]", "new")
    page.type("input[aria-label='Name of the new topic']", "greeting")
    page.type("input[aria-label='Its type']", "std_msgs/Strin")
    page.evaluate("document.activeElement.blur()")
    page.wait_text("p.error", "message type [std_msgs/Strin] not found")
    page.type("input[aria-label='Its type']", "std_msgs/String")
    page.evaluate("document.activeElement.blur()")
    page.type("input[name=data]", "hello")
    page.click("button", "Repeat")
    heard = served.run(listen("/greeting", String))
    assert served.run(heard.next(PATIENCE)).data == "hello"
    page.click("button", "Stop")


@needs_chromium
def test_parameters_are_shown_set_and_deleted(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    node = served.node("robot")
    served.run(node.set_param("/robot/speed", 1.5))
    page = browse(address(served, "parameters"))
    page.wait("return document.querySelector(\"[data-name='/robot/speed'] input\")?.value === '1.5'")
    served.run(node.set_param("/robot/speed", 2))
    page.wait("return document.querySelector(\"[data-name='/robot/speed'] input\")?.value === '2'")
    served.run(node.set_param("/robot/gains", [2.0, 1.5]))
    page.wait("return document.querySelector(\"[data-name='/robot/gains'] input\")?.value === '[2.0,1.5]'")
    page.type("[data-name='/robot/gains'] input", "[2.0, 3.0]")
    page.evaluate("document.querySelector(\"[data-name='/robot/gains']\").requestSubmit()")
    page.wait("return document.querySelector(\"[data-name='/robot/gains'] input\")?.value === '[2.0,3.0]'")
    assert repr(served.run(node.get_param("/robot/gains"))) == "[2.0, 3.0]"
    page.type("input[placeholder='/name']", "/robot/list")
    page.type("input[placeholder^=value]", "[1, 2.0")
    page.wait_text(".preview-type", "expected")
    page.type("input[placeholder^=value]", "hello")
    page.wait_text(".preview-type", "string: hello")
    page.type("input[placeholder^=value]", "[1, 2]")
    page.wait_text(".preview-type", "list: ")
    page.click("button", "Set")
    page.wait("return document.querySelector(\"[data-name='/robot/list'] input\")?.value === '[1,2]'")
    assert served.run(node.get_param("/robot/list")) == [1, 2]
    page.type("[data-name='/robot/list'] input", "[1")
    page.evaluate("document.querySelector(\"[data-name='/robot/list']\").requestSubmit()")
    page.wait_text("[data-name='/robot/list'] .preview-type.error", "expected")
    page.click("[data-name='/robot/list'] button", "delete")
    page.wait("return !document.querySelector(\"[data-name='/robot/list']\")")
    assert not served.run(node.has_param("/robot/list"))


# --- turtlesim, driving


@contextlib.contextmanager
def repeated(served: Served, publishing: Any, message: Any) -> Iterator[None]:
    """Publish a message repeatedly."""

    async def publish() -> None:
        while True:
            await publishing.publish(message)
            await asyncio.sleep(0.1)

    async def begin() -> asyncio.Task[None]:
        return asyncio.create_task(publish())

    async def end(task: asyncio.Task[None]) -> None:
        task.cancel()
        await asyncio.wait([task])

    task = served.run(begin())
    try:
        yield
    finally:
        served.run(end(task))


@needs_chromium
def test_turtles_are_drawn_with_their_trails_and_come_and_go(
    serve: Callable[..., Served], start: Callable[..., Any], browse: Callable[..., Page]
) -> None:
    served = serve()
    start("turtlesim", "turtlesim_node", "_background_r:=10")
    page = browse(address(served, "turtlesim"))
    page.wait_text("[data-name='/turtle1']", "x 5.544 y 5.544")
    page.wait("return document.querySelector(\"[data-turtle='/turtle1']\").getClientRects().length")
    paper = "document.querySelector('canvas.paper').getContext('2d')"
    pixel = f"Array.from({paper}.getImageData(%d, %d, 1, 1).data).slice(0, 3).join()"
    page.wait(f"return {pixel % (3, 3)} === '10,86,255'")
    page.type("input[aria-label=name]", "leo")
    page.click("button", "Spawn")
    page.wait_text("[data-name='/leo']", "x 2 y 2")
    page.click("button", "Spawn")
    page.wait_text(".error", "leo")
    # Drive in a circle, which ends where it started.
    twist = Twist()
    twist.linear.x, twist.angular.z = 1.0, 2.0
    with repeated(served, publisher(served, "/turtle1/cmd_vel", Twist), twist):
        page.wait(f"return {pixel % (249, 249)} === '179,184,255'")
    page.click("[data-name='/turtle1'] button", "kill")
    page.wait("return !document.querySelector(\"[data-name='/turtle1'], [data-turtle='/turtle1']\")")
    assert page.evaluate(pixel % (249, 249)) == "179,184,255"
    page.click("button", "Clear")
    page.wait(f"return {pixel % (249, 249)} === '10,86,255'")
    page.click("button", "Reset")
    page.wait_text("[data-name='/turtle1']", "x 5.544 y 5.544")
    page.wait("return !document.querySelector(\"[data-name='/leo']\")")


def listener(served: Served, topic: str, name: str = "robot") -> Callable[[Callable[[Twist], bool]], None]:
    """Return a function that waits for a message on a topic that meets a condition."""
    robot = served.node(name)

    async def listen() -> Any:
        return await robot.subscribe(topic, Twist)

    subscription = served.run(listen())

    def until(is_right: Callable[[Twist], bool]) -> None:
        while not is_right(served.run(subscription.next(PATIENCE))):
            pass

    return until


def is_zero(twist: Twist) -> bool:
    return not twist.linear.x and not twist.angular.z


def drag(page: Page, kind: str, right: float, up: float) -> None:
    """Press, move or release the mouse at an offset from the stick's middle."""
    x, y = page.wait(
        "const r = document.querySelector('svg.stick').getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]"
    )
    page.call(
        "Input.dispatchMouseEvent", type=kind, x=x + right, y=y - up, button="left", buttons=1, clickCount=1
    )


def press(page: Page, kind: str, key: str) -> None:
    page.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)


@needs_chromium
def test_stick_drives_an_unpublished_topic_and_stops_when_released(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    until = listener(served, "/turtle1/cmd_vel")
    page = browse(address(served, "teleop?topic=/turtle1/cmd_vel"))
    page.wait_text("#state", "connected")
    drag(page, "mousePressed", 0, 40)
    until(lambda twist: twist.linear.x > 0.05 and twist.angular.z == 0)
    drag(page, "mouseMoved", -400, 0)
    until(lambda twist: abs(twist.linear.x) < 1e-6 and twist.angular.z == 1)
    drag(page, "mouseReleased", -400, 0)
    until(is_zero)
    page.wait_text("p[role=status]", "stopped")
    # Change the topic and the speed.
    page.type("input[aria-label=Topic]", "/other/cmd_vel")
    page.type("input[aria-label='Metres a second']", "2")
    page.wait("document.activeElement.blur(); return location.hash.includes('linear=2')")
    assert "topic=%2Fother%2Fcmd_vel" in page.evaluate("location.hash")


@needs_chromium
@pytest.mark.parametrize(
    "leaving",
    [
        "location.hash = '#/topics'",
        "Object.defineProperty(document, 'hidden', {get: () => true}); document.dispatchEvent(new Event('visibilitychange'))",
        "dispatchEvent(new Event('blur'))",
    ],
)
def test_robot_stops_when_the_page_is_hidden_or_shows_another_view(
    serve: Callable[..., Served], browse: Callable[..., Page], leaving: str
) -> None:
    served = serve()
    until = listener(served, "/cmd_vel")
    page = browse(address(served, "teleop"))
    page.wait_text("#state", "connected")
    page.wait_text("p[role=status]", "stopped")
    press(page, "rawKeyDown", "ArrowUp")
    press(page, "rawKeyDown", "ArrowLeft")
    until(lambda twist: (twist.linear.x, twist.angular.z) == (0.5, 1))
    page.evaluate(leaving)
    until(is_zero)


@needs_chromium
def test_gamepad_drives_while_its_deadman_button_is_held(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    until = listener(served, "/cmd_vel")
    page = browse(address(served, "teleop"))
    page.wait_text("#state", "connected")
    page.evaluate(
        "window.pad = {connected: true, id: 'Pad 7', axes: [0.05, -1], buttons: [...'012345'].map(() => ({pressed: false}))};"
        "navigator.getGamepads = () => [null, window.pad]"
    )
    page.wait_text(".teleop", "Gamepad: Pad 7")
    assert "stopped" in page.wait_text("p[role=status]", "")
    page.evaluate("pad.buttons[4].pressed = true")
    until(lambda twist: (twist.linear.x, twist.angular.z) == (0.5, 0))
    page.evaluate("pad.buttons[4].pressed = false")
    until(is_zero)


@needs_chromium
def test_teleop_names_what_it_cannot_drive(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from minirospy.web.access import Access

    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    publisher(served, "/chatter", String)
    page = browse(address(served, "teleop?topic=/chatter&token=write-token-0"))
    page.wait_text(".teleop .error", "/chatter has the type std_msgs/String, not geometry_msgs/Twist")
    reader = browse(address(served, "teleop?token=read-token-00"))
    reader.wait_text(".teleop .error", "This token is read-only")


# --- diagnostics, hostile names, files, images


def statuses(*rows: tuple[str, int, str], **values: str) -> Any:
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    found = [KeyValue(key, value) for key, value in values.items()]
    return DiagnosticArray(
        status=[DiagnosticStatus(level, name, text, "serial 7", found) for name, level, text in rows]
    )


@needs_chromium
def test_diagnostics_are_a_tree_with_levels_and_values(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    message = statuses(
        ("/Robot", 2, "Error"),
        ("/Robot/Drive/left", 2, "motor hot"),
        ("/Robot/Scan", 0, "fine"),
        volts="11.5",
    )
    page = browse(address(served, "diagnostics"))
    page.wait_text(".empty", "Nothing has come on /diagnostics.")
    row = "[data-path='/Robot{}']"
    with repeated(served, publisher(served, "/diagnostics_agg", type(message)), message):
        # The level of a group whose items are not reported is the worst level of its children.
        page.wait_text(row.format("/Drive") + " .badge", "Error")
        page.wait_text(row.format("/Scan") + " .badge", "OK")
        page.click(row.format("/Drive/left") + " .report")
        page.wait_text(".side", "serial 7")
        page.wait_text(".values", "volts11.5")
        assert "name=%2FRobot%2FDrive%2Fleft" in page.evaluate("location.hash")
        page.click("label", "only problems")
        page.wait(f'return !document.querySelector("{row.format("/Scan")}")')
        page.click(row.format("") + " .fold")
        page.wait("return document.querySelectorAll('.status-row').length === 1")
        page.click(row.format("") + " .fold")
    page.wait_text(row.format("/Drive/left") + " .badge", "Stale")


@needs_chromium
def test_history_of_a_status_has_its_changes(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    page = browse(address(served, "diagnostics?name=/Drive"))
    page.evaluate("performance.now = () => 1e6")  # a page that stalls must not record a silence
    first = statuses(("/Drive", 0, "cool"))
    target = publisher(served, "/diagnostics_agg", type(first), queue_size=None)
    for level, text in ((0, "cool"), (2, HOSTILE), (0, "cool again")):
        with repeated(served, target, statuses(("/Drive", level, text))):
            page.wait_text(".side", text)
    found = page.evaluate("[...document.querySelectorAll('.history li')].map(e => e.textContent)")
    assert [each.split(" ", 1)[1] for each in found] == ["OK cool again", f"Error {HOSTILE}", "OK cool"]


@needs_chromium
def test_diagnostics_without_aggregator_are_a_list(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    message = statuses(("/camera/driver: frames", 1, "slow"), ("laser: beams", 0, "fine"))
    page = browse(address(served, "diagnostics"))
    with repeated(served, publisher(served, "/diagnostics", type(message)), message):
        page.wait_text(".status-row .name", "/camera/driver: frames")
        page.wait_text(".status-row .badge", "Warning")
    assert page.evaluate("document.querySelectorAll('.status-row').length") == 2


HOSTILE = "<img src=x onerror=\"document.title='broken'\">"


@needs_chromium
@pytest.mark.parametrize(
    ("view", "find"),
    [
        ("console", ".line .node"),
        ("image?topic=/hostile/image", ".status"),
        ("diagnostics", ".status-row .name"),
        ("topics", ".row[data-topic='/hostile/image'] .preview"),
        ("parameters", ".row.parameter"),
    ],
)
def test_hostile_names_of_nodes_and_frames_are_text(
    serve: Callable[..., Served], browse: Callable[..., Page], view: str, find: str
) -> None:
    from rosgraph_msgs.msg import Log
    from sensor_msgs.msg import Image

    served = serve()
    image = Image(height=1, width=1, encoding="mono8", step=1, data=b"\1")
    image.header.frame_id = HOSTILE
    served.run(publisher(served, "/hostile/image", Image, latch=True).publish(image))
    served.run(publisher(served, "/rosout_agg", Log, latch=True).publish(Log(level=8, name=HOSTILE, msg="m")))
    message = statuses((HOSTILE, 2, HOSTILE))
    served.run(publisher(served, "/diagnostics", type(message), latch=True).publish(message))
    served.run(served.node("setter").set_param("/hostile", HOSTILE))
    page = browse(address(served, view))
    if view == "topics":  # images are only subscribed to once they are opened
        page.click("button.topic", "/hostile/image")
        page.wait_text(".row[data-topic='/hostile/image'] .fields", HOSTILE)
    elif view == "parameters":
        page.wait(
            f"return [...document.querySelectorAll('input')].some(e => e.value.includes({json.dumps(HOSTILE[:9])}))"
        )
    else:
        page.wait_text(find, HOSTILE)
    assert page.evaluate("document.querySelectorAll('main img, main script').length") == 0
    assert "broken" not in page.evaluate("document.title")


@needs_chromium
def test_hostile_names_in_the_graph_are_text(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from xmlrpc.client import ServerProxy

    served = serve()
    # The master accepts any name that a node registers.
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        answer = master.registerPublisher(
            "/" + HOSTILE, "/hostile", "std_msgs/String", os.environ["ROS_MASTER_URI"]
        )
    assert answer[0] == 1, answer
    page = browse(address(served, "graph"))
    page.choose("select[aria-label='What is shown']", "all")
    page.wait_text(".node text", "<img")
    assert page.evaluate("document.querySelectorAll('main img, main script').length") == 0
    assert page.evaluate("document.title") == "Graph · minirospy"


def saved(page: Page, folder: Path, name: str, button: str) -> bytes:
    """Click a button; return the contents of the file that the browser saves."""
    page.save_downloads(folder)
    page.click("button", button)
    end = time.monotonic() + PATIENCE
    file = folder / name
    # The browser writes to a temporary name first, and may create this file empty.
    while not file.exists() or not file.stat().st_size or any(folder.glob("*.crdownload")):
        assert time.monotonic() < end, f"{name} is not saved"
        page.evaluate("new Promise(resolve => setTimeout(resolve, 30))")
    return file.read_bytes()


@needs_chromium
def test_csv_and_png_of_a_plot_are_saved(
    serve: Callable[..., Served], browse: Callable[..., Page], tmp_path: Path
) -> None:
    from geometry_msgs.msg import Vector3

    served = serve()
    moving = publisher(served, "/odometry", Vector3, latch=True, queue_size=None)
    served.run(moving.publish(1.5, 0.0, 0.0))
    page = browse(address(served, "plot?path=/odometry/x&path=/odometry/y"))
    page.wait_text(".series[data-label='/odometry/x']", "1 points")
    page.wait_text(".series[data-label='/odometry/y']", "1 points")
    head, first = saved(page, tmp_path, "plot.csv", "CSV").decode().splitlines()
    assert head.replace('"', "").split(",") == ["time", "/odometry/x", "/odometry/y"]
    assert first.split(",")[1:] == ["1.5", "0"]
    page.wait("return document.querySelector('.chart canvas').width > 300")
    # The picture also labels a computed series.
    page.choose(".series[data-label='/odometry/x'] select", "derivative")
    page.evaluate(
        """{ window.drawn = []; const draw = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {
          drawn.push(text);
          draw.call(this, text, ...at);
        }; }"""
    )
    png = saved(page, tmp_path, "plot.png", "PNG")
    # The chart itself may be drawn again after the picture.
    drawn = page.evaluate("drawn")
    assert drawn[drawn.index("/odometry/x derivative") + 1] == "/odometry/y"
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    assert struct.unpack(">I", png[16:20])[0] == page.evaluate(
        "document.querySelector('.chart canvas').width"
    )


@needs_chromium
def test_csv_of_the_console_is_saved(
    serve: Callable[..., Served], browse: Callable[..., Page], tmp_path: Path
) -> None:
    served = serve()
    logger(served)((4, "/first", 'low, "very"\nlow'))
    page = browse(address(served, "console"))
    page.wait_text(".bar", "1 of 1 lines")
    rows = list(
        csv.reader(saved(page, tmp_path, "console.csv", "Export CSV").decode().splitlines(keepends=True))
    )
    assert rows[0] == ["time", "level", "node", "message", "file", "function"]
    assert rows[1][1:] == ["Warn", "/first", 'low, "very"\nlow', "a.py:7", "run"]


@needs_chromium
@pytest.mark.parametrize(
    ("encoding", "data", "about", "colors"),
    [
        (
            "mono8",
            bytes((0, 10, 200, 255)),
            "mono8",
            [(0, 0, 0), (10, 10, 10), (200, 200, 200), (255, 255, 255)],
        ),
        # One red, two green and one blue pixel: a pixel's missing colors are taken from its neighbors.
        ("bayer_rggb8", bytes((200, 100, 50, 30)), "bayer_rggb8", [(200, 75, 30)] + 3 * [None]),
        ("bayer_bggr8", bytes((200, 100, 50, 30)), "bayer_bggr8", [(30, 75, 200)] + 3 * [None]),
        (
            "16UC1",
            struct.pack("<4H", 1000, 2000, 3000, 2000),
            "1000 … 3000",
            [(0, 0, 0), (128,) * 3, (255,) * 3, None],
        ),
        (
            "32FC1",
            struct.pack("<4f", 0.5, float("nan"), 2.5, 1.5),
            "0.5 … 2.5",
            [(0, 0, 0), (20, 24, 60), (255,) * 3, (128,) * 3],
        ),
    ],
)
def test_mosaics_and_depths_are_shown(
    serve: Callable[..., Served],
    browse: Callable[..., Page],
    encoding: str,
    data: bytes,
    about: str,
    colors: list[tuple[int, ...] | None],
) -> None:
    from sensor_msgs.msg import Image

    served = serve()
    image = Image(height=2, width=2, encoding=encoding, step=len(data) // 2, data=data)
    served.run(publisher(served, "/camera", Image, latch=True).publish(image))
    page = browse(address(served, "image?topic=/camera"))
    page.wait_text(".status", about)
    pixels = page.evaluate(
        "Array.from(document.querySelector('canvas').getContext('2d').getImageData(0, 0, 2, 2).data)"
    )
    for index, color in enumerate(colors):
        if color:
            assert tuple(pixels[index * 4 : index * 4 + 3]) == color, index


@needs_chromium
def test_image_is_zoomed_and_its_depths_are_scaled(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from sensor_msgs.msg import Image

    served = serve()
    depths = Image(height=1, width=4, encoding="16UC1", step=8, data=struct.pack("<4H", 0, 100, 200, 1000))
    served.run(publisher(served, "/depth", Image, latch=True).publish(depths))
    page = browse(address(served, "image?topic=/depth&high=400"))
    grays = (
        "[...document.querySelector('canvas').getContext('2d').getImageData(0, 0, 4, 1).data]"
        ".filter((_, index) => index % 4 === 0)"
    )
    page.wait(
        f"const g = {grays}; return g[3] === 255 && Math.abs(g[1] - 64) < 2 && Math.abs(g[2] - 128) < 2"
    )
    page.type("input[aria-label='Black at']", "100")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    page.wait(f"const g = {grays}; return g[1] === 0 && Math.abs(g[2] - 85) < 2")
    assert "low=100&high=400" in page.evaluate("location.hash")

    wide = page.evaluate("document.querySelector('canvas').getBoundingClientRect().width")
    x, y = page.evaluate(
        "(() => { const r = document.querySelector('canvas').getBoundingClientRect();"
        "return [r.x + r.width * 0.8, r.y + r.height / 2] })()"
    )
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    page.wait_text(".status", "(3, 0): 1000")
    page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-800)
    page.wait(f"return document.querySelector('canvas').getBoundingClientRect().width > {wide} * 2")
    # Moving the mouse shows the object under it again.
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + 1, y=y)
    page.wait_text(".status", "(3, 0): 1000")
    assert page.evaluate("document.querySelector('.frame').scrollLeft") > 0
    page.evaluate("document.querySelector('.frame').dispatchEvent(new MouseEvent('dblclick'))")
    page.wait(f"return Math.abs(document.querySelector('canvas').getBoundingClientRect().width - {wide}) < 2")


@needs_chromium
def test_compressed_depths_are_shown_in_the_colors_of_a_map(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    import numpy as np
    from sensor_msgs.msg import CompressedImage, Image

    from minirospy.ros.cv_bridge.cv_bridge.core import CvBridge
    from minirospy.ros.image_transport.codecs import Settings, compressed, compressed_depth

    served = serve()
    bridge = CvBridge()
    metres = bridge.cv2_to_imgmsg(np.array([[1.0, 2.0, np.nan, 5.0]], np.float32), "32FC1")
    deep = bridge.cv2_to_imgmsg(np.array([[1, 300, 40_000, 65_535]], np.uint16), "16UC1")
    yuyv = Image(height=1, width=2, encoding="yuv422_yuy2", step=4, data=bytes([81, 90, 81, 240]))
    for topic, message in (
        ("/metres/compressedDepth", compressed_depth(metres, Settings())),
        ("/deep/compressed", compressed(deep, Settings(format="png"))),
        ("/yuyv", yuyv),
    ):
        class_ = Image if topic == "/yuyv" else CompressedImage
        served.run(publisher(served, topic, class_, latch=True).publish(message))

    page = browse(address(served, "image?topic=/metres/compressedDepth&colors=turbo&low=1&high=5"))
    colors = "[...document.querySelector('canvas').getContext('2d').getImageData(0, 0, 4, 1).data]"
    page.wait(
        f"return {colors}.slice(0, 3).join() === '48,18,59' && {colors}.slice(12, 15).join() === '122,4,3'"
    )
    assert page.evaluate(f"{colors}.slice(8, 11)") == [20, 24, 60]  # nothing is measured there
    page.choose("select[aria-label='Colors of the numbers']", "gray")
    page.wait(f"return {colors}.slice(0, 3).join() === '0,0,0' && {colors}[12] === 255")

    page.open(address(served, "image?topic=/deep/compressed"))
    page.wait(f"return {colors}[0] === 0 && {colors}[4] === 1 && {colors}[8] === 156 && {colors}[12] === 255")
    page.open(address(served, "image?topic=/yuyv"))
    page.wait(f"const c = {colors}; return c[0] > 250 && c[1] < 5 && c[2] < 5")


@needs_chromium
def test_markers_are_drawn_over_the_image(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    import rospy
    from geometry_msgs.msg import Point
    from sensor_msgs.msg import Image
    from std_msgs.msg import ColorRGBA
    from visualization_msgs.msg import ImageMarker

    served = serve()
    image = Image(height=40, width=60, encoding="mono8", step=60, data=bytes(60 * 40))
    served.run(publisher(served, "/camera", Image, latch=True).publish(image))
    markers = publisher(served, "/found", ImageMarker)
    page = browse(address(served, "image?topic=/camera&markers=/found"))
    page.wait_text(".status", " 40 · mono8")
    served.run(markers.wait_for_subscribers(1))

    def draw(number: int, kind: int, **fields: Any) -> None:
        served.run(markers.publish(ImageMarker(ns="a", id=number, type=kind, **fields)))

    def corners(*places: tuple[float, float]) -> list[Point]:
        return [Point(x=x, y=y) for x, y in places]

    red, green, blue = ColorRGBA(r=1, a=1), ColorRGBA(g=1, a=1), ColorRGBA(b=1)
    draw(1, ImageMarker.CIRCLE, position=Point(x=10, y=10), scale=12, filled=1, fill_color=red)
    draw(2, ImageMarker.LINE_LIST, points=corners((30, 5), (50, 5), (30, 15), (50, 15)), scale=3,
         outline_color=red, outline_colors=[green, blue])  # fmt: skip
    draw(3, ImageMarker.POLYGON, points=corners((5, 22), (25, 22), (25, 38), (5, 38)), scale=1,
         outline_color=green, filled=1, fill_color=blue)  # fmt: skip
    draw(4, ImageMarker.POINTS, points=corners((40, 30), (52, 30)), scale=5, outline_color=red)

    def color(x: int, y: int) -> str:
        canvas = "document.querySelector('canvas.overlay').getContext('2d')"
        return f"String([...{canvas}.getImageData({x}, {y}, 1, 1).data])"

    for (x, y), shown in {
        (10, 10): "255,0,0,255", (40, 5): "0,255,0,255", (40, 15): "0,0,255,255", (15, 30): "0,0,255,255",
        (40, 30): "255,0,0,255", (52, 30): "255,0,0,255", (57, 38): "0,0,0,0",
    }.items():  # fmt: skip
        page.wait(f"return {color(x, y)} === '{shown}'")

    # One marker is removed, one is replaced by a marker with a lifetime.
    draw(1, ImageMarker.CIRCLE, action=ImageMarker.REMOVE)
    draw(
        4,
        ImageMarker.POINTS,
        points=corners((40, 35)),
        scale=5,
        outline_color=green,
        lifetime=rospy.Duration(0.2),
    )
    for x, y in ((10, 10), (40, 30), (40, 35)):
        page.wait(f"return {color(x, y)} === '0,0,0,0'")

    draw(5, 9)
    page.wait_text(".error", "a/5: the marker type 9 is not known")
    page.choose("select[aria-label='Markers over the image']", "")
    page.wait(f"return {color(40, 5)} === '0,0,0,0'")
    assert "markers" not in page.evaluate("location.hash")


@needs_chromium
def test_image_that_cannot_be_shown_is_named(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from sensor_msgs.msg import Image

    served = serve()
    short = Image(height=2, width=2, encoding="rgb8", step=6, data=b"123")
    served.run(publisher(served, "/short", Image, latch=True).publish(short))
    odd = Image(height=1, width=1, encoding="odd", step=1, data=b"1")
    served.run(publisher(served, "/odd", Image, latch=True).publish(odd))
    page = browse(address(served, "image?topic=/short"))
    page.wait_text(".error", "the image has 3 bytes, rgb8 of 2 x 2 needs 12")
    page.choose("select", "/odd")
    page.wait_text(".error", "images of encoding odd cannot be shown")


@needs_chromium
@pytest.mark.parametrize("view", VIEWS)
def test_view_fits_a_phone(serve: Callable[..., Served], browse: Callable[..., Page], view: str) -> None:
    served = serve()
    served.run(publisher(served, "/a/rather/long/name/of/a/topic", String, latch=True).publish("x " * 200))
    page = browse(address(served, view), width=360, height=700, dark=True)
    page.wait_text("#state", "connected")
    page.wait(f"return document.getElementById('view').dataset.view === '{view}'")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert page.evaluate("document.getElementById('view').scrollWidth") <= 360
