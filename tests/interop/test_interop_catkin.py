"""One tree of packages, built by real catkin_make and by minirospy's, with equal modules, types and variables."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.workspace.cmake import parse_cmake
from minirospy.workspace.cmake_run import run_cmake

REAL = "/usr/bin/python3"
BIN = Path(sys.executable).parent

MANIFEST = """<package format="2">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>A package to compare builds with</description>
  <maintainer email="someone@example.org">someone</maintainer>
  <license>BSD</license>
  <buildtool_depend>catkin</buildtool_depend>
  {depends}
</package>
"""
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED COMPONENTS {components})
{macros}
catkin_package()
"""
SETUP = """from setuptools import setup
from catkin_pkg.python_setup import generate_distutils_setup
setup(**generate_distutils_setup(packages=['beginner_tools'], package_dir={'': 'src'}))
"""

WILD_SETUP = """import setuptools.command.install
from distutils.core import setup
from catkin_pkg.python_setup import generate_distutils_setup
setup(**generate_distutils_setup(packages=['wild', 'wild.deep'], package_dir={'': 'python'}, scripts=['bin/wild_tool']))
"""
# Unusual notations in CMakeLists.txt, found in third-party packages.
WILD = """catkin_python_setup()
FILE(GLOB found RELATIVE "${${PROJECT_NAME}_SOURCE_DIR}/msg" msg/*.msg) # all of them
list(REMOVE_ITEM found Left.msg)
foreach(each ${found})
  Add_Message_Files(FILES ${each})
endforeach(each)
add_service_files(DIRECTORY srv FILES ${NOBODY})
if(NOT WIN32 AND catkin_FOUND)
  add_service_files(DIRECTORY srv/inner FILES Inner.srv NOINSTALL)
elseif(1)
  add_message_files(FILES Absent.msg)
else()
  catkin_package(CATKIN_DEPENDS absent)
endif()
generate_messages(DEPENDENCIES std_msgs geometry_msgs)
macro(install_folders)
  foreach(folder ${ARGN})
    install(DIRECTORY ${folder}/ DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/${folder}
      PATTERN "*~" EXCLUDE REGEX "skip" EXCLUDE)
  endforeach()
endmacro()
install_folders(launch config)
option(WITH_MORE "more" OFF)
if(WITH_MORE OR "${PROJECT_NAME}" MATCHES "^w(.*)d$")
  install(FILES README.md RENAME READ DESTINATION share/${PROJECT_NAME})
endif()
if($ENV{ROS_VERSION} STREQUAL "2")
  install(FILES absent DESTINATION share)
endif()
install(PROGRAMS scripts/run scripts/listen.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
catkin_install_python(PROGRAMS scripts/talk.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
catkin_install_python(PROGRAMS scripts/talk.py DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
install(DIRECTORY data DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}
  FILES_MATCHING PATTERN "*.yaml" PATTERN "*.rviz")
include(cmake/more.cmake)
add_subdirectory(sub)
if(CATKIN_ENABLE_TESTING AND EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/test)
  find_package(rostest REQUIRED)
endif()
"""
TALK = "#!/usr/bin/env python3\nimport sys\nprint('talk', sys.argv[1:], __name__)\n"

# Packages like those in ros_tutorials, common_tutorials and the workshop: messages, services, actions, Python, and
# all of them together.
PACKAGES = {
    "beginner_tutorials": (
        ["std_msgs", "geometry_msgs"],
        "add_message_files(FILES Num.msg Person.msg)\nadd_service_files(FILES AddTwoInts.srv)\n"
        "generate_messages(DEPENDENCIES std_msgs geometry_msgs)",
        {
            "msg/Num.msg": "int64 num\n",
            "msg/Person.msg": "# who\nHeader header\nuint8 ROBOT=1\nstring NAME=a # b\nNum[] nums\n"
            "geometry_msgs/Pose[2] poses\nstring name",
            "srv/AddTwoInts.srv": "int64 a\nint64 b\n---\nint64 sum\n",
            "scripts/talker.py": "#!/usr/bin/env python3\n",
        },
    ),
    "learning_actionlib": (
        ["std_msgs", "actionlib_msgs", "geometry_msgs", "beginner_tutorials"],
        "add_action_files(DIRECTORY action FILES Fibonacci.action DoDishes.action)\n"
        "generate_messages(DEPENDENCIES std_msgs actionlib_msgs beginner_tutorials)",
        {
            "action/Fibonacci.action": "#goal\nint32 order\n---\n#result\nint32[] sequence\n---\nint32[] sequence\n",
            "action/DoDishes.action": "uint32 id\n---\nbeginner_tutorials/Num total\n---\nfloat32 percent",
        },
    ),
    "rpi_msgs": (
        ["std_msgs", "actionlib_msgs"],
        "add_message_files(FILES ledStatus.msg)\nadd_service_files(FILES safetyZone.srv)\n"
        "add_action_files(FILES runningLed.action)\ngenerate_messages(DEPENDENCIES std_msgs actionlib_msgs)",
        {
            "msg/ledStatus.msg": "int64 ledNumber\nstring ledStatus\n",
            "srv/safetyZone.srv": "int16 zone\n---\nbool success\nstring message\n",
            "action/runningLed.action": "int16 numberOfRuns\n---\nint16 finalRun\n---\nint16 currentRun\n",
        },
    ),
    "wild": (
        ["std_msgs", "geometry_msgs", "rospy"],
        WILD.replace("\n", "\r\n"),
        {
            "setup.py": WILD_SETUP,
            "python/wild/__init__.py": "from wild.msg import Kept\nK = Kept(s='k').s\n",
            "python/wild/deep/__init__.py": "from .. import K\n",
            "msg/Kept.msg": "\r\nstring NAME=\"quoted # all\" \r\nint8 MINUS=-3 # three\r\nstring s\r\nbyte b\r\nchar c",
            "msg/Of.msg": "Kept[3] kept\nwild/Kept one\nHeader header\ngeometry_msgs/Pose[] poses",
            "msg/Left.msg": "int8 x\n",
            "srv/Not.srv": "---\n",
            "srv/inner/Inner.srv": "Of of\n---\nint32 from\nint32 class\n",
            **dict.fromkeys(("launch/a.launch", "launch/in/b.launch", "launch/a.launch~", "launch/skip_me"), "<launch/>"),
            **dict.fromkeys(("config/c.yaml", "README.md", "data/d.yaml", "data/in/e.rviz", "data/f.txt"), ""),
            "scripts/run": "#!/bin/sh\n",
            "scripts/listen.py": TALK,
            "scripts/talk.py": TALK,
            "bin/wild_tool": TALK,
            "cmake/more.cmake": "install(FILES more.txt DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\nreturn()\nnothing()",
            "more.txt": "",
            "sub/CMakeLists.txt": "install(FILES sub.txt DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\n",
            "sub/sub.txt": "",
        },
    ),
    "half_listed": (
        ["std_msgs", "geometry_msgs", "wild"],
        "add_message_files(FILES Has.msg)\ngenerate_messages(DEPENDENCIES std_msgs wild)",
        {"msg/Has.msg": "Unlisted one\nwild/Left[] others\n", "msg/Unlisted.msg": "int8 x\n"},
    ),
    "beginner_tools": (
        ["beginner_tutorials"],
        "catkin_python_setup()",
        {"setup.py": SETUP, "src/beginner_tools/__init__.py": "from .more import VALUE\n",
         "src/beginner_tools/more.py": "from beginner_tutorials.msg import Num\nVALUE = Num(num=3).num\n"},
    ),
}  # fmt: skip

# Real catkin needs these for the md5sum of a message that contains them, but generates no classes for them; minirospy does.
UNLISTED = ("wild.msg.Left", "half_listed.msg.Unlisted")

LOOK = """
import importlib, json, sys
found = {}
for name in json.loads(sys.argv[1]):
    for kind in ("msg", "srv"):
        try:
            module = importlib.import_module(name + "." + kind)
        except ImportError:
            continue
        for each in dir(module):
            data_class = getattr(module, each)
            if hasattr(data_class, "_md5sum"):
                # Comments of the standard messages are ours.
                lines = getattr(data_class, "_full_text", "").split("\\n")
                text = ["".join(line.split("#")[0].split()) for line in lines if line.split("#")[0].strip()]
                found[name + "." + kind + "." + each] = [data_class._type, data_class._md5sum, text]
import beginner_tools, wild.deep
found["value"] = [beginner_tools.VALUE, wild.deep.K]
print(json.dumps(found))
"""


def write_tree(root: Path) -> None:
    for name, (depends, macros, files) in PACKAGES.items():
        folder = root / "src" / name
        tags = "".join(
            f"<depend>{each}</depend>" for each in (*depends, "message_generation", "message_runtime")
        )
        texts = {
            "package.xml": MANIFEST.format(name=name, depends=tags),
            "CMakeLists.txt": CMAKE.format(
                name=name, components=" ".join([*depends, "message_generation"]), macros=macros
            ),
            **files,
        }
        for path, text in texts.items():
            file = folder / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(text.encode())
            file.chmod(0o755 if text.startswith("#!") and path != "scripts/listen.py" else 0o644)


def run(command: list[str], folder: Path, path: str) -> str:
    environment = {
        "PATH": path,
        "HOME": str(folder),
        "LANG": "C.UTF-8",
        # Disable these generators, which genmsg runs when catkin makes messages, because only Python is compared.
        "ROS_LANG_DISABLE": "gencpp:genlisp",
        "ROS_VERSION": "1",
    }
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=500
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the tree built by real catkin_make, and the tree built by minirospy's."""
    if not Path("/usr/bin/catkin_make").exists():
        pytest.fail("real catkin_make is not installed: tests/interop/install_ros.sh")
    real, ours = (tmp_path_factory.mktemp(name) for name in ("real", "ours"))
    write_tree(real)
    run(["/usr/bin/catkin_make", "install"], real, "/usr/bin:/bin")
    write_tree(ours)
    run([str(BIN / "catkin_make"), "install"], ours, f"{BIN}:/usr/bin:/bin")
    return real, ours


@pytest.mark.timeout(1200)
def test_generated_modules_and_types_are_equal(trees: tuple[Path, Path]) -> None:
    names = json.dumps(list(PACKAGES))
    looks = []
    for root, python, path in zip(trees, (REAL, sys.executable), ("", f"{BIN}:"), strict=True):
        script = f". '{root}/devel/setup.sh'; exec {python} -c \"$0\" '{names}'"
        looks.append(json.loads(run(["sh", "-c", script, LOOK], root, f"{path}/usr/bin:/bin")))
    real, ours = looks
    assert all(ours.pop(name) for name in UNLISTED)
    assert ours == real
    assert "half_listed.msg.Has" in real
    assert ours["value"] == [3, "k"]
    assert len(ours) > 30


# Files for compilers, CMake and pip.
NOT_COMPARED = (
    "/cmake/",
    "pkgconfig",
    "egg-info",
    "__pycache__",
    "py.typed",
    "/share/common-lisp",
    "cmake.lock",
)


def files(folder: Path) -> dict[str, bool]:
    """Return the files in a folder that Python programs need, and whether they are executable."""
    return {
        path.relative_to(folder).as_posix(): os.access(path, os.X_OK)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and not any(each in str(path) for each in NOT_COMPARED)
        # Real catkin also keeps an action's messages as .msg files.
        and not re.search(r"(Action|Goal|Result|Feedback)\.msg$", path.name)
    }


@pytest.mark.timeout(1200)
def test_devel_files_are_equal(trees: tuple[Path, Path]) -> None:
    for place in ("install", "devel"):
        real, ours = (
            {name: bit for name, bit in files(root / place).items() if "/" in name} for root in trees
        )
        stubs = {name for name in ours if name.endswith("/__init__.pyi")}
        # minirospy also generates stubs for editors, which a test of messages covers.
        assert stubs
        modules = {"lib/python3/dist-packages/{}/{}/_{}.py".format(*name.split(".")) for name in UNLISTED}
        assert modules <= ours.keys()
        assert {name: bit for name, bit in ours.items() if name not in stubs | modules} == real, place
    assert real["bin/wild_tool"]


@pytest.mark.timeout(1200)
def test_programs_are_on_path_in_devel_and_install(trees: tuple[Path, Path]) -> None:
    """Compare the programs that setup.py and catkin_install_python put on PATH, in devel and installed."""
    for root, path in zip(trees, ("", f"{BIN}:"), strict=True):
        for place in ("devel", "install"):
            script = f". '{root}/{place}/setup.sh'; wild_tool a; talk.py b"
            said = run(["sh", "-c", script], root, f"{path}/usr/bin:/bin")
            assert said == "talk ['a'] __main__\ntalk ['b'] __main__\n"


@pytest.mark.timeout(1200)
def test_real_python_imports_our_generated_modules(trees: tuple[Path, Path]) -> None:
    """minirospy's modules need only genpy, so real ROS can import them, too, and serializes the same bytes."""
    code = (
        "from io import BytesIO; from beginner_tutorials.msg import Person, Num; b = BytesIO()\n"
        "Person(name='x', nums=[Num(1)]).serialize(b); print(b.getvalue().hex(), Person().deserialize(b.getvalue()).nums)"
    )
    said = [
        run(["sh", "-c", f". '{root}/devel/setup.sh'; exec {REAL} -c \"$0\"", code], root, "/usr/bin:/bin")
        for root in trees
    ]
    assert said[0] == said[1] != ""


@pytest.mark.timeout(1200)
def test_setup_variables_are_equal(trees: tuple[Path, Path]) -> None:
    """minirospy's own packages are last, in the place of /opt/ros or /usr in real ROS."""
    script = ". '{}/devel/setup.bash'; echo $CMAKE_PREFIX_PATH; echo $PYTHONPATH; echo $ROS_PACKAGE_PATH"
    said = []
    for root, path in zip(trees, ("", f"{BIN}:"), strict=True):
        prefixes, modules, packages = run(
            ["bash", "-c", script.format(root)], root, f"{path}/usr/bin:/bin"
        ).splitlines()
        said.append([text.split(":")[0].replace(str(root), "") for text in (prefixes, modules, packages)])
    assert said[0] == said[1] == ["/devel", "/devel/lib/python3/dist-packages", "/src"]


def test_create_pkg_writes_the_files_of_the_real_one(tmp_path: Path) -> None:
    """Compare catkin_create_pkg's output, its files, and the contents of package.xml."""
    trees = []

    for name, command in (("real", "/usr/bin/catkin_create_pkg"), ("ours", str(BIN / "catkin_create_pkg"))):
        folder = tmp_path / name
        folder.mkdir()
        environment = {
            "PATH": f"{BIN}:/usr/bin:/bin",
            "ROS_DISTRO": "noetic",
            "HOME": str(tmp_path),
            "USER": "someone",
        }
        done = subprocess.run(
            [command, "led", "rospy", "std_msgs", "-m", "Ada", "-l", "MIT", "-D", "all of it", "-V", "0.2.0"],
            cwd=folder, env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        code = (
            "import sys; from catkin_pkg.package import parse_package; p = parse_package(sys.argv[1])\n"
            "print(p.name, p.version, p.description, [str(m) for m in p.maintainers], p.licenses,"
            " sorted(map(str, p.build_depends + p.exec_depends + p.build_export_depends + p.buildtool_depends)))"
        )
        parsed = subprocess.run(
            [REAL, "-c", code, str(folder / "led")], capture_output=True, text=True, check=True
        ).stdout
        files = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))
        trees.append((done.stdout.replace(str(folder), ""), parsed, files))

    assert trees[0] == trees[1]


@pytest.mark.timeout(1200)
def test_real_catkin_make_builds_our_package(tmp_path: Path) -> None:
    """A new package's files are also valid for CMake."""
    (tmp_path / "src").mkdir()
    run([str(BIN / "catkin_create_pkg"), "led", "rospy", "std_msgs"], tmp_path / "src", os.environ["PATH"])
    shutil.copytree(tmp_path / "src" / "led", tmp_path / "kept")
    run(["/usr/bin/catkin_make"], tmp_path, "/usr/bin:/bin")
    assert (tmp_path / "devel" / "share" / "led").is_dir()


SCRIPT = r"""
cmake_minimum_required(VERSION 3.10)
set(A one two)
set(B "three;four" CACHE STRING "kept")
set(B five CACHE STRING "not again")
list(APPEND A ${B} "x y")
list(APPEND NEW n)
message("${A}|${B}|${NEW}|${NOBODY}|$ENV{MARK}|\${A}" [[${A}]] [=[ ]] ]=])
list(REMOVE_ITEM A two)
list(REVERSE A)
list(LENGTH A N)
message("${A} ${N}")
list(SORT A)
list(FILTER A EXCLUDE REGEX "^f")
list(PREPEND A a a)
list(REMOVE_DUPLICATES A)
message("${A}")
set(NAME A)
message("${${NAME}} ${NA${NOBODY}ME}")
string(TOUPPER "abC" U)
string(TOLOWER "abC" L)
string(REPLACE "." "_" R "a.b.c")
string(REGEX REPLACE "a(.)c" "<\\1>" X "abc adc")
string(CONCAT C a "b c" d)
string(APPEND C e)
message("${U} ${L} ${R} ${X} ${C}")
get_filename_component(F /some/where/file.tar.gz NAME)
get_filename_component(W /some/where/file.tar.gz NAME_WE)
get_filename_component(D /some/where/file.tar.gz DIRECTORY)
get_filename_component(E /some/where/file.tar.gz EXT)
message("${F} ${W} ${D} ${E}")
foreach(i RANGE 3)
  foreach(j IN LISTS A ITEMS z)
    if(j STREQUAL "three")
      continue()
    elseif(i EQUAL 2)
      break()
    endif()
    message("${i}${j}")
  endforeach(j)
endforeach()
foreach(i RANGE 2 9 3)
  message("r${i}")
endforeach()
foreach(i)
  message(never)
endforeach()
macro(Make one)
  message("${one} ${ARGN} ${ARGC} ${ARGV0} ${ARGV}")
endmacro()
make(a)
MAKE(a b "c d")
function(leave)
  message(in)
  return()
  message(never)
endfunction()
leave()
unset(C)
message("${C}.")
file(GLOB G RELATIVE "${CMAKE_CURRENT_LIST_DIR}" "${CMAKE_CURRENT_LIST_DIR}/msg/*.msg" "${CMAKE_CURRENT_LIST_DIR}/[bc]*")
file(GLOB_RECURSE H RELATIVE "${CMAKE_CURRENT_LIST_DIR}" "${CMAKE_CURRENT_LIST_DIR}/*.msg")
message("${G} ${H}")
include(${CMAKE_CURRENT_LIST_DIR}/more.cmake)
message("${MORE}")
"""
CONDITIONS = """
1|ON|yes|TRUE|Y|42|SET|"1"|0|off|NO|FALSE|N|IGNORE|NOTFOUND|""|NOBODY|OFFED|"SET"|X-NOTFOUND|NOT 1|NOT NOBODY
SET AND NOT NOBODY|NOBODY OR SET|NOBODY AND 1 OR 1|1 OR NOBODY AND 0|NOBODY AND (1 OR 1)|NOT (SET AND NOBODY)
DEFINED SET AND NOT DEFINED NOBODY|DEFINED ENV{MARK}|SET STREQUAL "text"|"SET" STREQUAL "text"|3 GREATER 2
2 LESS_EQUAL 2|x EQUAL 0|1.2.10 VERSION_GREATER 1.2.9|3 VERSION_EQUAL 3.0.0|1.10 VERSION_LESS 1.9|SET MATCHES "^te.t$"
a STRLESS b|b STRGREATER_EQUAL a|two IN_LIST LIST|three IN_LIST LIST|EXISTS ${CMAKE_CURRENT_LIST_DIR}/more.cmake
IS_DIRECTORY ${CMAKE_CURRENT_LIST_DIR}|EXISTS /nothing/there|IS_ABSOLUTE /a|IS_ABSOLUTE a|"" STREQUAL ""|"a;b" STREQUAL "a;b"
"${LIST}" STREQUAL "one;two"|POLICY CMP0048|COMMAND message|$ENV{MARK} STREQUAL "m"|-1 LESS 0|1.5 GREATER 1.25
"0"|"OFF"|-1|1.5|0.0|"2"|"text"|1x
""".replace("\n", "|").strip("|")  # fmt: skip


def test_cmake_conditions_are_equal(tmp_path: Path) -> None:
    """Compare with the results of `cmake -P`."""
    for name in ("msg/b.msg", "msg/a.msg", "msg/in/c.msg", "b.txt", "c.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "more.cmake").write_text("set(MORE 1)\nreturn()\nset(MORE 2)\n")
    lines = [SCRIPT, "set(SET text)", "set(OFFED off)", "set(LIST one two)"]

    for condition in CONDITIONS.split("|"):
        lines += [
            f"if({condition})",
            f"message([[yes {condition}]])",
            "else()",
            f"message([[no {condition}]])",
            "endif()",
        ]

    file = tmp_path / "CMakeLists.txt"
    file.write_text("\n".join(lines))
    done = subprocess.run(
        ["cmake", "-P", str(file)],
        env={"PATH": "/usr/bin:/bin", "MARK": "m"},
        capture_output=True,
        text=True,
        check=True,
    )
    variables = {"ENV{MARK}": "m", "CMAKE_CURRENT_LIST_DIR": tmp_path.as_posix()}
    said = ["".join(each.arguments) for each in run_cmake(file, variables) if each.name == "message"]
    assert said == done.stderr.splitlines()


def test_every_cmake_file_is_parsed() -> None:
    files = [path for path in Path("/usr/share").glob("cmake-*/Modules/*.cmake") if path.is_file()]
    assert len(files) > 200
    for path in files:
        assert parse_cmake(path.read_text(encoding="utf-8"), str(path)) is not None
