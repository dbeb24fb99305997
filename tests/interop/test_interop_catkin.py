"""One tree of packages, built by real catkin_make and by ours: the same modules, the same types, the same variables."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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

# As in ros_tutorials, common_tutorials and the workshop: messages, services, actions, Python, and all of them together.
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
    "beginner_tools": (
        ["beginner_tutorials"],
        "catkin_python_setup()",
        {"setup.py": SETUP, "src/beginner_tools/__init__.py": "from .more import VALUE\n",
         "src/beginner_tools/more.py": "from beginner_tutorials.msg import Num\nVALUE = Num(num=3).num\n"},
    ),
}  # fmt: skip

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
import beginner_tools
found["value"] = beginner_tools.VALUE
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
            file.write_text(text)


def run(command: list[str], folder: Path, path: str) -> str:
    environment = {"PATH": path, "HOME": str(folder), "LANG": "C.UTF-8"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The tree as real catkin_make built it, and as ours did."""
    if not Path("/usr/bin/catkin_make").exists():
        pytest.fail("real catkin_make is not installed: tests/interop/install_ros.sh")
    real, ours = (tmp_path_factory.mktemp(name) for name in ("real", "ours"))
    write_tree(real)
    run(["/usr/bin/catkin_make"], real, "/usr/bin:/bin")
    write_tree(ours)
    run([str(BIN / "catkin_make")], ours, f"{BIN}:/usr/bin:/bin")
    return real, ours


@pytest.mark.timeout(180)
def test_the_same_modules_and_types(trees: tuple[Path, Path]) -> None:
    names = json.dumps(list(PACKAGES))
    looks = []
    for root, python, path in zip(trees, (REAL, sys.executable), ("", f"{BIN}:"), strict=True):
        script = f". '{root}/devel/setup.sh'; exec {python} -c \"$0\" '{names}'"
        looks.append(json.loads(run(["sh", "-c", script, LOOK], root, f"{path}/usr/bin:/bin")))
    real, ours = looks
    assert ours == real
    assert ours["value"] == 3
    assert len(ours) > 30


@pytest.mark.timeout(180)
def test_real_python_reads_what_ours_generated(trees: tuple[Path, Path]) -> None:
    """Modules of ours need genpy alone: real ROS imports them too, and writes the same bytes."""
    code = (
        "from io import BytesIO; from beginner_tutorials.msg import Person, Num; b = BytesIO()\n"
        "Person(name='x', nums=[Num(1)]).serialize(b); print(b.getvalue().hex(), Person().deserialize(b.getvalue()).nums)"
    )
    said = [
        run(["sh", "-c", f". '{root}/devel/setup.sh'; exec {REAL} -c \"$0\"", code], root, "/usr/bin:/bin")
        for root in trees
    ]
    assert said[0] == said[1] != ""


@pytest.mark.timeout(180)
def test_the_same_variables(trees: tuple[Path, Path]) -> None:
    """Of ours, the folders of minirospy's own packages come last, where real ROS has /opt/ros or /usr."""
    script = ". '{}/devel/setup.bash'; echo $CMAKE_PREFIX_PATH; echo $PYTHONPATH; echo $ROS_PACKAGE_PATH"
    said = []
    for root, path in zip(trees, ("", f"{BIN}:"), strict=True):
        prefixes, modules, packages = run(
            ["bash", "-c", script.format(root)], root, f"{path}/usr/bin:/bin"
        ).splitlines()
        said.append([text.split(":")[0].replace(str(root), "") for text in (prefixes, modules, packages)])
    assert said[0] == said[1] == ["/devel", "/devel/lib/python3/dist-packages", "/src"]


def test_a_new_package_has_what_the_real_one_has(tmp_path: Path) -> None:
    """catkin_create_pkg: the same lines on the screen, the same files, a package.xml that says the same."""
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


@pytest.mark.timeout(180)
def test_real_catkin_make_builds_a_package_of_ours(tmp_path: Path) -> None:
    """The files of a new package are right for CMake also."""
    (tmp_path / "src").mkdir()
    run([str(BIN / "catkin_create_pkg"), "led", "rospy", "std_msgs"], tmp_path / "src", os.environ["PATH"])
    shutil.copytree(tmp_path / "src" / "led", tmp_path / "kept")
    run(["/usr/bin/catkin_make"], tmp_path, "/usr/bin:/bin")
    assert (tmp_path / "devel" / "share" / "led").is_dir()
