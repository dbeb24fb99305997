"""catkin_make: plans, build order, generated modules, relays, and one-line errors."""

from __future__ import annotations

import os
import shlex
import socket
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from minirospy.base.errors import BuildError, DefinitionError, ManifestError, SourceError
from minirospy.core.idl import load
from minirospy.core.idl.load import read_definition
from minirospy.ros.catkin.commands.make import catkin_make, catkin_make_isolated
from minirospy.ros.catkin.commands.tool import catkin
from minirospy.workspace.build import Report, Workspace, build, find_workspace, read_plans
from minirospy.workspace.packages import Packages, built_in_roots

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import Scene


def python(scene: Scene, code: str) -> str:
    """Return the output of a program that uses the workspace."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(scene.modules)},
        capture_output=True,
        text=True,
        check=False,
        cwd=scene.root,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# --- what is made


def test_messages_services_and_actions(scene: Scene) -> None:
    scene.messages(
        "led_msgs",
        {
            "msg/Led.msg": "int64 number\nstring status\nPlace place\n",
            "msg/Place.msg": "geometry_msgs/Point point\n",
            "srv/Zone.srv": "int16 zone\n---\nbool success\n",
            "action/Run.action": "int16 runs\n---\nint16 last\n---\nint16 now\n",
        },
        "std_msgs geometry_msgs actionlib_msgs",
    )
    report = scene.build()["led_msgs"]
    assert (report.made, report.changed, report.warnings) == ("2 messages, 1 service, 1 action", True, ())

    said = python(
        scene,
        "from led_msgs.msg import *; from led_msgs.srv import Zone, ZoneResponse; import led_msgs\n"
        "print(Led(number=3).place.point.x, RunAction().action_goal.goal.runs, ZoneResponse(True).success)\n"
        "print(led_msgs.__file__)",
    )
    assert said.splitlines() == ["0.0 0 True", str(scene.modules / "led_msgs" / "__init__.py")]


def test_workspace_package_overrides_a_built_in_package(scene: Scene) -> None:
    scene.messages("rpi_msgs", {"msg/mine.msg": "int8 x\n"})
    scene.build()
    assert python(scene, "import rpi_msgs.msg; print(dir(rpi_msgs.msg))") == "['mine']\n"


def test_packages_use_messages_of_each_other(scene: Scene) -> None:
    scene.messages("a_user", {"msg/User.msg": "z_base/Base base\n"}, "z_base")
    scene.messages("z_base", {"msg/Base.msg": "std_msgs/Header header\n"})
    assert list(scene.build()) == ["z_base", "a_user"]
    assert python(scene, "from a_user.msg import User; print(User().base.header.seq)") == "0\n"


def test_a_second_build_makes_nothing(scene: Scene) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.build()
    before = {path: path.stat().st_mtime_ns for path in scene.devel.rglob("*")}
    report = scene.build()["led_msgs"]
    assert (report.made, report.changed) == ("", False)
    assert {path: path.stat().st_mtime_ns for path in scene.devel.rglob("*")} == before


def test_a_change_is_seen_also_in_packages_that_use_it(scene: Scene) -> None:
    base = scene.messages("base", {"msg/Base.msg": "int8 x\n"})
    scene.messages("user", {"msg/User.msg": "base/Base base\n"}, "base")
    scene.build()
    first = python(scene, "from user.msg import User; print(User._md5sum)")
    (base / "msg" / "Base.msg").write_text("int16 x\n")
    assert scene.build()["user"].changed
    assert python(scene, "from user.msg import User; print(User._md5sum)") != first


def test_a_change_in_the_workspace_below_is_seen(scene: Scene) -> None:
    below = type(scene)(scene.root / "below")
    folder = below.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    far = below.messages("far_msgs", {"msg/Far.msg": "led_msgs/Led led\n"}, "led_msgs")
    scene.messages("room_msgs", {"msg/Room.msg": "far_msgs/Far far\n"}, "far_msgs")
    workspace = Workspace.at(scene.root)

    def made() -> str:
        outside = Packages.below(below.source, *built_in_roots())
        found: list[Report] = []
        build(workspace, read_plans(workspace.source), outside, None, found.append)
        return found[0].made

    assert made() == "1 message"
    assert made() == ""
    (folder / "msg" / "Led.msg").write_text("int64 number\nstring name\n")
    assert made() == "1 message"
    assert made() == ""
    far.rename(below.source / "moved")
    assert made() == "1 message"


def test_outputs_of_deleted_sources_are_removed(scene: Scene) -> None:
    folder = scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n", "msg/Old.msg": "int8 x\n"})
    scene.messages("old_msgs", {"msg/A.msg": "int8 x\n"})
    scene.build()
    file = folder / "CMakeLists.txt"
    file.write_text(file.read_text().replace(" Old.msg", ""))
    (folder / "msg" / "Old.msg").unlink()
    for path in sorted((scene.source / "old_msgs").rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    scene.build()
    assert sorted(path.name for path in (scene.modules / "led_msgs" / "msg").glob("*.py")) == [
        "_Led.py",
        "__init__.py",
    ]
    assert not (scene.modules / "old_msgs").exists()


def test_a_deleted_module_is_made_again(scene: Scene) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.build()
    (scene.modules / "led_msgs" / "msg" / "_Led.py").unlink()
    assert scene.build()["led_msgs"].made == "1 message"


def test_a_folder_without_file_names_is_taken_whole(scene: Scene) -> None:
    cmake = "add_message_files(DIRECTORY more/msg)\ngenerate_messages()"
    scene.package("p", cmake, "", {"more/msg/A.msg": "int8 a\n", "more/msg/B.msg": "A a\n"})
    assert scene.build()["p"].made == "2 messages"


# --- Python packages

SETUP = """from distutils.core import setup
from catkin_pkg.python_setup import generate_distutils_setup
setup(**generate_distutils_setup({}))
"""


def test_a_package_of_python_is_imported_from_its_source(scene: Scene) -> None:
    folder = scene.package(
        "tools",
        "catkin_python_setup()",
        "",
        {
            "setup.py": SETUP.format("packages=['tools', 'tools.inner'], package_dir={'': 'src'}"),
            "src/tools/__init__.py": "VALUE = 3\n",
            "src/tools/inner/__init__.py": "from .. import VALUE\nDOUBLE = 2 * VALUE\n",
        },
    )
    assert scene.build()["tools"].made == "Python package tools"
    said = python(scene, "import tools.inner; print(tools.inner.DOUBLE, tools.__file__)")
    assert said == f"6 {folder / 'src' / 'tools' / '__init__.py'}\n"


def test_python_and_messages_in_one_package(scene: Scene) -> None:
    folder = scene.messages("both", {"msg/A.msg": "int8 a\n"})
    (folder / "setup.py").write_text(SETUP.format("packages=['both'], package_dir={'both': 'lib/both'}"))
    (folder / "lib" / "both").mkdir(parents=True)
    (folder / "lib" / "both" / "__init__.py").write_text("from both.msg import A\nfrom .more import MORE\n")
    (folder / "lib" / "both" / "more.py").write_text("MORE = 1\n")
    file = folder / "CMakeLists.txt"
    file.write_text(file.read_text().replace("add_message", "catkin_python_setup()\nadd_message"))
    assert scene.build()["both"].made == "1 message, Python package both"
    assert python(scene, "import both; print(both.A(a=2).a, both.MORE)") == "2 1\n"


def test_generated_modules_come_before_a_source_folder_of_their_name(scene: Scene) -> None:
    folder = scene.messages("both", {"msg/A.msg": "int8 a\n"})
    (folder / "setup.py").write_text(SETUP.format("packages=['both'], package_dir={'': 'src'}"))
    for name in ("both/__init__.py", "both/msg/__init__.py"):
        file = folder / "src" / name
        file.parent.mkdir(parents=True)
        file.touch()
    cmake = folder / "CMakeLists.txt"
    cmake.write_text(cmake.read_text().replace("add_message", "catkin_python_setup()\nadd_message"))
    scene.build()
    assert python(scene, "from both.msg import A; print(A(a=2).a)") == "2\n"


@pytest.mark.parametrize(
    "text",
    [
        "from setuptools import setup, find_packages\nsetup(packages=find_packages('src'), package_dir={'': 'src'})",
        "import setuptools\nsetuptools.setup(name='x', packages=['tools'], package_dir={'': 'src'})",
        "#!/usr/bin/env python\nfrom setuptools import setup\nfrom catkin_pkg import python_setup\n"
        "d = python_setup.generate_distutils_setup()\nd['packages'] = ['tools']\nd['package_dir'] = {'': 'src'}\nsetup(**d)",
        "from setuptools import Extension, setup\nfrom setuptools.command.install import install\nimport distutils.util\n"
        "class Mine(install):\n    pass\n"
        "setup(cmdclass={'install': Mine}, packages=('tools', ''), package_dir={'': 'src'}, scripts=None)",
        "import beside\nfrom setuptools import find_packages, setup\n"
        "if __name__ == '__main__':\n"
        "    setup(packages=find_packages(beside.WHERE, exclude=['test*']), package_dir={'': beside.WHERE})",
        "from setuptools import setup\nfrom catkin_pkg.python_setup import generate_distutils_setup\n"
        "d = generate_distutils_setup()\nsetup(packages=[d['name']], package_dir={'': 'src'}, version=d['version'])",
    ],
)
def test_the_ways_to_write_a_setup(scene: Scene, text: str) -> None:
    files = {
        "setup.py": text,
        "beside.py": "WHERE = 'src'\n",
        "src/tools/__init__.py": "VALUE = 3\n",
        "src/tests/__init__.py": "",
    }
    scene.package("tools", "catkin_python_setup()", "", files)
    before = sys.modules.copy()
    scene.build()

    assert python(scene, "import tools; print(tools.VALUE)") == "3\n"
    if "exclude" in text:
        assert not (scene.modules / "tests").exists()
    changed = {name for name, module in sys.modules.items() if before.get(name) is not module}

    assert not {name for name in changed if name.split(".", 1)[0] in ("beside", "setuptools", "distutils")}


def test_programs_are_in_devel(scene: Scene) -> None:
    """Scripts in setup.py are on PATH, as in catkin; real rosrun finds scripts installed as Python programs."""
    lines = (
        "#!/usr/bin/env python3\nimport helper, sys\nprint(__name__, __file__, helper.VALUE, sys.argv[1:])\n"
    )
    folder = scene.package(
        "tools",
        "catkin_python_setup()\ncatkin_install_python(PROGRAMS scripts/run.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})",
        "",
        {
            "setup.py": SETUP.format("packages=[], scripts=['scripts/lamp', 'scripts/lamp.sh']"),
            "scripts/lamp": lines,
            "scripts/run.py": lines,
            "scripts/lamp.sh": "#!/bin/sh\n",
            "scripts/helper.py": "VALUE = 3\n",
        },
    )
    scene.build()

    for place, name in ((scene.devel / "bin", "lamp"), (scene.devel / "lib" / "tools", "run.py")):
        assert [path.name for path in place.iterdir()] == [name]
        said = subprocess.run([place / name, "a"], capture_output=True, text=True, check=True).stdout
        assert said == f"__main__ {folder / 'scripts' / name} 3 ['a']\n"

    (folder / "CMakeLists.txt").write_text("project(tools)")
    scene.build()
    assert not (scene.devel / "bin").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="no such file names")
def test_name_of_a_file_is_never_code(scene: Scene, tmp_path: Path) -> None:
    evil = 'x\n"""\nopen("OWNED", "w")\n"""'
    scene = type(scene)(tmp_path / evil)
    files = {
        "setup.py": SETUP.format(
            "packages=['tools'], py_modules=['one'], scripts=['lamp'], package_dir={'': 'src'}"
        )
    }
    files |= {
        "src/tools/__init__.py": "VALUE = 3\n",
        "src/one.py": "VALUE = 4\n",
        "lamp": "#!/usr/bin/env python3\n",
    }
    scene.package("tools", "catkin_python_setup()", "", files)
    scene.build()
    assert python(scene, "import tools, one; print(tools.VALUE, one.VALUE)") == "3 4\n"
    subprocess.run([scene.devel / "bin" / "lamp"], check=True, cwd=scene.root)
    assert not list(tmp_path.rglob("OWNED"))


def test_a_compiler_is_not_needed(scene: Scene) -> None:
    cmake = "add_executable(talker src/t.cpp)\nadd_library(${PROJECT_NAME}_lib src/l.cpp)\nadd_library(x INTERFACE)"
    scene.package("cpp", cmake, "roscpp")
    assert scene.build()["cpp"].plan.skipped == ("talker", "cpp_lib")


def test_minirospys_program_stands_in_for_a_compiled_one(scene: Scene) -> None:
    folder = scene.package(
        "joy",
        "include(CheckIncludeFiles)\ncheck_include_files(linux/joystick.h FOUND)\n"
        "if(FOUND)\nadd_executable(joy_node a.cpp)\nendif()",
    )
    scene.package(
        "tf2_ros",
        "add_executable(${PROJECT_NAME}_x a.cpp)\nadd_executable(unknown a.cpp)\n"
        "set_target_properties(${PROJECT_NAME}_x PROPERTIES OUTPUT_NAME static_transform_publisher)",
    )
    reports = scene.build()
    assert reports["joy"].stand_ins == "joy_node"
    assert reports["tf2_ros"].stand_ins == "static_transform_publisher"

    program = scene.devel / "lib" / "tf2_ros" / "static_transform_publisher"
    done = subprocess.run([sys.executable, program], capture_output=True, text=True, check=False)
    assert "Usage: static_transform_publisher x y z" in done.stdout
    assert catkin_make(["-C", str(scene.root), "install"]) == 0
    installed = scene.root / "install" / "lib" / "tf2_ros" / program.name
    assert installed.read_bytes() == program.read_bytes()
    assert os.access(installed, os.X_OK)

    file = folder / "CMakeLists.txt"
    file.write_text(file.read_text().replace("joy_node", "other_node"))
    assert scene.build()["joy"].stand_ins == ""
    assert not (scene.devel / "lib" / "joy" / "joy_node").exists()


def test_minirospys_module_stands_in_for_a_compiled_one(scene: Scene) -> None:
    setup = (
        "from distutils.core import setup\nfrom catkin_pkg.python_setup import generate_distutils_setup\n"
        "setup(**generate_distutils_setup(packages=['{}'], package_dir={{'': 'src'}}))"
    )
    scene.package(
        "tf2_py",
        "catkin_python_setup()\nadd_library(tf2_py a.cpp)\n"
        'set_target_properties(tf2_py PROPERTIES OUTPUT_NAME tf2 PREFIX "_" SUFFIX ".so")',
        files={"setup.py": setup.format("tf2_py"), "src/tf2_py/__init__.py": "from ._tf2 import *\n"},
    )
    scene.package(
        "cv_bridge",
        "catkin_python_setup()\nadd_library(${PROJECT_NAME}_boost a.cpp)",
        files={"setup.py": setup.format("cv_bridge"), "src/cv_bridge/__init__.py": "here = 1\n"},
    )
    reports = scene.build()
    assert reports["tf2_py"].stand_ins == "tf2_py._tf2"
    assert reports["cv_bridge"].stand_ins == "cv_bridge.boost.cv_bridge_boost"
    code = (
        "import cv_bridge, tf2_py\nfrom cv_bridge.boost.cv_bridge_boost import getCvType\n"
        "print(cv_bridge.here, getCvType('bgr8'), hasattr(tf2_py.BufferCore, 'lookup_transform_core'))"
    )
    assert python(scene, code) == "1 16 True\n"


# --- mistakes


def mistakes(scene: Scene) -> SourceError:
    with pytest.raises(SourceError) as caught:
        scene.build()
    assert "\n" not in str(caught.value)
    return caught.value


def good(cmake: str) -> str:
    return f"{cmake}\ngenerate_messages(DEPENDENCIES std_msgs)"


@pytest.mark.parametrize(
    ("cmake", "line", "text"),
    [
        (
            good("add_message_files(FILES Ledd.msg)"),
            3,
            "[Ledd.msg] does not exist in folder [msg]; did you mean Led.msg?",
        ),
        (good("add_service_files(FILES Led.srv)"), 3, "add_service_files: folder [srv] does not exist"),
        (good("add_message_files(FILES Led)"), 3, "[Led] does not end in .msg"),
        (
            "generate_messages(DEPENDENCIES std_msgs)\nadd_message_files(FILES Led.msg)",
            4,
            "must be called before generate_messages()",
        ),
        (
            "add_message_files(FILES Led.msg)\ngenerate_messages()\nadd_message_files(FILES Led.msg)",
            5,
            "must be called before",
        ),
        (
            "add_message_files(FILES Led.msg)\ngenerate_messages(DEPENDENCIES std_msg)",
            4,
            "did you mean std_msgs?",
        ),
        ("catkin_python_setup()", 3, "needs a setup.py"),
        ("catkin_install_python(PROGRAMS scripts/x.py DESTINATION lib)", 3, "[scripts/x.py] does not exist"),
        ("if(A", 3, "if( is not closed"),
        ("if(A)", 3, "if() without endif()"),
        ("if(A B)\nendif()", 3, "if(): AND or OR is expected instead of [B]"),
        ("add_subdirectory(nowhere)", 3, "add_subdirectory(nowhere): "),
        ("include(CMakeLists.txt)", 1, "includes or calls itself"),
        ("if(" + "(" * 3000 + "1" + ")" * 3000 + ")\nendif()", 1, "is nested too deeply"),
        ("# \0", 1, "is not UTF-8 text"),
        ("add_message_files(FILES my-led.msg)", 3, "[my-led.msg] is not the name of a type"),
        ("project(other)", 3, "project(other), but package.xml names the package [p]"),
        ("message(", 3, "message( is not closed"),
    ],
)
def test_mistakes_in_cmake(scene: Scene, cmake: str, line: int, text: str) -> None:
    folder = scene.package("p", cmake, "std_msgs", {"msg/Led.msg": "int8 x\n", "msg/my-led.msg": ""})
    error = mistakes(scene)
    assert isinstance(error, BuildError)
    assert (error.file, error.line) == (str(folder / "CMakeLists.txt"), line)
    assert text in error.text


@pytest.mark.parametrize(
    ("text", "line", "error"),
    [
        ("int8 x\nint8 x y\n", 2, "[x y] is not a legal field name"),
        ("int8\n", 1, "neither 'type name' nor"),
        ("int8 x\nint8 x\n", 2, "declared twice"),
        ("int8 A=300\n", 1, "[300] is not a value of type int8"),
        ("int8 x\n\ngeometry_msgs/Point p\n", 3, "generate_messages(DEPENDENCIES geometry_msgs)"),
        ("std_msgs/Boool b\n", 1, "message type [std_msgs/Boool] not found; did you mean std_msgs/Bool"),
        ("Ledd l\n", 1, "message type [p/Ledd] not found; did you mean p/Led?"),
        ("int46 l\n", 1, "message type [p/int46] not found: did you mean int64?"),
        ("double x\n", 1, "message type [p/double] not found: did you mean float64?"),
        ("int x\n", 1, "message type [p/int] not found: did you mean int32?"),
        ("Led l\n", 1, "contains itself"),
    ],
)
def test_mistakes_in_a_message(scene: Scene, text: str, line: int, error: str) -> None:
    folder = scene.messages("p", {"msg/Led.msg": text})
    found = mistakes(scene)
    assert error in found.text
    assert (found.file, found.line) == (str(folder / "msg" / "Led.msg"), line)


def test_mistakes_in_services_and_actions(scene: Scene) -> None:
    folder = scene.messages("p", {"srv/S.srv": "int8 x\n---\nint8 y\nint9 z\n"})
    assert str(mistakes(scene)).startswith(f"{folder / 'srv' / 'S.srv'}:4: ")
    scene.messages("q", {"action/A.action": "int8 x\n"}, "actionlib_msgs")
    (scene.source / "p" / "srv" / "S.srv").write_text("int8 x\n")
    error = mistakes(scene)
    assert isinstance(error, DefinitionError)
    assert "write goal --- result --- feedback" in error.text


def test_an_action_needs_actionlib_msgs(scene: Scene) -> None:
    scene.messages("p", {"action/A.action": "---\n---\n"})
    assert "DEPENDENCIES actionlib_msgs" in mistakes(scene).text


def test_two_packages_of_one_name(scene: Scene) -> None:
    scene.package("p")
    (scene.source / "more").mkdir()
    (scene.source / "p").rename(scene.source / "more" / "q")
    scene.package("p")
    assert "two packages are called [p]" in mistakes(scene).text
    (scene.source / "p" / "CATKIN_IGNORE").touch()
    assert [plan.name for plan in read_plans(scene.source)] == ["p"]


@pytest.mark.parametrize("name", ["my pkg", "../evil"])
def test_an_invalid_name_is_an_error(scene: Scene, name: str) -> None:
    folder = scene.package("p")
    (folder / "package.xml").write_text(f"<package>\n<name>{name}</name></package>")
    assert str(mistakes(scene)).startswith(f"{folder / 'package.xml'}:2: '{name}' is not a package name")


def test_messages_may_name_their_own_package_as_a_dependency(scene: Scene) -> None:
    scene.package(
        "p",
        "find_package(catkin REQUIRED COMPONENTS message_generation)\nadd_message_files(FILES A.msg B.msg)\n"
        "generate_messages(DEPENDENCIES std_msgs p)",
        "std_msgs message_generation",
        {"msg/A.msg": "std_msgs/Bool b", "msg/B.msg": "A a"},
    )
    assert [plan.message_depends for plan in read_plans(scene.source)] == [("std_msgs",)]
    scene.build()
    assert python(scene, "from p.msg import B; print(B().a.b.data)") == "False\n"


def test_an_empty_list_of_programs_is_installed(scene: Scene) -> None:
    """CMake and catkin accept the command, as for a pattern that matches no file."""
    scene.package(
        "p",
        "find_package(catkin REQUIRED)\nfile(GLOB found ${PROJECT_SOURCE_DIR}/scripts/*.py)\n"
        "catkin_install_python(PROGRAMS ${found} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
        "install(PROGRAMS ${found} DESTINATION lib)\ninstall(FILES DESTINATION lib)",
    )
    assert [each.sources for each in read_plans(scene.source)[0].installs] == [(), (), ()]
    scene.build()


def test_a_package_for_rosbuild_is_not_built(scene: Scene) -> None:
    scene.package("p")
    (scene.source / "old").mkdir()
    (scene.source / "old" / "manifest.xml").write_text("<package/>")
    assert [plan.name for plan in read_plans(scene.source)] == ["p"]


def test_a_link_that_leads_back(scene: Scene) -> None:
    scene.package("p")
    try:
        (scene.source / "again").symlink_to(scene.source)
        (scene.source / "p" / "here").symlink_to(scene.source / "p")
    except OSError:
        pytest.skip("this system makes no links")
    assert [plan.name for plan in read_plans(scene.source)] == ["p"]


def test_an_invalid_build_record_is_ignored(scene: Scene) -> None:
    scene.messages("p", {"msg/A.msg": "\ufeffint8 a\n"})
    scene.build()
    (scene.root / "build" / "minirospy" / "p.json").write_text('{"outputs": 3}')
    assert scene.build()["p"].made == "1 message"


def test_packages_in_a_circle(scene: Scene) -> None:
    scene.package("a", depends="b")
    scene.package("b", depends="c")
    scene.package("c", depends="a")
    assert mistakes(scene).text == "packages depend on each other in a circle: a -> b -> c -> a"


def test_mistakes_in_files_of_a_package(scene: Scene) -> None:
    folder = scene.package("p", "catkin_python_setup()", "", {"setup.py": "import nothing_of_this_name\n"})
    assert str(mistakes(scene)) == (
        f"{folder / 'setup.py'}:1: ModuleNotFoundError: No module named 'nothing_of_this_name'"
    )
    (folder / "setup.py").write_text(
        "from setuptools import setup\nsetup(py_modules=['q'], package_dir={'': 'src'})\n"
    )
    assert "[q] is named, but " in mistakes(scene).text
    (folder / "setup.py").write_text("x = (\n")
    assert mistakes(scene).line == 1

    for line, text in {
        "import sys; sys.exit('no numpy')": "setup() was not called: it ended with no numpy",
        "": "setup() was not called",
        "from setuptools import setup\nsetup(packages='q')": "packages is 'q': packages=['a', 'b'] is its form",
        "from setuptools import setup\nsetup(package_dir={''})": "package_dir is {''}: package_dir={'': 'src'} is its form",
    }.items():
        (folder / "setup.py").write_text(line)
        assert mistakes(scene).text == text

    (folder / "package.xml").write_text("<package>\n<name>p</nam></package>")
    error = mistakes(scene)
    assert isinstance(error, ManifestError)
    assert error.line == 2


@pytest.mark.parametrize(
    ("depends", "cmake", "text"),
    [
        (
            "",
            "find_package(catkin REQUIRED COMPONENTS std_msgs)\ncatkin_package(CATKIN_DEPENDS std_msgs)",
            "<depend>",
        ),
        ("", "catkin_package(CATKIN_DEPENDS message_runtime)", "<exec_depend>message_runtime</exec_depend>"),
    ],
)
def test_a_dependency_that_package_xml_lacks(scene: Scene, depends: str, cmake: str, text: str) -> None:
    """Exported dependencies must be declared, as in catkin."""
    folder = scene.package("p", cmake, depends)
    error = mistakes(scene)
    assert error.file == str(folder / "CMakeLists.txt")
    assert error.line == 3 + cmake.count("\n")
    assert "package.xml does not name it" in error.text
    assert text in error.text


def test_missing_package_with_a_similar_name_is_a_warning(scene: Scene) -> None:
    """The workspace's other packages and the rest of this one are built, as in catkin."""
    folder = scene.package("p", "find_package(catkin REQUIRED COMPONENTS\n std_msg)")
    scene.messages("q", {"msg/A.msg": "int8 a\n"})

    reports = scene.build()

    assert reports["q"].made == "1 message"
    assert reports["p"].warnings == (
        f"{folder / 'CMakeLists.txt'}:3: package [std_msg] is not installed; going on without it;"
        " did you mean std_msgs?",
    )


def test_missing_generate_messages_is_a_warning(scene: Scene) -> None:
    folder = scene.package(
        "p",
        "find_package(catkin REQUIRED COMPONENTS message_generation)\nadd_message_files(FILES Led.msg)",
        "std_msgs",
        {"msg/Led.msg": "int8 x\n"},
    )
    scene.messages("q", {"msg/A.msg": "int8 a\n"})

    reports = scene.build()

    assert reports["q"].made == "1 message"
    assert reports["p"].made == ""
    assert reports["p"].warnings == (
        f"{folder / 'CMakeLists.txt'}:4: generate_messages() is missing: messages, services and actions are added, "
        "but not generated",
    )


def test_name_against_the_conventions_is_a_warning(scene: Scene) -> None:
    scene.package("MyPkg", "")
    assert scene.build()["MyPkg"].warnings == (
        'Package name "MyPkg" does not follow the naming conventions. It should start with a lower case letter and '
        "only contain lower case letters, digits, underscores, and dashes.",
    )


def test_missing_folder_of_a_python_package_is_a_warning(scene: Scene) -> None:
    folder = scene.package(
        "tools",
        "catkin_python_setup()",
        "",
        {
            "setup.py": SETUP.format("packages=['tools', 'gone'], package_dir={'': 'src'}"),
            "src/tools/__init__.py": "VALUE = 3\n",
        },
    )

    report = scene.build()["tools"]

    assert report.made == "Python package tools"
    assert report.warnings == (
        f"{folder / 'setup.py'}: packages=[...] names [gone], but folder {folder / 'src' / 'gone'} does not exist",
    )


def test_setup_py_sees_the_variables_of_ros(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROS_DISTRO", "ROS_VERSION", "ROS_PYTHON_VERSION"):
        monkeypatch.delenv(name, raising=False)
    check = "import os\nassert (os.environ['ROS_VERSION'], os.environ['ROS_DISTRO']) == ('1', 'noetic')\n"
    scene.package("tools", "catkin_python_setup()", "", {"setup.py": check + SETUP.format("packages=[]")})

    assert scene.build()["tools"].warnings == ()
    assert "ROS_VERSION" not in os.environ


def test_warnings(scene: Scene) -> None:
    folder = scene.package(
        "p",
        "find_package(catkin REQUIRED COMPONENTS rospy genmsg some_vendor_driver)\nadd_message_files(FILES A.msg)\n"
        "generate_messages(DEPENDENCIES geometry_msgs)",
        "",
        {"msg/A.msg": "geometry_msgs/Point p\n", "srv/Left.srv": "---\n"},
    )
    assert scene.build()["p"].warnings == (
        f"{folder / 'CMakeLists.txt'}:3: package [some_vendor_driver] is not installed; going on without it",
        f"{folder / 'srv' / 'Left.srv'} is not built: no add_service_files() names it",
        f"{folder / 'package.xml'}: messages of [p] contain types of [geometry_msgs]: add <depend>geometry_msgs</depend>",
    )


def test_message_that_is_used_but_not_listed_is_found(scene: Scene) -> None:
    """Its own package and others find it, even if it uses another such message. ROS does the same, but generates no class."""
    first = (
        "find_package(catkin REQUIRED COMPONENTS rospy message_generation)\nadd_message_files(FILES A.msg)\n"
    )
    texts = {"A": "B[2] b # two\n", "B": "C c\nint8 D=1\n", "C": "int8 x\n", "D": "int8 D\n"}
    folder = scene.package(
        "p",
        f"{first}generate_messages()",
        "std_msgs",
        {f"msg/{name}.msg": text for name, text in texts.items()},
    )
    scene.messages("q", {"msg/A.msg": "p/D[] many\n"}, "p")
    warnings = scene.build()["p"].warnings
    assert warnings == tuple(
        f"{folder / 'msg' / name}.msg: no add_message_files() names it, but {user} has it: ROS would make no class of it"
        for name, user in (
            ("B", folder / "msg/A.msg"),
            ("C", folder / "msg/B.msg"),
            ("D", scene.source / "q/msg/A.msg"),
        )
    )
    said = python(scene, "import p.msg, q.msg; print(p.msg.A().b[1].c.x, q.msg.A([p.msg.D(3)]).many[0].D)")
    assert said == "0 3\n"

    # The message counts as a source of those that use it, so that a change to it is detected.
    assert not scene.build()["p"].changed
    (folder / "msg" / "C.msg").write_text("int8 y\n")
    assert scene.build()["p"].changed
    assert python(scene, "import p.msg; print(p.msg.A().b[1].c.y)") == "0\n"


def test_large_package_reads_each_definition_a_few_times(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Robot arm drivers have hundreds of services, so the number of steps must grow linearly with them, not quadratically."""
    files = {f"srv/S{number}.srv": "---\n" for number in range(30)}
    files |= {f"action/A{number}.action": "---\n---\n" for number in range(10)}
    scene.messages("arm", files, "std_msgs actionlib_msgs")
    reads: dict[str, int] = {}

    def counted(path: Path) -> str:
        reads[path.name] = reads.get(path.name, 0) + 1
        return read_definition(path)

    monkeypatch.setattr(load, "read_definition", counted)
    assert scene.build()["arm"].made == "30 services, 10 actions"
    assert {path.partition("/")[2] for path in files} <= reads.keys()
    assert max(reads.values()) <= 4


def test_package_xml_that_catkin_would_refuse_is_a_warning(scene: Scene) -> None:
    folder = scene.package("p")
    (folder / "package.xml").write_text(
        '<package format="2"><name>p</name>\n<run_depend>a</run_depend></package>'
    )
    warnings = scene.build()["p"].warnings
    assert f"{folder / 'package.xml'}:1: the package has no <maintainer>" in warnings
    assert any(
        text.startswith(f"{folder / 'package.xml'}:2: format 2 has no tag <run_depend>: ")
        for text in warnings
    )
    assert "package.xml must say <buildtool_depend>catkin</buildtool_depend>" in warnings[-1]


@pytest.mark.parametrize(
    ("cmake", "line", "text"),
    [
        ("{find}\ncatkin_package()\n{add}\ngenerate_messages()", 6, "generate_messages() must be called before catkin_package()"),
        ("{find}\n{add}\ngenerate_messages()\ncatkin_python_setup()", 6, "catkin_python_setup() must be called before"),
        ("{find}\n{add}\ngenerate_messages()\ngenerate_messages()", 6, "generate_messages() must be called once"),
        ("{find}\nadd_message_files(A.msg)\ngenerate_messages()", 4, "FILES must come before A.msg"),
        ("{add}\ngenerate_messages()", 3, "COMPONENTS message_generation) must be called before it"),
    ],
)  # fmt: skip
def test_cmake_lists_that_catkin_would_refuse_is_a_warning(
    scene: Scene, cmake: str, line: int, text: str
) -> None:
    """The package builds here, but its author is warned before a robot with real ROS rejects it."""
    parts = {
        "find": "find_package(catkin REQUIRED COMPONENTS message_generation)",
        "add": "add_message_files(FILES A.msg)",
    }
    files = {
        "msg/A.msg": "int8 a\n",
        "setup.py": SETUP.format("packages=['p'], package_dir={'': 'src'}"),
        "src/p/__init__.py": "",
    }
    folder = scene.package("p", cmake.format(**parts), "", files)
    (warning,) = scene.build()["p"].warnings

    assert warning.startswith(f"{folder / 'CMakeLists.txt'}:{line}: real catkin refuses this: ")
    assert text in warning
    assert python(scene, "import p.msg; print(p.msg.A(a=1).a)") == "1\n"


def test_a_package_of_another_build_is_left_out(scene: Scene) -> None:
    """A ROS 2 package in the same repository has no CMakeLists.txt, or one for ament."""
    folder = scene.package("p", "ament_package(")
    file = folder / "package.xml"
    file.write_text(
        file.read_text().replace(
            "</package>", "<export><build_type>ament_cmake</build_type></export></package>"
        )
    )
    for _ in range(2):
        report = scene.build()["p"]
        assert report.warnings == (f"{file}:1: left out: it is built by [ament_cmake], not by catkin",)
        assert report.made == ""
        (folder / "CMakeLists.txt").unlink(missing_ok=True)


def test_package_without_cmake_lists_is_left_out(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    folder = scene.package("copied", "")
    (folder / "CMakeLists.txt").unlink()
    warning = (
        f"{folder / 'package.xml'}:1: package [copied] is left out: it has no CMakeLists.txt, of which `catkin_create_pkg` "
        "writes an example"
    )
    reports = scene.build()
    assert (reports["copied"].warnings, reports["copied"].made) == ((warning,), "")
    assert reports["led_msgs"].made == "1 message"
    assert python(scene, "import led_msgs.msg; print(led_msgs.msg.Led(number=1).number)") == "1\n"

    assert catkin_make(["-C", str(scene.root)]) == 0
    assert capsys.readouterr().err == f"WARNING: {warning}\n"


def test_nothing_to_generate_is_no_error(scene: Scene) -> None:
    """Like catkin, because some third-party packages still have such a line."""
    folder = scene.package("p", "find_package(catkin REQUIRED)\ngenerate_messages()")
    (warning,) = scene.build()["p"].warnings
    assert warning.startswith(f"{folder / 'CMakeLists.txt'}:4: generate_messages(): nothing to generate")


def test_an_empty_list_of_files_is_empty(scene: Scene) -> None:
    """FILES without a name adds no files; without FILES, the complete folder is used."""
    scene.package(
        "p",
        "add_message_files(DIRECTORY msg FILES A.msg)\nadd_service_files(DIRECTORY srv FILES ${NONE})\n"
        "generate_messages()",
        "",
        {"msg/A.msg": "int8 a\n", "srv/S.srv": "---\n"},
    )
    assert scene.build()["p"].made == "1 message"


# --- the command


def test_the_command(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.package("cpp", "add_executable(talker t.cpp)")
    assert catkin_make(["-C", str(scene.root), "-j4", "-DCMAKE_BUILD_TYPE=Release"]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[1:] == [
        f"Source space: {scene.source}",
        f"Build space: {scene.root / 'build'}",
        f"Devel space: {scene.devel}",
        f"Install space: {scene.root / 'install'}",
        f'Creating file "{scene.source / "CMakeLists.txt"}"',
        "[ 50%] cpp: nothing to generate",
        "       cpp: skipped, they need a C++ compiler: talker",
        "[100%] led_msgs: 1 message",
    ]
    assert said.err == ""
    assert find_workspace(scene.source / "cpp") == scene.root
    assert catkin_make(["-C", str(scene.root), "--pkg", "led_msgs"]) == 0
    assert "[100%] led_msgs: up to date" in capsys.readouterr().out

    for target in ("led_msgs_generate_messages", "led_msgs_generate_messages_py", "led_msgs"):
        assert catkin_make(["-C", str(scene.root), target, "VERBOSE=1", "-v"]) == 0
        assert capsys.readouterr().out.endswith("\n[100%] led_msgs: up to date\n")

    assert catkin_make(["-C", str(scene.root), "clean"]) == 0
    assert not scene.devel.exists()


def test_built_packages_are_usable_despite_a_faulty_one(
    scene: Scene, capsys: pytest.CaptureFixture[str]
) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.messages("much_later_msgs", {"msg/Bad.msg": "int65 number\n"})
    assert catkin_make(["-C", str(scene.root)]) == 1
    assert "Bad.msg:1" in capsys.readouterr().err
    assert (scene.devel / "setup.bash").is_file()
    assert python(scene, "from led_msgs.msg import Led; print(Led(number=3).number)") == "3\n"


def test_variables_of_cmake(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    """-DNAME=VALUE is visible in CMakeLists.txt; some names are reserved for catkin."""
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.package("p", 'option(LAMP "with a lamp" OFF)\nif(LAMP)\ncatkin_python_setup()\nendif()')
    words = ["-C", str(scene.root)]
    assert catkin_make([*words, "-DCATKIN_WHITELIST_PACKAGES=led_msgs"]) == 0
    assert "[100%] led_msgs: 1 message\n" in capsys.readouterr().out
    assert catkin_make([*words, "-DCATKIN_BLACKLIST_PACKAGES=p", "-DCATKIN_WHITELIST_PACKAGES="]) == 0
    assert "[100%] led_msgs: " in capsys.readouterr().out
    assert catkin_make([*words, "-DCATKIN_WHITELIST_PACKAGES=led_msg"]) == 1
    assert "package [led_msg] not found; did you mean led_msgs?" in capsys.readouterr().err
    assert catkin_make([*words, "--cmake-args", "-DLAMP:BOOL=ON"]) == 1
    assert "CMakeLists.txt:5: catkin_python_setup() needs a setup.py" in capsys.readouterr().err
    assert catkin_make([*words, "install", "-DCMAKE_INSTALL_PREFIX=there"]) == 0
    assert (scene.root / "there" / "share" / "led_msgs" / "package.xml").is_file()


def test_catkin_make_isolated(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    assert catkin_make_isolated(["-C", str(scene.root), "--install", "--merge", "-j2"]) == 0
    assert "[100%] led_msgs: 1 message\n" in capsys.readouterr().out
    assert {path.name for path in scene.root.iterdir()} == {
        *("src", "build_isolated", "devel_isolated", "install_isolated")
    }
    assert (scene.root / "install_isolated" / "share" / "led_msgs" / "msg" / "Led.msg").is_file()
    assert list(scene.source.iterdir()) == [scene.source / "led_msgs"]


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["-C", "nowhere"], 2, "folder nowhere does not exist"),
        (["--nonsense"], 2, "unrecognized arguments: --nonsense"),
        (["led_msg"], 1, "package [led_msg] not found; did you mean led_msgs?"),
        (["--source", "source"], 1, "The specified source space does not exist"),
    ],
)
def test_typed_wrong(
    scene: Scene,
    words: list[str],
    status: int,
    text: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(scene.root)
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    assert catkin_make(words) == status

    error = capsys.readouterr().err
    assert error.startswith("catkin_make: ERROR: ")
    assert text in error
    assert error.count("\n") == 1


def test_in_the_wrong_folder(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    """In src, in a subfolder of src, and in devel, the error names the right folder."""
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    assert catkin_make(["-C", str(scene.root)]) == 0
    for below in ("src", "src/led_msgs/msg", "devel"):
        assert catkin_make(["-C", str(scene.root / below)]) == 1
        assert f"`cd {shlex.quote(str(scene.root))}` first" in capsys.readouterr().err
    assert catkin_make(["-C", str(scene.root.parent)]) == 1
    assert "run catkin_make in the folder above src, or `mkdir src` first" in capsys.readouterr().err
    assert catkin_make(["-C", str(scene.root), "clena"]) == 1
    assert "did you mean clean?" in capsys.readouterr().err


def test_not_in_the_package(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    folder = scene.package("p")
    assert catkin_make(["-C", str(folder)]) == 1
    assert f"`cd {shlex.quote(str(scene.root))}` first" in capsys.readouterr().err


def test_ctrl_c_in_a_setup(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    """`catkin_make && roslaunch ...` stops; the next build completes the rest."""
    folder = scene.package("tools", "catkin_python_setup()", "", {"setup.py": "raise KeyboardInterrupt\n"})
    words = ["-C", str(scene.root)]
    for command in (catkin_make, catkin_make_isolated):
        assert command(words) == 130
    assert catkin(["build", "-w", str(scene.root)]) == 130
    assert capsys.readouterr().err == ""
    (folder / "setup.py").write_text(SETUP.format(""))
    assert catkin_make(words) == 0


def test_tests_are_run(scene: Scene, capfd: pytest.CaptureFixture[str]) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.package(
        "p",
        "if(CATKIN_ENABLE_TESTING)\ncatkin_add_nosetests(test)\nendif()",
        "",
        {"test/test_led.py": "from led_msgs.msg import Led\ndef test_led():\n    assert Led().number == 0\n"},
    )
    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 0
    assert "1 passed" in capfd.readouterr().out
    (scene.source / "p" / "test" / "test_led.py").write_text("def test_led():\n    assert False\n")
    assert catkin_make(["-C", str(scene.root), "run_tests_p"]) == 1
    assert "Summary: 1 tests, 0 errors, 1 failures, 0 skipped" in capfd.readouterr().out


def test_src_of_a_folder_above_is_no_workspace(scene: Scene) -> None:
    """~/src is not the workspace of ~/project; it is that of ~/src/project."""
    for name in ("project", "src/project"):
        (scene.root / name).mkdir()
    assert find_workspace(scene.root / "src" / "project") == find_workspace(scene.root) == scene.root
    with pytest.raises(BuildError, match="not in a workspace"):
        find_workspace(scene.root / "project")


def test_a_macro_of_a_package_does_not_replace_catkins(scene: Scene) -> None:
    """dynamic_reconfigure is such a package: its macro would run CMake's add_custom_command."""
    scene.package(
        "p",
        "include(cmake/own.cmake)\nfind_package(catkin REQUIRED COMPONENTS message_generation)\n"
        "add_message_files(FILES A.msg)\nall_of_them()",
        "message_generation",
        {
            "msg/A.msg": "int8 a\n",
            "cmake/own.cmake": "macro(generate_messages)\n add_custom_command(OUTPUT x COMMAND y)\nendmacro()\n"
            "macro(all_of_them)\n generate_messages()\nendmacro()\n",
        },
    )
    assert scene.build()["p"].made == "1 message"


def test_files_that_cmake_makes_are_not_installed(scene: Scene) -> None:
    scene.package(
        "p",
        "configure_file(a.in ${CATKIN_DEVEL_PREFIX}/a)\ninstall(FILES ${CATKIN_DEVEL_PREFIX}/a DESTINATION x)\n"
        "install(FILES $<TARGET_FILE:p> ${PROJECT_BINARY_DIR}/b DESTINATION x)",
    )
    assert catkin_make(["-C", str(scene.root), "install"]) == 0


def test_downloads(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    source = scene.root / "data.txt"
    source.write_text("some data")
    md5 = "1e50210a0202497fb79bc38b6ade6c34"
    url = source.as_uri()
    scene.package(
        "p",
        f"catkin_download(p_data {url} FILENAME a.txt MD5 {md5})\n"
        f"catkin_download_test_data(p_test {url} DESTINATION ${{CATKIN_DEVEL_PREFIX}}/share/p MD5 {md5})\n"
        f"catkin_download(p_none {url}.none)",
    )
    made, tested = scene.root / "build" / "p" / "a.txt", scene.devel / "share" / "p" / "data.txt"
    assert catkin_make(["-C", str(scene.root)]) == 0
    said = capsys.readouterr().out
    assert f"Downloading {url} to {made}... done.\n" in said
    assert f"Downloading {url}.none to {made.with_name('data.txt.none')}... failed (" in said
    assert made.read_text() == "some data"
    assert not tested.exists()

    made.write_text("changed")
    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 0
    assert (made.read_text(), tested.read_text()) == ("some data", "some data")

    capsys.readouterr()
    assert catkin_make(["-C", str(scene.root)]) == 0
    assert f"to {made}..." not in capsys.readouterr().out

    source.write_text("other data")
    made.unlink()
    assert catkin_make(["-C", str(scene.root)]) == 1
    assert f"{url} has another MD5 sum than {md5}" in capsys.readouterr().err


def test_download_that_is_required(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    folder = scene.package("p", f"catkin_download(p_data {scene.root.as_uri()}/none REQUIRED)")
    assert catkin_make(["-C", str(scene.root)]) == 1
    line = f"{folder / 'CMakeLists.txt'}:3: cannot download {scene.root.as_uri()}/none: "
    assert line in capsys.readouterr().err


@pytest.mark.parametrize(
    ("response", "reason"),
    [
        (b"HTTP/1.0 200 OK\r\nContent-Length: 1000\r\n\r\nsome data", "closed 991 bytes before the end"),
        (
            b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n64\r\nsome data",
            "incomplete (IncompleteRead",
        ),
        (b"\0\0\r\n\r\n", "the response is not HTTP"),
    ],
)
def test_download_that_ends_early(
    scene: Scene, capsys: pytest.CaptureFixture[str], response: bytes, reason: str
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def respond() -> None:
            peer, _ = server.accept()
            with peer:
                peer.recv(1 << 16)
                peer.sendall(response)

        thread = threading.Thread(target=respond)
        thread.start()
        url = f"http://127.0.0.1:{server.getsockname()[1]}/data.txt"
        scene.package("p", f"catkin_download(p_data {url})")
        assert catkin_make(["-C", str(scene.root)]) == 0
        thread.join()
    assert f"{reason}" in capsys.readouterr().out
    assert not list(scene.root.rglob("data.txt*"))


def test_service_without_a_response(scene: Scene) -> None:
    """The package is built, as in ROS; a warning points out the possible mistake."""
    folder = scene.messages("led_msgs", {"srv/Set.srv": "int8 number\n", "srv/Get.srv": "---\nint8 number\n"})
    report = scene.build()["led_msgs"]
    line = f"{folder / 'srv' / 'Set.srv'}:1: 0 lines of '---' instead of 1: write request --- response"
    assert (report.made, report.warnings) == ("2 services", (line,))
    said = python(scene, "from led_msgs.srv import Set, SetRequest; print(Set._md5sum, SetRequest(3).number)")
    assert said == "75a636fcea887bd212f6597f4ed40388 3\n"


def test_install(scene: Scene) -> None:
    folder = scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.package(
        "tested",
        "add_message_files(FILES T.msg NOINSTALL)\ngenerate_messages()\ninstall(FILES nowhere.yaml DESTINATION . OPTIONAL)",
        "",
        {"msg/T.msg": "int8 a\n"},
    )
    scene.package(
        "tools",
        "catkin_python_setup()\ncatkin_install_python(PROGRAMS scripts/run.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
        "install(DIRECTORY launch/ DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/launch\n"
        '  FILES_MATCHING PATTERN "*.launch" PATTERN "old" EXCLUDE REGEX "/b[0-9]" EXCLUDE)\n'
        "install(FILES a.yaml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION} RENAME b.yaml)",
        "",
        {
            "setup.py": SETUP.format("packages=['tools'], package_dir={'': 'src'}"),
            "src/tools/__init__.py": "VALUE = 3\n",
            "scripts/run.py": "#!/usr/bin/env python\n",
            "launch/x.launch": "<launch/>",
            "launch/x.txt": "",
            "launch/old/y.launch": "<launch/>",
            "launch/b1.launch": "<launch/>",
            "a.yaml": "{}",
        },
    )

    assert catkin_make(["-C", str(scene.root), "install"]) == 0
    installed = scene.root / "install"
    found = {path.relative_to(installed).as_posix() for path in installed.rglob("*") if path.is_file()}

    assert {name for name in found if "/" in name} == {
        "lib/python3/dist-packages/led_msgs/__init__.py",
        "lib/python3/dist-packages/led_msgs/msg/__init__.py",
        "lib/python3/dist-packages/led_msgs/msg/__init__.pyi",
        "lib/python3/dist-packages/led_msgs/msg/_Led.py",
        "lib/python3/dist-packages/led_msgs/py.typed",
        "lib/python3/dist-packages/tested/__init__.py",
        "lib/python3/dist-packages/tested/msg/__init__.py",
        "lib/python3/dist-packages/tested/msg/__init__.pyi",
        "lib/python3/dist-packages/tested/msg/_T.py",
        "lib/python3/dist-packages/tested/py.typed",
        "share/tested/package.xml",
        "lib/python3/dist-packages/tools/__init__.py",
        "lib/tools/run.py",
        "share/led_msgs/msg/Led.msg",
        "share/led_msgs/package.xml",
        "share/tools/b.yaml",
        "share/tools/launch/x.launch",
        "share/tools/package.xml",
    }
    for path in sorted(folder.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    scene.modules = installed / "lib" / "python3" / "dist-packages"

    assert (
        python(scene, "import tools, led_msgs.msg; print(tools.VALUE, led_msgs.msg.Led().number)") == "3 0\n"
    )


def test_missing_files_are_errors_of_install_only(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    """A package can be built even if its install rules list missing files, as in CMake."""
    folder = scene.package("p", "install(DIRECTORY lanch\n DESTINATION share)", "", {"launch/x.launch": ""})
    assert catkin_make(["-C", str(scene.root)]) == 0
    assert catkin_make(["-C", str(scene.root), "install"]) == 1
    error = f"{folder / 'CMakeLists.txt'}:3: install: [lanch] does not exist; did you mean launch?\n"
    assert capsys.readouterr().err == f"catkin_make: ERROR: {error}"
