"""rospack and rospkg compared with the real ones, on one tree of packages."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

REAL_PYTHON = "/usr/bin/python3"
OUR_RUN = "import sys; from minirospy.ros.{module} import {function}; sys.exit({function}())"

TREE = {
    "a": "<depend>b</depend><depend>c</depend>",
    "b": "<depend>d</depend><depend>e</depend><depend>boost</depend>",
    "c": "<depend>d</depend><test_depend>t</test_depend><build_depend>boost</build_depend>",
    "d": "<depend>e</depend><exec_depend>boost</exec_depend>",
    "e": '<export><cpp cflags="-I${prefix}/include -DX" lflags="-le"/></export>',
    "t": "<doc_depend>e</doc_depend>",
    "kinds": "".join(
        f"<{tag}>{name}</{tag}>"
        for tag, name in [
            ("build_depend", "a"),
            ("build_export_depend", "b"),
            ("exec_depend", "c"),
            ("depend", "e"),
            ("test_depend", "t"),
            ("doc_depend", "d"),
        ]
    ),
    "lib": '<exec_depend>d</exec_depend><export><lib plugin="own.xml"/></export>',
    "plugin": '<depend>lib</depend><export><lib plugin="${prefix}/p.xml" other="o"/></export>',
    "above": '<depend>plugin</depend><export><lib plugin="above.xml"/></export>',
    "meta": (
        "<buildtool_depend>catkin</buildtool_depend><exec_depend>a</exec_depend><export><metapackage/></export>"
    ),
    "old": "<build_depend>a</build_depend><run_depend>b</run_depend><run_depend>e</run_depend>",
}

SAME = """
find a
find t
depends a
deps a
depends1 a
depends1 kinds
depends kinds
depends1 old
depends old
depends-indent a
depends-indent old
depends-manifests a
depends-why --target=e a
depends-why --target e a
depends-why --target=a e
depends-msgsrv a
vcs a
vcs0 a
rosdep0 c
rosdeps c
rosdep kinds
rosdep0 kinds
plugins --attrib=plugin lib
plugins --attrib=plugin --top=plugin lib
plugins --attrib=plugin --top=above lib
plugins --attrib=plugin --top=e lib
plugins --attrib=nope lib
plugins lib
export --lang=cpp --attrib=cflags e
export --lang=cpp --attrib=cflags b
export --lang=cpp --attrib=cflags --deps-only e
export --lang=cpp e
list-duplicates
list x
list-names x
find --target=e a
depends-why a
-q find nope
find -q nope
find
depends
""".strip().splitlines()

SORTED = ["depends-on a", "depends-on e", "depends-on1 e", "depends-on1 d", "depends-on lib"]

# ROS suggests no similar names, and prints less about input that it does not understand.
SAME_BEGINNING = """
find nope
find another_name
depends nope
depends1 nope
depends-on nope
depends-indent nope
depends-why --target=nope a
depends-why --target=a nope
plugins --attrib=plugin nope
find meta
depends meta
nope a
find a b
""".strip().splitlines()


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    tree = tmp_path / "tree"

    for name, body in TREE.items():
        folder = tree / ("another_name" if name == "t" else name)
        (folder / "src" / "deep").mkdir(parents=True)
        format_ = "" if name == "old" else ' format="2"'
        (folder / "package.xml").write_text(
            f"<package{format_}><name>{name}</name><version>1.2.3</version><description>It is {name}.</description>"
            '<maintainer email="a@example.org">Ann</maintainer><author>Bob</author>'
            f"<license>BSD</license><license>MIT</license><url>http://w</url>{body}</package>"
        )

    for marker in ("CATKIN_IGNORE", "rospack_nosubdirs"):
        ignored = tree / f"with_{marker}" / "ignored"
        ignored.mkdir(parents=True)
        (ignored / "package.xml").write_text("<package><name>ignored</name></package>")
        (ignored.parent / marker).touch()

    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tree))
    monkeypatch.chdir(tmp_path)
    return tree


def run(command: list[str], cwd: Path | None = None) -> tuple[int, str, str]:
    """Return (status, output, errors), without the real program's messages that rosdep is missing."""
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ, cwd=cwd, check=False)
    errors = [line for line in done.stderr.splitlines(keepends=True) if "rosdep2" not in line]
    return done.returncode, done.stdout, "".join(errors)


def real(line: str, cwd: Path | None = None, tool: str = "rospack") -> tuple[int, str, str]:
    return run([f"/usr/bin/{tool}", *line.split()], cwd)


def ours(line: str, cwd: Path | None = None, function: str = "main") -> tuple[int, str, str]:
    return run(
        [
            sys.executable,
            "-c",
            OUR_RUN.format(module="rospack.commands.rospack", function=function),
            *line.split(),
        ],
        cwd,
    )


def test_rospack_prints_equal_bytes_and_statuses(tree: Path) -> None:
    different = {line: (real(line), ours(line)) for line in SAME if real(line) != ours(line)}
    assert not different


def test_rospack_lines_are_equal_in_another_order(tree: Path) -> None:
    for line in SORTED:
        status, out, errors = real(line)
        assert ours(line) == (status, "".join(sorted(out.splitlines(keepends=True))), errors), line


def test_rospack_errors_are_equal_with_hints(tree: Path) -> None:
    for line in SAME_BEGINNING:
        status, out, errors = real(line)
        found = ours(line)
        assert found[:2] == (status, out), line
        assert found[2].startswith(errors.rstrip("\n")), line


def test_lists(tree: Path) -> None:
    """Compare all packages except those that belong to one of the stacks."""
    for line in ("list", "list-names"):
        of_tree = [each for each in real("list")[1].splitlines() if f" {tree}/" in each]
        expected = of_tree if line == "list" else [each.split()[0] for each in of_tree]
        assert [each for each in ours(line)[1].splitlines() if each in expected] == expected
        assert len(expected) == len(TREE) - 1
    assert "ignored" not in ours("list-names")[1]


def test_rosstack(tree: Path) -> None:
    """To rosstack, every package is a stack, and metapackages are packages."""
    for line in """
        find a
        find meta
        contents a
        contains a
        contains-path a
        depends meta
        depends1 meta
        depends-why --target=e meta
        depends-on1 a
        langs
        -q find nope
    """.strip().splitlines():
        assert ours(line, function="rosstack") == real(line, tool="rosstack"), line

    for line in ("find nope", "depends nope"):
        status, out, errors = real(line, tool="rosstack")
        found = ours(line, function="rosstack")
        assert found[:2] == (status, out)
        assert found[2].startswith(errors.rstrip("\n"))


def test_duplicates(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = tmp_path / "second" / "a"
    copy.mkdir(parents=True)
    (copy / "package.xml").write_text((tree / "a" / "package.xml").read_text())
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{copy.parent}:{tree}")
    for line in ("list-duplicates", "find a", "find b"):
        assert ours(line) == real(line)


def test_the_package_of_the_current_folder(tree: Path) -> None:
    deep = tree / "a" / "src" / "deep"
    for line in ("find", "depends", "depends1"):
        assert ours(line, deep) == real(line, deep)


ASK_ROSPKG = """
import json, os, rospkg
tree = os.environ["ROS_PACKAGE_PATH"]
pack, stack = rospkg.RosPack([tree]), rospkg.RosStack([tree])
found = {"list": sorted(pack.list()), "stacks": stack.list(), "stack": stack.get_path("meta")}
for name in sorted(pack.list()):
    manifest = pack.get_manifest(name)
    found[name] = [
        pack.get_path(name),
        pack.stack_of(name),
        sorted(pack.get_depends(name, implicit=False)),
        sorted(pack.get_depends(name)),
        sorted(pack.get_depends_on(name, implicit=False)),
        sorted(pack.get_depends_on(name)),
        sorted(pack.get_rosdeps(name, implicit=False)),
        sorted(pack.get_rosdeps(name)),
        [getattr(manifest, each) for each in
         ("author", "version", "license", "description", "url", "brief", "type", "is_catkin", "status", "notes")],
        sorted(each.name for each in manifest.depends),
        sorted(each.name for each in manifest.rosdeps),
        [(each.tag, dict(each.attrs), each.str) for each in manifest.exports],
        manifest.get_export("lib", "plugin"),
    ]
try:
    pack.get_path("nope")
except rospkg.ResourceNotFound as error:
    found["nope"] = [str(error), list(error.args)]
for name in ("OTHER", "ROS_HOME", "ROS_LOG_DIR", "ROS_TEST_RESULTS_DIR", "ROS_ETC_DIR", "ROS_ROOT"):
    env = {name: "/x"}
    found[name] = [
        getattr(rospkg, "get_" + each)(env)
        for each in ("ros_root", "ros_home", "log_dir", "test_results_dir", "etc_ros_dir")
    ]
found["on"] = [rospkg.on_ros_path(each) for each in (tree, tree + "/a", tree + "x")]
found["in"] = rospkg.get_package_name(tree + "/a/src/deep")
print(json.dumps(found))
"""

# Lookups in rosdep's database if it is installed; here they find that boost is not a package.
ROSDEP = """
def init_rospack_interface(): return {"view": 1}
def is_view_empty(view): return False
def is_system_dependency(view, name): return name == "boost"
def is_ros_package(view, name): return name != "boost"
"""


def test_rospkg(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rosdep = tmp_path / "rosdep" / "rosdep2"
    rosdep.mkdir(parents=True)
    (rosdep / "__init__.py").touch()
    (rosdep / "rospack.py").write_text(ROSDEP)
    ours = run([sys.executable, "-c", ASK_ROSPKG])
    monkeypatch.setenv("PYTHONPATH", str(rosdep.parent))
    real = run([REAL_PYTHON, "-c", ASK_ROSPKG])
    assert ours[0] == real[0] == 0, ours[2] + real[2]
    expected, found = json.loads(real[1]), json.loads(ours[1])
    assert {key: (value, found[key]) for key, value in expected.items() if found[key] != value} == {}


@pytest.mark.parametrize(
    "line",
    [
        "msg std_msgs/String",
        "msg String",
        "msg geometry_msgs/PoseStamped",
        "msg sensor_msgs/Imu",
        "msg sensor_msgs/LaserScan",
        "msg diagnostic_msgs/DiagnosticArray",
        "msg nav_msgs/Path",
        "msg std_msgs/Empty",
        "srv SetBool",
        "srv std_srvs/Empty",
        "msg -p x std_msgs/String",
        "msg -f1 Pose",
        "msg -H -f 0 sensor_msgs/JointState",
        "-H msg Twist",
        "msg -s std_msgs/Nope",
    ],
)
def test_rosmsg_proto(line: str) -> None:
    ours = run(
        [
            sys.executable,
            "-c",
            OUR_RUN.format(module="rosmsg.commands.rosmsg_proto", function="main"),
            *line.split(),
        ]
    )
    assert ours == run(["/usr/bin/rosmsg-proto", *line.split()])


def test_packages_for_rosbuild(tree: Path) -> None:
    """Real ROS reports the same missing dependency, before the output rather than after it."""
    manifests = {
        "rb": '<depend package="older"/><depend package="e"/><rosdep name="boost"/>'
        '<export><cpp cflags="-I${prefix}"/></export>',
        "older": '<rosdep name="tinyxml"/>',
        "incomplete": '<depend package="absent"/><depend package="older"/>',
    }
    for name, body in manifests.items():
        (tree / "stack" / name / "below").mkdir(parents=True)
        (tree / "stack" / name / "manifest.xml").write_text(f"<package>{body}</package>")
    (tree / "stack" / "rb" / "below" / "manifest.xml").write_text("<package/>")
    for line in """
        find rb
        depends rb
        depends1 rb
        depends-indent rb
        depends-manifests rb
        depends-why --target=older rb
        depends-on1 older
        rosdep0 rb
        rosdep older
        export --lang=cpp --attrib=cflags rb
        depends incomplete
        depends1 incomplete
    """.strip().splitlines():
        (status, out, errors), found = real(line), ours(line)
        assert sorted(out.splitlines()) == sorted(found[1].splitlines()), line
        assert (status, errors) == (found[0], found[2]), line
    assert ours("find below")[0] == real("find below")[0] == 1
    here = tree / "stack" / "rb"
    assert ours("find", here) == real("find", here)
