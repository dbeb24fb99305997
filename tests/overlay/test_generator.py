"""genpy.generator: modules that programs generate from definitions."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import genmsg.command_line
import genpy.generate_initpy
import genpy.generator
import genpy.genpy_main
import pytest

from minirospy.core.idl.own_packages import own_definitions


@pytest.fixture
def search_path(tmp_path: Path) -> dict[str, list[str]]:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "A.msg").write_text("Header header\nstd_msgs/Bool x\n")
    (tmp_path / "in" / "S.srv").write_text("A a\n---\nint8 b\n")
    std_msgs = own_definitions() / "std_msgs" / "msg"
    return genmsg.command_line.includepath_to_dict([f"made_here:{tmp_path / 'in'}", f"std_msgs:{std_msgs}"])


def test_generated_package_can_be_imported(tmp_path: Path, search_path: dict[str, list[str]]) -> None:
    package = tmp_path / "out" / "made_here"
    definitions = tmp_path / "in"
    for generator, file, kind in (
        (genpy.generator.MsgGenerator(), "A.msg", "msg"),
        (genpy.generator.SrvGenerator(), "S.srv", "srv"),
    ):
        folder = str(package / kind)
        assert generator.generate_messages("made_here", [str(definitions / file)], folder, search_path) == 0
        assert genpy.generate_initpy.write_modules(folder) == 0
    assert (package / "msg" / "__init__.py").read_text() == "from ._A import *\n"

    (package / "__init__.py").touch()
    program = "from made_here.msg import A; from made_here.srv import S, SRequest; print(A._md5sum, SRequest(A()).a.x)"
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=package.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    # The md5sum that real genmsg computes for the same texts.
    assert done.stdout == "7d6f54838e6b08a7ad004e13b48e4d3d data: False\n", done.stderr


def test_faulty_definition_is_one_line_and_the_others_are_written(
    tmp_path: Path, search_path: dict[str, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "in" / "B.msg"
    bad.write_text("int8 a b\n")
    files = [str(bad), str(tmp_path / "in" / "A.msg"), str(tmp_path / "in" / "C.txt")]
    assert (
        genpy.generator.MsgGenerator().generate_messages("made_here", files, str(tmp_path), search_path) == 1
    )
    assert (tmp_path / "_A.py").is_file()
    lines = [line for line in capsys.readouterr().err.splitlines() if line]
    assert [line.partition(": while")[0] for line in lines] == [
        "ERROR: Unable to generate messages for package 'made_here'"
    ] * 2
    assert lines[1].endswith("Processing file: 'C.txt' - unknown file extension")


def test_include_path_without_a_package_is_kept_apart() -> None:
    given = ["std_msgs:/a", "p:/b", "p:/c", "/d", "q:"]
    assert genmsg.command_line.includepath_to_dict(given) == {
        "std_msgs": ["/a"],
        "p": ["/b", "/c"],
        "": ["/d"],
    }


def test_command_line_generates(tmp_path: Path, search_path: dict[str, list[str]]) -> None:
    out = str(tmp_path / "out" / "msg")
    includes = [word for name, folders in search_path.items() for word in ("-I", f"{name}:{folders[0]}")]
    words = ["genmsg_py.py", "-p", "made_here", "-o", out, *includes, str(tmp_path / "in" / "A.msg")]
    generator = genpy.generator.MsgGenerator()
    with pytest.raises(SystemExit) as done:
        genpy.genpy_main.genmain(words, "genmsg_py.py", generator)
    assert done.value.code == 0
    assert Path(out, "_A.py").is_file()

    with pytest.raises(SystemExit) as done:
        genpy.genpy_main.genmain(["genmsg_py.py", "--initpy", "-o", out], "genmsg_py.py", generator)
    assert done.value.code == 0
    assert Path(out, "__init__.py").read_text() == "from ._A import *\n"


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["-p", "made_here", "-o", "out"], 2, "please specify args"),
        (["--initpy"], 2, "Missing args"),
        (["A.msg"], 2, "-p PACKAGE and -o FOLDER are needed"),
        (["-p", "made_here", "-o", "{file}", "-I", "made_here:.", "A.msg"], 3, "ERROR:"),
    ],
)
def test_command_line_refuses(
    words: list[str],
    status: int,
    text: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    words = ["genmsg_py.py", *(word.replace("{file}", "file") for word in words)]
    with pytest.raises(SystemExit) as done:
        genpy.genpy_main.genmain(words, "genmsg_py.py", genpy.generator.MsgGenerator())
    assert done.value.code == status
    assert text in capsys.readouterr().err
