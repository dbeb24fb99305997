"""The programs of topic_tools: forwarded messages and errors. drive.py runs under real ROS, too (tests/interop)."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from minirospy.ros.topic_tools.programs import relay, throttle
from minirospy.ros.topic_tools.programs.passing import base_name
from minirospy.ros.topic_tools.programs.throttle import ByteLimit, MessageLimit, every

HERE = Path(__file__).parent
PROGRAMS = HERE.parents[2] / "msgs" / "topic_tools" / "scripts"


def test_programs_forward_the_same_as_real_ones(master: str) -> None:
    done = subprocess.run(
        [sys.executable, str(HERE / "drive.py"), str(PROGRAMS), sys.executable],
        capture_output=True,
        text=True,
        timeout=220,
        check=False,
    )
    assert done.stdout == (HERE / "drive.txt").read_text(encoding="utf-8"), done.stderr
    assert done.returncode == 0


@pytest.mark.parametrize("kind", ["relay", "throttle"])
def test_subscriber_that_comes_as_the_input_is_given_up_opens_it_again(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One thread checks for subscribers while another one is notified of the first of them."""
    comes: list[threading.Thread] = []

    class Input:
        is_open = False

        def __init__(self, *_: object) -> None:
            pass

        def open(self) -> None:
            self.is_open = True

        def close(self) -> None:
            self.is_open = False

    class Output:
        def __init__(self, *_: object, on_subscriber: Any, **__: object) -> None:
            self._on_subscriber = on_subscriber

        def advertise(self, _: object) -> None:
            pass

        @property
        def has_subscribers(self) -> bool:
            comes.append(threading.Thread(target=self._on_subscriber))
            comes[0].start()
            comes[0].join(0.2)
            return False

    module: Any = relay if kind == "relay" else throttle
    monkeypatch.setattr(module, "Input", Input)
    monkeypatch.setattr(module, "Output", Output)
    tool: Any = (
        relay.Relay("a", "b", is_lazy=True)
        if kind == "relay"
        else throttle.Filter("a", "b", every(0, 1), lambda: 0.0, is_lazy=True)
    )
    tool._received(None)
    comes[0].join()
    assert tool._input.is_open


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["relay"], "usage: relay IN_TOPIC [OUT_TOPIC]"),
        (["relay", "a", "b", "c"], "usage: relay IN_TOPIC [OUT_TOPIC]"),
        (["relay", "a b"], "ERROR: [a b] is not the name of a topic"),
        (["relay", "/"], "[/] is not the name of a topic"),
        (["throttle", "messages"], "throttle messages IN_TOPIC MSGS_PER_SEC"),
        (["drop", "a", "1"], "usage: drop IN_TOPIC X Y [OUT_TOPIC]"),
        (["mux", "a"], "usage: mux OUT_TOPIC IN_TOPIC1"),
        (["demux", "a"], "usage: demux IN_TOPIC OUT_TOPIC1"),
        (["mux_select", "mux"], "USAGE: mux_select MUX_NAME TOPIC"),
        (["demux_list"], "USAGE: demux_list DEMUX_NAME"),
        (["throttle", "messages", "a", "often"], "[often] is not a number above 0"),
        (["throttle", "messages", "a", "0"], "[0] is not a number above 0"),
        (["throttle", "bytes", "a", "5"], "throttle bytes takes 3 words"),
        (["throttle", "letters", "a", "5"], "usage:"),
        (["drop", "a", "-1", "3"], "[-1] is not a number of messages"),
        (["drop", "a", "1", "0"], "out of each 1 or more"),
        (["relay", "a", "b c"], "ERROR: [b c] is not the name of a topic"),
        (["mux", "a", "b", "c d"], "ERROR: [c d] is not the name of a topic"),
        (["demux", "a", "b", "c d"], "ERROR: [c d] is not the name of a topic"),
        (["transform", "/a", "/b", "std_msgs/String", "m +"], "'m +' is not an expression of Python"),
        (["transform", "/a", "/b", "std_msgs/Strong", "m"], "std_msgs/Strong"),
        (["relay_field", "/a", "/b", "std_msgs/String", "{data: m"], "the expression is not YAML"),
        (["relay_field", "/a", "/b", "std_msgs/String", "m"], "the expression is not a dictionary of fields"),
    ],
)
def test_wrong_words_are_refused_without_a_master(words: list[str], text: str) -> None:
    _refuse(words, text)


def _refuse(words: list[str], text: str) -> None:
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / words[0]), *words[1:]],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 1
    assert text in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_wrong_topic_of_transform_is_refused(master: str) -> None:
    _refuse(
        ["transform", "/a", "/b", "std_msgs/String", "m"], "ERROR: Wrong input topic (or topic field): /a"
    )


def test_calls_of_a_demux(master: str) -> None:
    with subprocess.Popen(
        [sys.executable, str(PROGRAMS / "demux"), "/in", "/one", "/two"], stdout=subprocess.DEVNULL
    ) as demux:
        try:
            printed = [
                subprocess.run(
                    [sys.executable, str(PROGRAMS / f"demux_{words[0]}"), "demux", *words[1:]],
                    capture_output=True,
                    text=True,
                    timeout=60,
                    check=False,
                )
                for words in (
                    ("select", "two"),
                    ("add", "/three"),
                    ("delete", "/two"),
                    ("delete", "/one"),
                    ("list",),
                )
            ]
        finally:
            demux.terminate()
    assert [done.returncode for done in printed] == [0, 0, 1, 0, 0]
    assert "Service call failed" in printed[2].stdout
    assert printed[4].stdout.splitlines() == [
        'Waiting for service "demux/list"',
        'Listing topics from demux "demux"',
        "['/two', '/three']",
    ]
    assert all("Traceback" not in done.stderr for done in printed)


def test_limit_of_messages() -> None:
    limit = MessageLimit(1.0)
    assert [limit(now, 0) for now in (10.0, 10.5, 11.0, 11.1, 12.2)] == [True, False, False, True, True]


def test_limit_of_bytes() -> None:
    limit = ByteLimit(100, 1.0)
    assert [limit(now, 60) for now in (0.0, 0.1, 0.2, 1.05, 1.2)] == [True, True, False, True, True]


@pytest.mark.parametrize(
    ("dropped", "of", "passed"), [(1, 3, "-12-45-"), (0, 1, "0123456"), (2, 2, "-------"), (1, 2, "-1-3-5-")]
)
def test_drop_leaves_out_the_first_of_each(dropped: int, of: int, passed: str) -> None:
    passes = every(dropped, of)
    assert "".join(str(number) if passes(0.0, 0) else "-" for number in range(7)) == passed


def test_base_names() -> None:
    assert [base_name(topic) for topic in ("a", "/a/b", "/a/b/", "~c")] == ["a", "b", "b", "c"]
    with pytest.raises(ValueError, match="not the name of a topic"):
        base_name("/")


def test_lazy_transport_subscribes_with_its_subscribers(master: str) -> None:
    done = subprocess.run(
        [sys.executable, str(HERE / "lazy.py")], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout.split() == ["subscribed", "word", "unsubscribed"] * 2, done.stderr
    assert done.returncode == 0, done.stderr


def test_lazy_transport_subscribes_when_it_is_not_lazy(master: str) -> None:
    done = subprocess.run(
        [sys.executable, str(HERE / "lazy.py"), "_lazy:=false"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout.split() == ["subscribed", "word", "word"], done.stderr
    assert done.returncode == 0, done.stderr
