"""rospack: output and exit statuses; tests/interop/test_interop_rospack.py compares them with the real command's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from minirospy.ros.rospack.commands.rospack import main, rosstack
from tests.conftest import modules_loaded_by

DEPENDENCIES = {
    "a": "<depend>b</depend><depend>c</depend>",
    "b": "<depend>d</depend><depend>e</depend>",
    "c": "<depend>d</depend><test_depend>tested</test_depend><build_depend>boost</build_depend>",
    "d": "<depend>e</depend><exec_depend>missing</exec_depend>",
    "e": '<export><cpp cflags="-I${prefix}/include -DX" lflags="-L${prefix}/lib -le -Wl,x"/></export>',
    "tested": "",
    "plugged": '<depend>e</depend><export><e plugin="${prefix}/p.xml"/><e plugin="second.xml"/></export>',
    "circle1": "<depend>circle2</depend>",
    "circle2": "<depend>circle1</depend>",
    "self": "<depend>self</depend>",
}


def make_package(folder: Path, name: str, body: str) -> None:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f'<package format="2"><name>{name}</name>{body}</package>')


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, body in DEPENDENCIES.items():
        make_package(tmp_path / f"folder_of_{name}", name, body)
    make_package(tmp_path / "meta", "meta", "<exec_depend>a</exec_depend><export><metapackage/></export>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_find(command: Any, tree: Path) -> None:
    assert command("rospack", "find", "a") == (0, f"{tree}/folder_of_a\n", "")
    assert command("rospack", "find", "std_msgs").out.endswith("msgs/std_msgs\n")


def test_the_package_of_the_current_folder(command: Any, tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert command("rospack", "find") == (1, "", "[rospack] Error: no package given\n")
    (tree / "folder_of_a" / "src").mkdir()
    monkeypatch.chdir(tree / "folder_of_a" / "src")
    assert command("rospack", "find").out == f"{tree}/folder_of_a\n"
    assert command("rospack", "depends1").out == "b\nc\n"


def test_lists(command: Any, tree: Path) -> None:
    assert f"a {tree}/folder_of_a\n" in command("rospack", "list").out
    names = command("rospack", "list-names").out.split()
    assert names == sorted(names)
    assert {*DEPENDENCIES, "std_msgs"} <= set(names)
    assert "meta" not in names
    assert command("rospack", "list-duplicates").out == ""
    make_package(tree / "more" / "a", "a", "")
    assert command("rospack", "list-duplicates").out == f"a\n- {tree}/folder_of_a\n- {tree}/more/a\n"


@pytest.mark.parametrize(
    ("words", "out"),
    [
        ("depends a", "e\nd\nb\nc\n"),
        ("deps a", "e\nd\nb\nc\n"),
        ("depends1 a", "b\nc\n"),
        ("depends-indent a", "b\n  d\n    e\n  e\nc\n  d\n    e\n"),
        ("depends-why --target=e b", "Dependency chains from b to e:\n* b -> d -> e \n* b -> e \n"),
        ("depends-why --target a e", "Dependency chains from e to a:\n"),
        ("depends-on e", "a\nb\nc\nd\nplugged\n"),
        ("depends-on1 d", "b\nc\n"),
        ("depends-on1 self", ""),
        ("rosdep c", "name: boost\nname: d\nname: e\nname: missing\nname: tested\n"),
        ("rosdep0 c", "name: boost\nname: d\nname: tested\n"),
        ("vcs a", ""),
        ("depends-msgsrv a", "\n"),
        ("depends1 circle1", "circle2\n"),
    ],
)  # fmt: skip
def test_dependencies(command: Any, tree: Path, words: str, out: str) -> None:
    assert command("rospack", *words.split()) == (0, out, "")


@pytest.mark.parametrize(
    ("words", "out"),
    [
        ("depends-manifests b", "{tree}/folder_of_e/package.xml {tree}/folder_of_d/package.xml\n"),
        ("plugins --attrib=plugin e", "plugged {tree}/folder_of_plugged/p.xml\n"),
        ("plugins --attrib=plugin --top=a e", ""),
        ("plugins --attrib=plugin --top=plugged e", "plugged {tree}/folder_of_plugged/p.xml\n"),
        ("export --lang=cpp --attrib=cflags d", "-I{tree}/folder_of_e/include -DX\n"),
        ("export --lang=cpp --attrib=cflags --deps-only e", "\n"),
        ("cflags-only-I d", "{tree}/folder_of_e/include\n"),
        ("cflags-only-other d", "-DX\n"),
        ("libs-only-L d", "{tree}/folder_of_e/lib\n"),
        ("libs-only-l d", "e\n"),
        ("libs-only-other d", "-Wl,x\n"),
    ],
)
def test_exports(command: Any, tree: Path, words: str, out: str) -> None:
    assert command("rospack", *words.split()) == (0, out.format(tree=tree), "")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("find plugge", "package 'plugge' not found; did you mean plugged?"),
        ("depends plugge", "no such package plugge; did you mean plugged?"),
        ("find meta", "package 'meta' not found (a metapackage of that name is in {tree}/meta)"),
        ("depends circle1", "circular dependency: circle1 -> circle2 -> circle1"),
        ("depends self", "package 'self' depends on itself"),
        ("dependz a", "command dependz not implemented; did you mean depends or depends1?"),
        ("depends-why a", "no package or target given"),
        ("plugins e", "no package / attrib given"),
        ("export --lang=cpp e", "no package / lang / attrib given"),
        ("list a", "invalid option(s) given"),
        ("find --target=e a", "invalid option(s) given"),
        (
            "find --frobnicate a",
            "failed to parse command-line options: unrecognised option '--frobnicate' (`rospack -h` shows what there is)",
        ),
        (
            "find a b",
            "failed to parse command-line options: too many positional options have been specified on the command line",
        ),
    ],
)
def test_errors(command: Any, tree: Path, words: str, why: str) -> None:
    assert command("rospack", *words.split()) == (1, "", f"[rospack] Error: {why.format(tree=tree)}\n")
    assert command("rospack", "-q", *words.split()) == (1, "", "")


def test_an_option_that_is_nearly_one(capsys: pytest.CaptureFixture[str]) -> None:
    for tool, name in ((main, "rospack"), (rosstack, "rosstack")):
        assert tool(["plugins", "--atrib=x", "rospy"]) == 1
        assert capsys.readouterr().err == (
            f"[{name}] Error: failed to parse command-line options: unrecognised option '--atrib=x'; did you mean "
            f"--attrib? (`{name} -h` shows what there is)\n"
        )


def test_command_without_arguments_points_to_its_help(command: Any) -> None:
    assert command("rospack") == (0, "", "[rospack] Error: no command given.  Try 'rospack help'\n")
    for words in (["-h"], ["help"], ["--help"]):
        result = command("rospack", *words)
        assert result.status == 0
        assert result.out.startswith("USAGE: rospack <command> [options] [package]\n")
        assert "\n    find [package]\n" in result.out
    assert command("rospack", "help", "deps1").out.startswith("Usage: rospack depends1 [package]\n\n")
    assert command("rospack", "find", "-h").out.startswith("Usage: rospack find [package]\n\n")


def test_a_manifest_that_does_not_read_ends_only_what_needs_it(command: Any, tree: Path) -> None:
    (tree / "bad").mkdir()
    (tree / "bad" / "package.xml").write_text("<package><name>bad</name>\n<depend>")
    assert command("rospack", "find", "a").status == 0
    assert command("rospack", "depends", "a").status == 0
    assert command("rospack", "depends", "bad") == (
        1,
        "",
        f"[rospack] Error: {tree}/bad/package.xml:2: not XML: no element found\n",
    )
    result = command("rospack", "depends-on1", "d")
    assert (result.status, result.out) == (0, "b\nc\n")
    assert result.err == f"[rospack] Warning: {tree}/bad/package.xml:2: not XML: no element found\n"


def test_profile(command: Any, tree: Path) -> None:
    (tree / "empty" / "inner").mkdir(parents=True)
    lines = command("rospack", "profile", "--length=1").out.splitlines()
    assert lines[0].startswith("Full tree crawl took ")
    assert len(lines) == 7
    assert set(command("rospack", "profile", "--zombie-only").out.split()) >= {
        str(tree / "empty"),
        str(tree / "empty" / "inner"),
    }


def test_finding_imports_little(tree: Path) -> None:
    """`rospack find` is called in loops, so it imports only the modules that it needs."""
    code = "from minirospy.ros.rospack.commands.rospack import main; assert main(['find', 'a']) == 0"
    assert not {"asyncio", "pyexpat", "yaml", "numpy", "subprocess"} & modules_loaded_by(code)


def test_packages_for_rosbuild(command: Any, tree: Path) -> None:
    old = tree / "stack" / "old"
    (old / "below").mkdir(parents=True)
    (old / "below" / "manifest.xml").write_text("<package/>")
    (old / "manifest.xml").write_text(
        '<package><depend package="e"/><depend thirdparty="x"/><rosdep name="boost"/>'
        '<export><cpp cflags="-I${prefix}"/></export></package>'
    )
    assert command("rospack", "find", "old") == (0, f"{old}\n", "")
    assert command("rospack", "find", "below").status == 1
    assert command("rospack", "depends", "old") == (0, "e\n", "")
    assert command("rospack", "depends-manifests", "old").out == f"{tree}/folder_of_e/package.xml\n"
    assert "old" in command("rospack", "depends-on1", "e").out.split()
    assert command("rospack", "rosdep0", "old").out == "name: boost\n"
    assert command("rospack", "export", "--lang=cpp", "--attrib=cflags", "old").out.startswith(f"-I{old} ")
    assert f"old {old}\n" not in command("rosstack", "list").out
    assert command("rosversion", "old").out == "Cannot locate [old]\n"


def test_missing_dependency_of_a_package_for_rosbuild(command: Any, tree: Path) -> None:
    (tree / "old").mkdir()
    (tree / "old" / "manifest.xml").write_text(
        '<package><depend package="absent"/><depend package="e"/></package>'
    )
    text = (
        "[rospack] Error: package 'old' depends on non-existent package 'absent' and rosdep claims that it is not a "
        "system dependency. Check the ROS_PACKAGE_PATH or try calling 'rosdep update'\n"
    )
    for verb in ("depends", "depends1"):
        assert command("rospack", verb, "old") == (1, "e\n", text)
    assert "old" in command("rospack", "depends-on1", "e").out.split()
    assert command("rospack", "depends-on1", "e").status == 0
    (tree / "old" / "manifest.xml").write_text("<package><depend/></package>")
    done = command("rospack", "depends", "old")
    assert (done.status, done.out) == (1, "")
    assert done.err.endswith("manifest.xml:1: <depend> is missing the attribute 'package'\n")
