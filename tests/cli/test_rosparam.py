"""rosparam: output as in real ROS, and exit statuses."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import modules_loaded_by

from .conftest import own_lines

Start = Callable[[Sequence[str]], "subprocess.Popen[str]"]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("5", "5\n"),
        ("-1.5", "-1.5\n"),
        ("true", "true\n"),
        ("yes", "true\n"),
        ("hello", "hello\n"),
        ("hello world", "hello world\n"),
        ("'1'", "'1'\n\n"),
        ("", "''\n\n"),
        ("1e3", "1e3\n"),
        ("0x10", "16\n"),
        ("[1, 2.5, hello]", "- 1\n- 2.5\n- hello\n\n"),
        ("{x: 1, y: {z: two}}", "x: 1\ny:\n  z: two\n\n"),
        ("deg(90)", "1.5707963267948966\n"),
    ],
)
def test_set_and_get(master: str, command: Any, text: str, shown: str) -> None:
    assert command("rosparam", "set", "/a/b", text) == (0, "", "")
    assert command("rosparam", "get", "a/b") == (0, shown, "")


def test_verbose_and_pretty(master: str, command: Any) -> None:
    assert command("rosparam", "set", "-v", "/d", "{x: 1, y: {z: two}}").out == (
        "set parameter [/d/x] to [1]\nset parameter [/d/y/z] to [two]\n"
    )
    assert command("rosparam", "get", "-v", "/d/x").out == "getting parameter [/d/x]\n1\n"
    assert command("rosparam", "get", "-p", "/d").out == "x: 1\ny:\n  z: two\n"
    assert command("rosparam", "delete", "-v", "/d/x").out == "deleted parameter [/d/x]\n"
    assert command("rosparam", "get", "/d").out == "y:\n  z: two\n\n"


def test_a_dictionary_leaves_what_is_beside_it(master: str, command: Any) -> None:
    command("rosparam", "set", "/d", "{x: 1, y: 2}")
    command("rosparam", "set", "/d", "{y: 3, z: 4}")
    assert command("rosparam", "get", "/d").out == "x: 1\ny: 3\nz: 4\n\n"


def test_list(master: str, command: Any) -> None:
    command("rosparam", "set", "/d", "{x: 1, y: {z: two}}")
    assert command("rosparam", "list", "/d").out == "/d/x\n/d/y/z\n"
    assert command("rosparam", "list", "d").out == "/d/x\n/d/y/z\n"
    assert "/d/x\n" in command("rosparam", "list").out
    assert command("rosparam", "list", "/nope").out == "\n"


def test_files(master: str, command: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("in.yaml").write_text("a: 1\n---\n_ns: inner\nb: deg(180)\n")
    assert command("rosparam", "load", "-v", "in.yaml", "/ns").out == (
        "reading parameters from [in.yaml]\nreading parameters into namespace [/ns/inner]\n"
        "/ns/a=1\n/ns/inner/b=3.141592653589793\n"
    )
    assert command("rosparam", "dump", "-v", "out.yaml", "/ns").out == (
        "dumping namespace [/ns] to file [out.yaml]\n/ns/a=1\n/ns/inner/b=3.141592653589793\n"
    )
    assert Path("out.yaml").read_text() == "a: 1\ninner:\n  b: 3.141592653589793\n"
    assert command("rosparam", "dump", "-", "/ns").out == "a: 1\ninner:\n  b: 3.141592653589793\n"
    assert "ns:\n  a: 1\n" in command("rosparam", "dump").out

    monkeypatch.setattr(sys, "stdin", io.StringIO("x: 3\n"))
    assert command("rosparam", "load", "-v", "-", "/std").out == "reading parameters from stdin\n/std/x=3\n"
    Path("text").write_bytes(b"hello\n")
    command("rosparam", "set", "-t", "text", "/text")

    assert command("rosparam", "get", "/text").out == "'hello\n\n  '\n\n"
    command("rosparam", "set", "-b", "text", "/bytes")
    assert command("rosparam", "get", "/bytes").out == "!!binary |\n  aGVsbG8K\n\n"


@pytest.mark.parametrize(
    ("argv", "status", "why"),
    [
        (["get", "/nme"], 1, "parameter [/nme] not found; did you mean /name?"),
        (["delete", "/nme"], 1, "parameter [/nme] not found; did you mean /name?"),
        (["dump", "-", "/nme"], 1, "parameter [/nme] not found; did you mean /name?"),
        (["set", "/a", "a: [b"], 1, "'a: [b': "),
        (["set", "/a", "null"], 1, "null is not a value"),
        (["set", "/a", "99999999999"], 1, "32 bits"),
        (["set", "/a", "2020-01-01"], 1, "date"),
        (["set", "/", "1"], 1, "the root holds parameters"),
        (["set", "/a"], 2, "please specify a value"),
        (["set", "-t", "nope", "/a"], 2, "file [nope] not found"),
        (["load", "nope"], 1, "file [nope] not found"),
        (["load", "bad.yaml"], 1, "'bad.yaml': "),
        (["load", "five.yaml"], 1, "no names"),
        (["dump", "no/such/folder/f"], 1, "cannot be written"),
        (["get"], 2, "arguments are required"),
        (["list", "a", "b"], 2, "unrecognized arguments"),
    ],
)
def test_what_cannot_be(
    master: str,
    command: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    argv: list[str],
    status: int,
    why: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_text("a: [b\n")
    Path("five.yaml").write_text("5\n")
    command("rosparam", "set", "/name", "x")
    result = command("rosparam", *argv)

    assert (result.status, result.out) == (status, "")
    assert why in result.err
    assert len(own_lines(result.err)) == 1


def test_names_are_resolved_in_the_namespace(
    master: str, command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", "/room")
    command("rosparam", "set", "light", "on")
    proxy = MasterProxy(master, "/test")
    assert proxy.get_param("/room/light") is True
    proxy.close()


def test_help_and_no_master(command: Any) -> None:
    for verb in ("set", "get", "load", "dump", "delete", "list"):
        assert f"\trosparam {verb}\t" in command("rosparam", "-h").out
        assert command("rosparam", verb, "-h").status == 0
    for argv in (["list"], ["get", "/a"], ["set", "/a", "1"], ["delete", "/a"], ["dump"]):
        status, out, err = command("rosparam", *argv)
        assert (status, out) == (1, "")
        assert err == "ERROR: Unable to communicate with master!\n"


def test_get_of_a_simple_value_imports_no_yaml(master: str, command: Any) -> None:
    command("rosparam", "set", "/a", "hello")
    code = "from minirospy.ros.rosparam.commands.rosparam import main; assert main(['get', '/a']) == 0"
    assert not {"asyncio", "yaml", "numpy", "logging", "genpy", "xmlrpc"} & modules_loaded_by(code)


def test_the_program(master: str, program: Start) -> None:
    assert program(["rosparam", "set", "/a", "[1, 2]"]).communicate(timeout=30) == ("", "")
    assert program(["rosparam", "get", "/a"]).communicate(timeout=30) == ("- 1\n- 2\n\n", "")


def test_delete_of_everything(master: str, command: Any) -> None:
    assert command("rosparam", "set", "/a/b", "1").status == 0
    for _ in range(2):
        assert command("rosparam", "delete", "/") == (0, "", "")
        assert command("rosparam", "list").out == "\n"


@pytest.mark.parametrize(
    "text",
    ["1" + ":59" * 100_000, "1" + ":59" * 300 + ".5", "0x" + "f" * 5_000, "1" * 5_000, "2001-99-99"],
    ids=["base 60", "base 60 with decimals", "hexadecimal", "decimal", "no date"],
)
def test_number_that_takes_hours_is_refused_in_one_line(
    master: str, command: Any, tmp_path: Path, text: str
) -> None:
    (tmp_path / "a.yaml").write_text(f"a: {text}\n")
    done = command("rosparam", "load", str(tmp_path / "a.yaml"))
    assert done.status == 1
    (line,) = own_lines(done.err)
    assert line.startswith("rosparam: ERROR: ")
    assert len(line) < 400
