"""Launch files, joints and state machines in the dashboard, in Debian's chromium, operated as by a user."""

from __future__ import annotations

import base64
import json
import pickle
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import JointState
from smach_msgs.msg import (
    SmachContainerInitialStatusCmd,
    SmachContainerStatus,
    SmachContainerStructure,
)

from minirospy.web.dashboard.files import FOLDER
from tests.interop.browser import PATIENCE, Page
from tests.interop.page_modules import run_script
from tests.interop.test_interop_dashboard import (
    address,
    browse,
    needs_chromium,
    needs_node,
    publisher,
    start,
)
from tests.web.dashboard.conftest import Served, serve
from tests.web.dashboard.lamp import make_lamp
from tests.web.dashboard.robot import ROBOT

__all__ = ["browse", "serve", "start"]

HOSTILE = "<img src=x onerror=\"document.title='broken'\">"


# --- launch files


@needs_chromium
def test_launch_file_is_started_watched_and_stopped(
    serve: Callable[..., Served],
    browse: Callable[..., Page],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    make_lamp(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    page = browse(address(serve(), "launch"))
    page.type("input[aria-label='Filter packages and files']", "lamp.launch")
    page.click(".launch-files button", "launch/lamp.launch")
    page.wait_text(".launch-arg", "what is printed")
    page.type(".launch-arg input[name='word']", "good day")
    page.type(".launch-arg input[name='needed']", "yes")
    # The script dispatches the event that the user's keys would cause.
    page.evaluate("document.querySelector('.launch-form').dispatchEvent(new Event('input'))")
    page.wait_text(".launch-form code", "roslaunch lamp lamp.launch word:='good day' needed:=yes")
    page.click(".launch-form button", "Start")
    page.wait_text("tr[data-node='/talker'] .badge", "running")
    page.wait_text("tr[data-node='/failing'] .badge", "exited: 3")
    page.wait_text("tr[data-node='/missing'] .badge", "not started")
    page.wait(
        "return /started ([2-9]|\\d{2,}) times/.test(document.querySelector(\"tr[data-node='/again']\").textContent)"
    )
    page.wait_text(".launch-log", "cannot launch node of type [lamp/missing.py]")
    page.click("tr[data-node='/talker'] button", "log")
    page.wait_text(".launch-log", "talking: good day")
    page.wait_text(".launch-log", HOSTILE)
    page.click("tr[data-node='/talker'] button", "restart")
    page.wait_text("tr[data-node='/talker']", "started 2 times")
    page.click(".launch-run button", "Stop")
    page.wait_text(".launch-run h2 .badge", "ended")
    page.wait_text("tr[data-node='/talker'] .badge", "stopped")
    page.click(".launch-run button[title^='Remove']")
    page.wait("return !document.querySelector('.launch-run')")
    assert page.evaluate("document.title") == "Launch · minirospy"


# --- joints


@needs_chromium
def test_sliders_publish_joint_states(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    robot = served.node("robot")

    async def prepare() -> Any:
        await robot.set_param("/robot_description", ROBOT)
        await robot.set_param("/zeros", {"shoulder": 0.5})
        return await robot.subscribe("/joint_states", JointState)

    subscription = served.run(prepare())
    page = browse(address(served, "joints"))
    page.wait("return document.querySelector('[data-joint=shoulder] input[type=number]').value === '0.5'")
    page.click(".publish-switch input")

    def until(is_right: Callable[[dict[str, float]], bool]) -> dict[str, float]:
        while True:
            state = served.run(subscription.next(PATIENCE))
            positions = dict(zip(state.name, state.position, strict=True))
            if is_right(positions):
                return positions

    first = until(lambda positions: True)
    assert first == {"shoulder": 0.5, "wheel": 0.0, "lift": 0.2, "finger": pytest.approx(0.5 * -2 + 0.1)}
    page.evaluate("document.querySelector('[data-joint=shoulder] input[type=range]').focus()")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight")
    moved = until(lambda positions: positions["shoulder"] > 0.5)
    assert moved["shoulder"] == pytest.approx(0.53)
    assert moved["finger"] == pytest.approx(0.53 * -2 + 0.1)
    page.wait_text("[data-joint=finger] .joint-value", "-0.96")
    page.type("[data-joint=wheel] input[type=number]", "1.25")
    page.evaluate("document.activeElement.blur()")
    until(lambda positions: positions["wheel"] == 1.25)
    page.click("button", "Randomize")
    until(lambda positions: positions["wheel"] not in (0.0, 1.25))
    page.click("button", "Center")
    until(lambda positions: positions["wheel"] == 0.0 and positions["shoulder"] == 0.5)
    page.click("label", "degrees")
    page.wait("return document.querySelector('[data-joint=shoulder] input[type=number]').value === '28.6'")
    page.wait_text("[data-joint=lift]", "m")


@needs_chromium
def test_missing_robot_is_named(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    page = browse(address(served, "joints"))
    page.wait_text("p.empty", "robot_description parameter is required")

    async def describe() -> None:
        await served.node_of_dashboard.set_param("/robot_description", ROBOT)

    served.run(describe())
    page.wait_text(".joints", "shoulder")


# --- state machines


def structure(path: str, children: list[str], edges: list[tuple[str, str, str]], outcomes: list[str]) -> Any:
    return SmachContainerStructure(
        path=path,
        children=children,
        internal_outcomes=[label for _, label, _ in edges],
        outcomes_from=[source for source, _, _ in edges],
        outcomes_to=[target for _, _, target in edges],
        container_outcomes=outcomes,
    )


@needs_chromium
def test_states_are_drawn_with_the_active_ones_and_their_userdata(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    drawing = publisher(served, "/robot/smach/container_structure", SmachContainerStructure, latch=True)
    telling = publisher(served, "/robot/smach/container_status", SmachContainerStatus, latch=True)
    commands = served.node("machine")

    async def listen() -> Any:
        return await commands.subscribe("/robot/smach/container_init", SmachContainerInitialStatusCmd)

    subscription = served.run(listen())
    page = browse(address(served, "smach"))
    page.choose("select[aria-label='State machine']", "/robot")
    root = structure(
        "/ROOT",
        ["DRIVE", "DOCK", HOSTILE],
        [("DRIVE", "arrived", "DOCK"), ("DOCK", "failed", "DRIVE"), ("DOCK", "docked", "done")],
        ["done", "aborted"],
    )
    inner = structure(
        "/ROOT/DOCK",
        ["ALIGN", "PUSH"],
        [("ALIGN", "aligned", "PUSH"), ("ALIGN", "again", "ALIGN"), ("PUSH", "in", "docked")],
        ["docked", "failed"],
    )
    for message in (root, inner):
        served.run(drawing.publish(message))
        path = json.dumps(message.path.rpartition("/")[2])
        page.wait(
            f"return [...document.querySelectorAll('.smach-title')].some(e => e.textContent === {path})"
        )
    # A transition from a state to itself starts and ends at the state's right side.
    at = page.evaluate(
        """{
        const edge = [...document.querySelectorAll('.edge')].find(e => e.lastChild.textContent === 'again');
        const path = edge.querySelector('path'), box = edge.parentNode.querySelector("[data-state='/ROOT/DOCK/ALIGN'] rect");
        const ends = [0, path.getTotalLength()].map(at => path.getPointAtLength(at).x);
        const side = box.parentNode.transform.baseVal[0].matrix.e + box.width.baseVal.value;
        ends.map(x => Math.abs(x - side) < 0.2)
        }"""
    )
    assert at == [True, True]
    data = base64.b64encode(pickle.dumps({"goal": [1.5, 2], "name": HOSTILE}, 2)).decode()
    status = SmachContainerStatus(
        path="/ROOT", initial_states=["DRIVE"], active_states=["DRIVE"], local_data=data
    )
    served.run(telling.publish(status))
    page.wait("return document.querySelector(\"[data-state='/ROOT/DRIVE']\").classList.contains('active')")
    page.wait_text(".smach-now", "now: /ROOT/DRIVE")
    page.wait_text(".side", "[1.5, 2]")
    assert HOSTILE[:10] in page.wait_text(".side", "name")
    status.active_states = ["DOCK"]
    served.run(telling.publish(status))
    page.wait("return document.querySelector(\"[data-state='/ROOT/DOCK']\").classList.contains('active')")
    page.wait_text(".smach-events", "DOCK")
    # After a container exits, its last status shows its last state, or the word None.
    inside = SmachContainerStatus(path="/ROOT/DOCK", initial_states=["ALIGN"], active_states=["PUSH"])
    served.run(telling.publish(inside))
    page.wait_text(".smach-now", "now: /ROOT/DOCK/PUSH")
    status.active_states = ["DRIVE"]
    served.run(telling.publish(status))
    page.wait("return document.querySelector('.smach-now').textContent === 'now: /ROOT/DRIVE'")
    assert page.evaluate("document.querySelectorAll('.smach .active').length") == 1
    inside.active_states, status.active_states = ["None"], ["DOCK"]
    for message in (inside, status):
        served.run(telling.publish(message))
    page.wait("return document.querySelector('.smach-now').textContent === 'now: /ROOT/DOCK'")
    page.click("[data-state='/ROOT/DOCK/PUSH'] rect")
    page.wait_text(".side h2", "/ROOT/DOCK/PUSH")
    page.click(".side button", "start here next time")
    command = served.run(subscription.next(PATIENCE))
    assert (command.path, command.initial_states) == ("/ROOT/DOCK", ["PUSH"])
    assert pickle.loads(base64.b64decode(command.local_data)) == {}
    assert page.evaluate("document.title") == "State machines · minirospy"


@needs_node
def test_userdata_is_read_without_making_objects(tmp_path: Path) -> None:
    class Own:
        pass

    Own.__qualname__ = "Own"
    globals()["Own"] = Own
    value = {"n": [1, -7, 2.5, None, True], "s": "aż<b>", "d": {"x": (1, 2)}, "big": 2**70, "own": Own()}
    lines = [base64.b64encode(pickle.dumps(value, protocol)).decode() for protocol in range(6)]
    endless: list[object] = []
    endless.append(endless)
    lines.append(base64.b64encode(pickle.dumps({"e": endless}, 2)).decode())
    wide: list[object] = [1]
    for _ in range(60):
        wide = [wide, wide]
    lines.append(base64.b64encode(pickle.dumps({"w": wide}, 2)).decode())
    lines += [
        base64.b64encode(each).decode()
        for each in (b"", b"\x80\x02]q\x00.", b"\x80\x02}q", b"\xff", b"R.", b"u.")
    ]
    program = f"""
import {{ userdataOf }} from {(FOLDER / "js" / "pickle.js").as_uri()!r};
for (const line of {json.dumps(lines)}) {{
  let answer;
  try {{ answer = userdataOf(line); }} catch (error) {{ answer = error.message; }}
  console.log(JSON.stringify(answer));
}}
"""
    done = subprocess.run(
        [shutil.which("node") or "", "--input-type=module", "-e", program],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    for protocol, answer in enumerate(answers[:6]):
        found = dict(answer)
        assert found["n"] == "[1, -7, 2.5, None, True]"
        assert found["d"] == '{"x": [1, 2]}'
        assert found["own"].startswith("<")
        if protocol:
            assert found["s"] == '"aż<b>"'
        if protocol > 1:
            assert found["big"] == str(2**70)
    assert answers[6][0][1].startswith("[[[[")
    assert len(answers[7][0][1]) < 20_000
    assert answers[8] == []
    assert answers[9:] == [
        "the userdata is not a dict",
        "the pickle is cut off",
        "the pickle has an opcode that is not read: 255",
        "the pickle is damaged",
        "the pickle is damaged",
    ]


@needs_node
def test_integer_of_userdata_that_is_very_long_is_only_named() -> None:
    # Decoding all its bytes would keep the page busy for minutes.
    body = """
        const bytes = new Uint8Array(1_000_008).fill(255);
        bytes.set([0x80, 2, 0x8b, 0x40, 0x42, 0x0f, 0]);
        bytes[1_000_007] = 46;
        return pythonText(readPickle(bytes));"""
    assert run_script("readPickle, pythonText", "js/pickle.js", body) == "<int of 1000000 bytes>"
