"""dynamic_reconfigure's .cfg files in a workspace: the modules that catkin_make generates."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.base.errors import BuildError
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.parameter_generator_catkin import (
    ParameterGenerator,
)
from minirospy.workspace.build import Workspace
from minirospy.workspace.install import install
from minirospy.workspace.plan import read_plan
from tests.workspace.conftest import Scene

CMAKE = """find_package(catkin REQUIRED COMPONENTS rospy dynamic_reconfigure)
generate_dynamic_reconfigure_options(cfg/Lamp.cfg)"""
LAMP = """#!/usr/bin/env python
PACKAGE = "lamp"
from dynamic_reconfigure.parameter_generator_catkin import *

gen = ParameterGenerator()
gen.add("brightness", double_t, 1, "How bright", 0.5, 0, 1)
gen.add("mode", int_t, 2, "What it does", 0, 0, 1, edit_method=gen.enum([
    gen.const("Steady", int_t, 0, "on"), gen.const("Blink", int_t, 1, "on and off")], "modes"))
group = gen.add_group("Color Names", type="tab", state=False)
group.add("name", str_t, 4, "Which color", "red")
exit(gen.generate(PACKAGE, "lamp_node", "Lamp"))
"""
SETUP = "from setuptools import setup\nsetup(packages=['lamp'], package_dir={'': 'src'})\n"


def lamp(scene: Scene, cfg: str = LAMP, cmake: str = CMAKE) -> Path:
    return scene.package("lamp", cmake, "dynamic_reconfigure", {"cfg/Lamp.cfg": cfg})


def imported(scene: Scene, code: str) -> str:
    return subprocess.check_output(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(scene.modules)!r}); {code}"], text=True
    )


def test_module_of_a_cfg_file(scene: Scene) -> None:
    lamp(scene)
    report = scene.build()["lamp"]
    assert (report.made, report.warnings) == ("1 configuration", ())
    code = (
        "from lamp.cfg import LampConfig as c; "
        "print(c.defaults, c.min['mode'], c.max['brightness'], c.level['name'], c.type['name'], c.all_level, c.Lamp_Blink)"
    )
    assert imported(scene, code) == "{'brightness': 0.5, 'mode': 0, 'name': 'red'} 0 1.0 4 str 7 1\n"
    assert not (scene.devel / "include").exists()
    documents = scene.devel / "share" / "lamp" / "docs"
    assert sorted(path.name for path in documents.iterdir()) == [
        "LampConfig-usage.dox",
        "LampConfig.dox",
        "LampConfig.wikidoc",
    ]
    assert "Possible values are: Steady (0): on, Blink (1): on and off" in (
        documents / "LampConfig.wikidoc"
    ).read_text(encoding="utf-8")


def test_module_is_regenerated_if_only_the_cfg_file_changes(scene: Scene) -> None:
    folder = lamp(scene)
    scene.build()
    assert scene.build()["lamp"].changed is False
    (folder / "cfg" / "Lamp.cfg").write_text(LAMP.replace('"red"', '"green"'))
    assert scene.build()["lamp"].changed is True
    assert imported(scene, "from lamp.cfg import LampConfig as c; print(c.defaults['name'])") == "green\n"


def test_module_goes_with_its_cfg_file(scene: Scene) -> None:
    folder = lamp(scene)
    scene.build()
    (folder / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.0.2)\nproject(lamp)\ncatkin_package()\n"
    )
    scene.build()
    assert not (scene.modules / "lamp").exists()


def test_cfg_file_may_import_messages_and_modules_of_its_package(scene: Scene) -> None:
    cmake = """find_package(catkin REQUIRED COMPONENTS rospy message_generation dynamic_reconfigure)
add_message_files(FILES Limit.msg)
generate_messages()
catkin_python_setup()
generate_dynamic_reconfigure_options(cfg/Lamp.cfg)"""
    head = 'import roslib; roslib.load_manifest("lamp")\nfrom lamp.msg import Limit\nfrom lamp.colors import FIRST\n'
    files = {
        "msg/Limit.msg": "int32 MOST=7\n",
        "setup.py": SETUP,
        "src/lamp/__init__.py": "",
        "src/lamp/colors.py": "FIRST = 'blue'\n",
        "cfg/Lamp.cfg": head
        + LAMP.replace('"red"', "FIRST").replace("0, 0, 1, edit", "0, 0, Limit.MOST, edit"),
    }
    scene.package("lamp", cmake, "dynamic_reconfigure message_generation", files)
    scene.build()
    code = "from lamp.cfg import LampConfig as c; from lamp.colors import FIRST; print(c.defaults['name'], c.max['mode'], FIRST)"
    assert imported(scene, code) == "blue 7 blue\n"


def test_module_is_installed(scene: Scene) -> None:
    folder = lamp(scene)
    scene.build()
    workspace = Workspace.at(scene.root)
    install(workspace, read_plan(folder))
    assert (workspace.install / "lib/python3/dist-packages/lamp/cfg/LampConfig.py").is_file()


@pytest.mark.parametrize(
    ("change", "line", "text"),
    [
        (
            ("0.5, 0, 1)", "'half', 0, 1)"),
            6,
            "TypeError: 'brightness' has type double, but default is 'half'",
        ),
        (('"brightness"', '"bright ness"'), 6, "Exception: The name of field 'bright ness' does not follow"),
        (("str_t, 4", "text_t, 4"), 10, "NameError: name 'text_t' is not defined"),
        (
            ('"Which color", "red"', '"Which color", "red", "a", "z"'),
            10,
            "Exception: Max or min specified for name",
        ),
        (("exit(", "print 'done'; exit("), 11, "SyntaxError: "),
        (('"on"),', '"it\'s on"),'), 8, "Exception: quotes not allowed in description string `it's on`"),
        (("exit(", "raise SystemExit(3); exit("), 0, "ends with a fault"),
    ],
)
def test_cfg_file_with_a_fault(scene: Scene, change: tuple[str, str], line: int, text: str) -> None:
    folder = lamp(scene, LAMP.replace(*change))
    with pytest.raises(BuildError) as caught:
        scene.build()
    assert caught.value.file == str(folder / "cfg" / "Lamp.cfg")
    assert caught.value.line == line
    assert caught.value.text.startswith(text)


def test_cfg_file_that_does_not_exist(scene: Scene) -> None:
    lamp(scene, cmake=CMAKE.replace("Lamp.cfg", "Lump.cfg"))
    with pytest.raises(BuildError, match=r"\[cfg/Lump.cfg\] does not exist; did you mean .*Lamp.cfg"):
        scene.build()


def test_cfg_file_that_writes_another_name_is_a_warning(scene: Scene) -> None:
    folder = lamp(scene, LAMP.replace('"Lamp")', '"Light")'))
    (warning,) = scene.build()["lamp"].warnings
    assert warning.startswith(f"{folder / 'cfg' / 'Lamp.cfg'}: it has written no LampConfig")


def test_order_that_catkin_would_refuse_is_a_warning(scene: Scene) -> None:
    lamp(scene, cmake=f"catkin_package()\n{CMAKE}")
    (warning,) = scene.build()["lamp"].warnings
    assert "generate_dynamic_reconfigure_options() must be called before catkin_package()" in warning


def test_cfg_file_called_by_hand_says_how_it_is_called(scene: Scene) -> None:
    folder = lamp(scene)
    done = subprocess.run(
        [sys.executable, str(folder / "cfg" / "Lamp.cfg")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "generate_dynamic_reconfigure_options(cfg/NAME.cfg)" in done.stderr
    assert "Traceback" not in done.stderr


def test_generator_whose_subclass_does_not_call_init_has_a_group() -> None:
    class Described(ParameterGenerator):
        def __init__(self) -> None:
            self.group = self.Group(self, "Default", "", True, 0, 0)

    first, second = Described(), Described()
    first.add("brightness", "double", 1, "How bright", 0.5, 0, 1)
    first.add_group("Colors").add("name", "str", 4, "Which color", "red")
    description = first.group.to_dict()
    assert description["parentname"] == "Default"
    assert [each["name"] for each in first.group.get_parameters()] == ["brightness", "name"]
    assert second.group.get_parameters() == []
