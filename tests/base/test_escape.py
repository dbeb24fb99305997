"""Untrusted text is displayed without terminal control sequences or additional lines."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.escape import SafeTerminal, escaped, has_controls

CASES = [
    ("plain /name ä 名前 🤖", "plain /name ä 名前 🤖"),
    ("a\nb\tc\r", "a\\nb\\tc\\r"),
    ("\x1b[2J\x9b1m\x7f\0", "\\x1b[2J\\x9b1m\\x7f\\x00"),
    ("a\u202eb\u2066c\u2028d", "a\\u202eb\\u2066c\\u2028d"),
]


@pytest.mark.parametrize(("text", "shown"), CASES)
def test_control_characters_are_written_out(text: str, shown: str) -> None:
    assert escaped(text) == shown
    assert escaped(escaped(text)) == shown


def test_characters_to_keep_are_kept() -> None:
    assert escaped("a\nb\t\x1b", "\n\t") == "a\nb\t\\x1b"


@pytest.mark.parametrize("text", ["a\nb", "a\r", "\0", "\x1b", "\x85", "\x9b", "\u2028"])
def test_text_with_controls_is_not_a_name(text: str) -> None:
    assert has_controls(text)
    assert not has_controls("/ä/名前 b-c_🤖~")


@given(st.text())
def test_nothing_escaped_has_controls(text: str) -> None:
    assert not has_controls(escaped(text))
    assert escaped(text, "\n").count("\n") == text.count("\n")


def written(write: Callable[[SafeTerminal], object]) -> str:
    raw = io.BytesIO()
    below = io.TextIOWrapper(raw, "utf-8")
    terminal = SafeTerminal.around(below)
    write(terminal)
    terminal.flush()
    return raw.getvalue().decode()


def test_own_text_of_a_command_moves_the_cursor() -> None:
    assert written(lambda terminal: terminal.write_own("\r [RUNNING]\r")) == "\r [RUNNING]\r"
    assert written(lambda terminal: terminal.write("\r [RUNNING]\r")) == "\\r [RUNNING]\\r"


@pytest.mark.parametrize(
    "text",
    [
        "a line\n\twith a tab\n",
        "\033[31mred\033[0m and \033[1;91mbold\033[0m\n",
        "\033[2J\033[;Hcleared",
        "\r\033[Kagain",
        "\033]2;a title\007",
    ],
)
def test_terminal_receives_output_of_commands(text: str) -> None:
    assert written(lambda terminal: terminal.write(text)) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\033]0;title\007", "\\x1b]0;title\\x07"),
        ("\033[6n\033[5;5H\033[?25l", "\\x1b[6n\\x1b[5;5H\\x1b[?25l"),
        ("\033]52;c;ZWNobyBoaQ==\007", "\\x1b]52;c;ZWNobyBoaQ==\\x07"),
        ("a\rb\x08\x9b6n", "a\\rb\\x08\\x9b6n"),
        ("\033[31mred\033[21t\n", "\033[31mred\\x1b[21t\n"),
        ("\033P\033\\", "\\x1bP\\x1b\\"),
    ],
)
def test_terminal_ignores_foreign_escape_codes(text: str, shown: str) -> None:
    assert written(lambda terminal: terminal.write(text)) == shown


def test_terminal_leaves_the_stream_open_for_others() -> None:
    raw = io.BytesIO()
    below = io.TextIOWrapper(raw, "utf-8", write_through=True)
    terminal = SafeTerminal.around(below)
    terminal.write("a")
    terminal.close()
    terminal.close()
    del terminal
    below.write("b")
    assert raw.getvalue() == b"ab"


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of Unix")
def test_command_on_a_terminal_shows_escape_codes_of_a_peer() -> None:
    import subprocess

    master, slave = os.openpty()
    code = (
        "import sys\nfrom minirospy.command.command import run\nfrom minirospy.base.errors import NotFoundError\n"
        "def body():\n    print('/topic\\x1b[2J')\n    raise NotFoundError('topic', 'x\\x1b]0;t\\x07')\nsys.exit(run('t', body))"
    )
    status = subprocess.run([sys.executable, "-c", code], stdout=slave, stderr=slave, check=False).returncode
    os.close(slave)
    said = b""
    while b"\x07" not in said and b"not found" not in said:
        said += os.read(master, 4096)
    os.close(master)
    assert status == 1
    assert said == b"/topic\\x1b[2J\r\nt: ERROR: topic [x\\x1b]0;t\\x07] not found\r\n"


def test_error_of_a_command_is_escaped_in_a_file_too(capsys: pytest.CaptureFixture[str]) -> None:
    from minirospy.base.errors import NotFoundError
    from minirospy.command.command import run

    def body() -> None:
        raise NotFoundError("topic", "x\x1b[2J")

    assert run("t", body) == 1
    assert capsys.readouterr().err == "t: ERROR: topic [x\\x1b[2J] not found\n"


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of Unix")
def test_picture_on_a_terminal_moves_the_cursor() -> None:
    import subprocess

    master, slave = os.openpty()
    code = (
        "import sys\nfrom rich.console import Console\nfrom minirospy.command.command import run\n"
        "from minirospy.base.escape import own_output\n"
        "def body():\n    print('a', end='')\n    Console(file=own_output()).show_cursor(False)\n    print('b')\n"
        "sys.exit(run('t', body))"
    )
    environment = {**os.environ, "TERM": "xterm"}
    subprocess.run([sys.executable, "-c", code], stdout=slave, stderr=slave, env=environment, check=True)
    os.close(slave)
    shown = b""
    while b"\n" not in shown:
        shown += os.read(master, 4096)
    os.close(master)
    assert shown == b"a\x1b[?25lb\r\n"
