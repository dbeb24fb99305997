"""urdf_parser_py and kdl_parser_py as programs import them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import kdl_parser_py.urdf
import pytest
import urdf_parser_py.xml_reflection.core
from urdf_parser_py.urdf import URDF, Box, Link, Visual

from minirospy.base.errors import UrdfError
from minirospy.runtime.rpc.master_proxy import MasterProxy

URDFS = Path(__file__).parents[1] / "core" / "urdf"
ARM = (URDFS / "arm.urdf").read_text(encoding="utf-8")


def test_programs_print_the_same_as_with_the_real_module() -> None:
    case = [sys.executable, URDFS / "urdf_parser_py_case.py", URDFS / "arm.urdf"]
    printed = subprocess.run(case, capture_output=True, encoding="utf-8", check=True).stdout
    assert printed == (URDFS / "urdf_parser_py.txt").read_text(encoding="utf-8")


def test_programs_replace_what_is_done_about_unknown_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(urdf_parser_py.xml_reflection.core, "on_error", said.append)
    URDF.from_xml_string('<robot name="r"><foo/><material name="m"/></robot>')
    assert said == ["Material has neither a color nor texture.", "Unknown tag \"foo\" in /robot[@name='r']"]


def test_first_shape_is_replaced() -> None:
    link = Link("l", visual=Visual(Box([1, 1, 1])))
    link.visual = Visual(Box([2, 2, 2]))
    assert [shape.geometry.size for shape in link.visuals] == [[2, 2, 2]]
    assert link.to_xml_string().count("<box") == 1
    link.visual = None
    assert link.visual is None


def test_chain_that_does_not_exist_is_an_error() -> None:
    robot = URDF.from_xml_string(ARM)
    with pytest.raises(KeyError):
        robot.get_chain("tool", "base_link")


def test_description_comes_from_the_parameter_server(master: str) -> None:
    proxy = MasterProxy(master, "/test")
    proxy.set_param("/robot_description", ARM)
    proxy.close()
    code = (
        "from urdf_parser_py.urdf import URDF\nfrom kdl_parser_py.urdf import treeFromParam\n"
        "print(URDF.from_parameter_server().name, treeFromParam('/robot_description')[1].getNrOfJoints())"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "two_link_arm 4\n"


def test_tree_has_segments_joints_and_chains() -> None:
    is_good, tree = kdl_parser_py.urdf.treeFromString(ARM)
    assert is_good
    assert (tree.getNrOfSegments(), tree.getNrOfJoints()) == (5, 4)
    chain = tree.getChain("base_link", "tool")
    names = [chain.getSegment(number).getName() for number in range(chain.getNrOfSegments())]
    assert (names, chain.getNrOfJoints()) == (["upper_arm", "forearm", "tool"], 2)
    wrist = chain.getSegment(2).getJoint()
    assert (wrist.getName(), wrist.getTypeName()) == ("wrist", "None")
    assert chain.getSegment(1).pose(0.0).translation == (0.0, 0.0, 0.5)
    with pytest.raises(ValueError, match=r"link \[base_link\] is not below link \[tool\]"):
        tree.getChain("tool", "base_link")


def test_tree_comes_from_a_file_and_from_a_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert kdl_parser_py.urdf.treeFromFile(str(URDFS / "arm.urdf"))[1].getNrOfSegments() == 5
    text = '<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    model = URDF.from_xml_string(text + "</inertial></link></robot>")
    assert kdl_parser_py.urdf.treeFromUrdfModel(model, quiet=True)[1].getNrOfSegments() == 0
    assert capsys.readouterr().out == ""
    kdl_parser_py.urdf.treeFromUrdfModel(model)
    assert capsys.readouterr().out.startswith("The root link a has an inertia specified in the URDF")
    with pytest.raises(UrdfError):
        kdl_parser_py.urdf.treeFromString("<robot/>")
