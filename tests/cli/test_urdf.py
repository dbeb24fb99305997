"""check_urdf and urdf_to_graphviz: output and files, with and without graphviz."""

from __future__ import annotations

import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from minirospy.ros.urdf.commands import urdf

ARM = Path(__file__).parents[1] / "core" / "urdf" / "arm.urdf"
GRAPH = ARM.with_suffix(".gv").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_tree_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert urdf.check_urdf([str(ARM)]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[:3] == [
        "robot name is: two_link_arm",
        "---------- Successfully Parsed XML ---------------",
        "root Link: base_link has 1 child(ren)",
    ]
    assert err == ""


def test_fault_is_printed_with_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    Path("r.urdf").write_text('<robot name="r">\n<link name="a"/><link name="a"/></robot>', encoding="utf-8")
    assert urdf.check_urdf(["r.urdf"]) == 255
    assert capsys.readouterr().err.splitlines() == [
        "Error:   link 'a' is not unique.",
        "         at line 2 in r.urdf",
        "ERROR: Model Parsing the xml failed",
        "check_urdf: ERROR: r.urdf:2: link 'a' is not unique.",
    ]


def test_part_that_is_left_out_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    Path("r.urdf").write_text('<robot name="r"><link name="a"><visual/></link></robot>', encoding="utf-8")
    assert urdf.check_urdf(["r.urdf"]) == 0
    assert capsys.readouterr().err.splitlines()[0] == "Error:   Could not parse visual element for Link [a]"


@pytest.mark.parametrize(
    ("main", "words"),
    [
        (urdf.check_urdf, "Expect URDF xml file to parse"),
        (urdf.urdf_to_graphviz, "Usage: urdf_to_graphviz input.xml [OUTPUT]"),
    ],
)
def test_missing_file_is_one_line(main: type[int], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 255
    assert capsys.readouterr().err.startswith(words)
    assert main(["nothing.urdf"]) == 255
    assert "nothing.urdf: No such file or directory" in capsys.readouterr().err


def test_graph_is_drawn_without_graphviz(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert urdf.urdf_to_graphviz([str(ARM), "arm"]) == 0
    assert Path("arm.gv").read_text(encoding="utf-8") == GRAPH
    texts = [each.text for each in ElementTree.parse("arm.svg").iter("{http://www.w3.org/2000/svg}text")]
    assert {"base_link", " shoulder ", "rpy: 0.1 0.2 0.3"} <= set(texts)
    assert "Created file arm.svg" in capsys.readouterr().out


@pytest.mark.skipif(not shutil.which("dot"), reason="graphviz is not installed")
def test_old_name_draws_by_the_name_of_the_robot(capsys: pytest.CaptureFixture[str]) -> None:
    assert urdf.urdf_to_graphiz([str(ARM)]) == 0
    out, err = capsys.readouterr()
    assert out == "Created file two_link_arm.gv\nCreated file two_link_arm.pdf\n"
    assert err.startswith(
        "WARNING: The executable named 'urdf_to_graphiz' is deprecated. Use 'urdf_to_graphviz' instead.\n"
        "WARNING: OUTPUT not given. This type of usage is deprecated!Usage: urdf_to_graphviz"
    )
    assert Path("two_link_arm.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("name", ["../up", "/tmp/up", "a\\b", ".hidden", ""])
def test_name_of_a_robot_is_no_path(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("r.urdf").write_text(f'<robot name="{name}"><link name="a"/></robot>', encoding="utf-8")
    assert urdf.urdf_to_graphviz(["r.urdf"]) == 2
    assert "is not a file's name" in capsys.readouterr().err
    assert [path.name for path in Path().iterdir()] == ["r.urdf"]
