"""Imports go only downwards through the rooms, and the pure rooms stay pure. This is checked by parsing, not by importing."""

from __future__ import annotations

import ast
import contextlib
import functools
import graphlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = Path(__file__).parents[1] / "minirospy"

LAYERS = [
    {"cli"},
    {"notebook", "course"},
    {"web", "fleet", "ros2"},
    {"zenoh"},
    {"ros"},
    {"command"},
    {"introspect"},
    {"workspace"},
    {"client", "aio"},
    {"runtime"},
    {"core", "board"},
    {"base"},
]
# Exceptions: `rosbag play --foxglove` shows the bag in a browser.
UPWARDS = {("ros/rosbag/commands/rosbag_play.py", "web")}
OPTIONAL_PACKAGES = [
    "ament_index_python", "angles", "camera_info_manager_py", "diagnostic_aggregator",
    "diagnostic_updater", "foxglove_bridge", "image_geometry", "image_transport",
    "interactive_markers", "joint_state_publisher", "joint_state_publisher_gui", "kdl_parser_py",
    "laser_geometry", "map_server", "message_filters", "resource_retriever", "robot_pose_publisher",
    "ros_numpy", "rosauth", "rosbridge_server", "rosclean", "rosserial_python",
    "rospy_message_converter", "roswtf", "smach_ros", "sound_play", "teleop_twist_joy",
    "teleop_twist_keyboard", "tf2_kdl", "tf2_py", "tf2_sensor_msgs", "tf2_tools", "tf_conversions",
    "topic_tools", "turtle_tf", "turtle_tf2", "turtlesim", "two_link_arm", "urdf", "urdf_parser_plugin",
    "urdfdom_py", "web_video_server", "xacro",
]  # fmt: skip
"""The ROS packages on which no other package depends."""
CONTROL_PACKAGES = [
    "ackermann_steering_controller", "control_toolbox", "controller_interface", "controller_manager",
    "controller_manager_msgs", "diff_drive_controller", "effort_controllers", "force_torque_sensor_controller",
    "forward_command_controller", "four_wheel_steering_controller", "gripper_action_controller",
    "hardware_interface", "imu_sensor_controller", "joint_limits_interface", "joint_state_controller",
    "joint_trajectory_controller", "minirospy_hardware", "position_controllers", "realtime_tools", "ros_control",
    "ros_controllers", "transmission_interface", "velocity_controllers",
]  # fmt: skip
"""The packages of ros_control, which depend on each other."""
SIMULATION_PACKAGES = [
    "diff_drive_robot",
    "gazebo_plugins",
    "gazebo_ros",
    "rpi_feros_gazebo",
    "six_joint_arm",
    "two_link_arm_gazebo",
]
"""The packages of the simulation, which depend on each other."""
LEAVES = {
    **{room: [room] for room in ("web", "fleet", "ros2", "notebook", "course")},
    "ROS packages": [f"ros/{package}" for package in OPTIONAL_PACKAGES],
    "ros_control": ["core/control", *(f"ros/{package}" for package in CONTROL_PACKAGES)],
    "gazebo_ros_control": ["ros/gazebo_ros_control"],
    "simulation": ["core/meshes", "core/sdf", *(f"ros/{package}" for package in SIMULATION_PACKAGES)],
    "rosbag's migration": ["ros/rosbag/migration", "ros/rosbag/rosbag/migration.py"],
    "bags of version 1.2": ["core/bag/reader12.py"],
}
"""Parts that can be deleted, with their paths. Nothing outside a part imports it, except for functions in `cli/` that run it."""
LEAVES_OF_LEAVES = {"gazebo_ros_control": {"ros_control", "simulation"}, "notebook": {"web"}}
"""Leaves that import other leaves, and are deleted together with them."""
LEAF_PATHS = sorted(path for paths in LEAVES.values() for path in paths)
SYSTEM_PACKAGES = {"catkin", "catkin_pkg", "python_orocos_kdl", "rospkg"}
"""In real ROS, these come from the system or with each package, so a package.xml has rosdep's name for them, or none."""
UNNAMED = {
    ("camera_info_manager_py", "camera_calibration_parsers"): "both read the files of cameras' calibrations",
    ("catkin", "rosunit"): "run_tests runs the tests of all kinds",
    ("diagnostic_aggregator", "rosparam"): "the real add_analyzers imports it, too",
    ("image_transport", "cv_bridge"): "has the codecs of compressed_image_transport, which names it",
    ("laser_geometry", "tf2_ros"): "for types; the real one names tf, which needs tf2_ros",
    ("ros_numpy", "cv_bridge"): "both convert images",
    ("roslib", "genmsg"): "its modules are old names of genmsg's",
    ("roslib", "genpy"): "its modules are old names of genpy's",
    ("roslib", "rosgraph"): "its modules are old names of rosgraph's",
    ("rosmaster", "rosout"): "the command `roscore` runs both in one process",
    ("rosmaster", "rospy"): "validators have the same errors",
    ("rospy", "rosconsole"): "rospy.rosconsole has the command's function",
    ("rospy", "rosservice"): "the real rospy.logger_level_service_caller imports it, too",
    ("rostest", "roslib"): "rosunit, which it names, needs roslib",
    ("rostopic", "rosgraph"): "rospy, which it names, needs rosgraph",
    ("rosunit", "roslaunch"): "rosunit.pmon is roslaunch.pmon",
    ("rosunit", "rostest"): "the parsers of both commands are in one module",
    ("tf2_kdl", "tf2_geometry_msgs"): "both transform with PyKDL",
    ("tf2_py", "tf2_ros"): "the buffer is in tf2_ros",
    ("tf2_sensor_msgs", "tf2_geometry_msgs"): "both transform with PyKDL",
}
"""(package, imported package) that the real package's package.xml lacks, with the reason for the import."""
DEPTH = {room: depth for depth, rooms in enumerate(LAYERS) for room in rooms}
BYTES_ONLY = [PACKAGE / "runtime", PACKAGE / "core" / "wire"]
PURE = {"core"}
PURE_FILES = (
    {
        PACKAGE / "web" / name
        for name in (
            "access.py",
            "foxglove/channels.py",
            "foxglove/parsing.py",
            "foxglove/protocol.py",
            "foxglove/serializing.py",
            "rosapi/typedefs.py",
            "rosbridge/cbor.py",
            "rosbridge/conversion.py",
            "rosbridge/png.py",
            "rosbridge/protocol.py",
            "rosbridge/subscription.py",
            "tf_republisher/pairs.py",
            "video/options.py",
            "video/pictures.py",
            "server/account.py",
            "server/admission.py",
            "server/frames.py",
            "server/jobs.py",
            "server/liveness.py",
            "server/queue.py",
            "server/turns.py",
            "server/websocket.py",
        )
    }
    | {
        PACKAGE / "ros2" / name
        for name in (
            "action_links.py",
            "action_messages.py",
            "definitions.py",
            "field_order.py",
            "layouts.py",
            "links.py",
            "parameter_values.py",
            "rules.py",
            "service_links.py",
            "zenoh_keys.py",
        )
    }
    | {
        PACKAGE / "fleet" / name
        for name in (
            "clocks.py",
            "contents.py",
            "frames.py",
            "holders.py",
            "keys.py",
            "flows.py",
            "report.py",
            "ros1_keys.py",
            "rules.py",
        )
    }
    | {PACKAGE / "web" / "dashboard" / "views.py"}
    | {PACKAGE / "course" / name for name in ("exercise.py", "wording.py")}
    | {PACKAGE / "ros" / "turtlesim" / name for name in ("canvas.py", "square.py", "world.py")}
)
IMPURE_MODULES = {"asyncio", "socket", "threading", "select", "selectors", "subprocess"}

FILES = sorted(
    path
    for path in PACKAGE.rglob("*.py")
    if not {"overlay", "nodes", "scripts"} & set(path.relative_to(PACKAGE).parts)
    and path.name != "__main__.py"
)


class Import(NamedTuple):
    """The modules or names that a statement imports, and where the statement is."""

    names: tuple[str, ...]
    is_for_types: bool
    is_in_function: bool


@functools.cache
def import_statements(path: Path) -> tuple[Import, ...]:
    """Return every import of a file, anywhere in the file."""
    found: list[Import] = []
    blocks: list[tuple[ast.AST, bool, bool]] = [(ast.parse(path.read_text(encoding="utf-8")), False, False)]
    while blocks:
        node, is_for_types, is_in_function = blocks.pop()
        if isinstance(node, ast.Import):
            found.append(Import(tuple(alias.name for alias in node.names), is_for_types, is_in_function))
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute"
            names = tuple(f"{node.module}.{alias.name}" for alias in node.names)
            found.append(Import(names, is_for_types, is_in_function))
        elif isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            blocks += ((each, True, is_in_function) for each in node.body)
            blocks += ((each, is_for_types, is_in_function) for each in node.orelse)
        elif not isinstance(node, ast.expr):
            # Imports are statements, and expressions cannot contain statements.
            inside = is_in_function or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
            blocks += ((each, is_for_types, inside) for each in ast.iter_child_nodes(node))
    return tuple(found)


@functools.cache
def imports(path: Path, *, for_types: bool = True) -> frozenset[str]:
    """Return every module that a file imports, anywhere in the file; without ``for_types``, only those imported at run time."""
    return frozenset(
        name for each in import_statements(path) if for_types or not each.is_for_types for name in each.names
    )


def graph_of_imports(room: str, *, for_types: bool = False) -> dict[str, set[str]]:
    """Return the modules of the same room that each module imports, also in functions and, if ``for_types``, for types only."""
    files = [path for path in FILES if path.relative_to(PACKAGE).with_suffix("").parts[0] == room]
    modules = {module_name(path): path for path in files}
    found = {module: imports(path, for_types=for_types) for module, path in modules.items()}
    # `from package.module import name` and `from package import module` look alike.
    named = {
        module: set(names) | {name.rpartition(".")[0] for name in names} for module, names in found.items()
    }
    for module in modules:
        named[module] -= {name.rpartition(".")[0] for name in found[module] if name in modules}
    return {module: (names & modules.keys()) - {module} for module, names in named.items()}


def module_name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def room_of(module: str) -> str:
    parts = module.split(".")
    return parts[1] if parts[0] == "minirospy" and len(parts) > 1 else ""


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


@pytest.mark.parametrize("room", sorted(DEPTH))
def test_imports_go_downwards(room: str) -> None:
    upwards = []
    for path in (each for each in FILES if each.relative_to(PACKAGE).with_suffix("").parts[0] == room):
        for module in imports(path):
            other = room_of(module)
            is_known = (name_of(path), other) in UPWARDS
            if other in DEPTH and other != room and not is_known and DEPTH[other] <= DEPTH[room]:
                upwards.append(f"{name_of(path)} imports {module}")
    assert upwards == []


def imported_of(paths: list[Path], packages: set[str]) -> dict[str, set[str]]:
    """Return the packages that each file imports of those in ``packages``."""
    assert paths
    found = {name_of(path): {module.split(".")[0] for module in imports(path)} & packages for path in paths}
    return {name: modules for name, modules in found.items() if modules}


def test_pure_rooms_touch_no_outside() -> None:
    pure = [path for path in FILES if path.relative_to(PACKAGE).parts[0] in PURE or path in PURE_FILES]
    assert imported_of(pure, IMPURE_MODULES) == {}


def test_runtime_and_wire_know_no_messages() -> None:
    generated = {each.parent.parent.name for each in (PACKAGE / "overlay").glob("*/msg/__init__.py")}
    assert "rosgraph_msgs" in generated
    paths = [path for path in FILES if any(folder in path.parents for folder in BYTES_ONLY)]
    assert imported_of(paths, generated) == {}


@pytest.mark.parametrize("room", sorted(DEPTH))
def test_no_room_has_an_import_cycle(room: str) -> None:
    list(graphlib.TopologicalSorter(graph_of_imports(room)).static_order())


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Return the groups of modules that import each other, directly or by other modules."""
    reached: dict[str, set[str]] = {}
    for module in graph:
        found, left = set[str](), [module]
        while left:
            more = graph[left.pop()] - found
            found |= more
            left += more
        reached[module] = found
    groups = [{other for other in reached[module] if module in reached[other]} for module in graph]
    return [group for number, group in enumerate(groups) if group and group not in groups[:number]]


def test_few_modules_import_types_in_a_circle() -> None:
    """A part and its owner name each other's types in only three places."""
    found = [circle for room in DEPTH for circle in circles(graph_of_imports(room, for_types=True))]
    owners = {"minirospy.aio.node", "minirospy.client.session", "minirospy.runtime.rpc.server"}
    assert [circle for circle in found if not circle & owners] == []
    assert len(found) == len(owners)


def ros_package_of(path: Path) -> str:
    """Return a file's ROS package, or an empty string if the file is in another room."""
    parts = path.relative_to(PACKAGE).parts
    return parts[1] if parts[0] == "ros" and len(parts) > 2 else ""


def package_imports() -> dict[tuple[str, str], set[str]]:
    """Return the files for each (package, imported package of `ros/`); the package is empty outside `ros/`."""
    found: dict[tuple[str, str], set[str]] = {}
    for path in FILES:
        for module in imports(path):
            parts = module.split(".")
            other = parts[2] if parts[:2] == ["minirospy", "ros"] and len(parts) > 2 else ""
            if other != ros_package_of(path) and other and (PACKAGE / "ros" / other).is_dir():
                name = path.relative_to(PACKAGE).as_posix()
                found.setdefault((ros_package_of(path), other), set()).add(name)
    return found


def named_dependencies(package: str) -> set[str]:
    """Return the dependencies in package.xml, or nothing if real ROS has the package from the system."""
    folders = (PACKAGE / "ros" / package, PACKAGE.parent / "msgs" / package)
    manifests = [folder / "package.xml" for folder in folders if (folder / "package.xml").exists()]
    return {
        (element.text or "").strip()
        for manifest in manifests
        for element in ET.parse(manifest).getroot()
        if element.tag.endswith("depend")
    }


def test_ros_package_imports_what_its_manifest_names() -> None:
    unnamed = {
        (package, other): files
        for (package, other), files in package_imports().items()
        if package and other not in SYSTEM_PACKAGES and other not in named_dependencies(package)
    }
    assert {pair: files for pair, files in unnamed.items() if pair not in UNNAMED} == {}
    # Exceptions that are no longer needed must be removed.
    assert set(UNNAMED) - unnamed.keys() == set()


def leaf_of(path: str) -> str:
    """Return the leaf that contains a path in the package, or an empty string if none does. Each ROS package is a leaf."""
    for leaf in LEAF_PATHS:
        if path == leaf or path.startswith(f"{leaf}/"):
            names = [name for name, paths in LEAVES.items() if leaf in paths]
            return leaf if names == ["ROS packages"] else names[0]
    return ""


@functools.cache
def leaf_of_module(module: str) -> str:
    """Return the leaf that contains a dotted name, such as ``package.module.name``."""
    parts = module.split(".")
    if parts[0] != "minirospy":
        return ""
    paths = ("/".join(parts[1:end]) for end in range(2, len(parts) + 1))
    return next((leaf for path in paths for leaf in (leaf_of(path), leaf_of(f"{path}.py")) if leaf), "")


def imported_on_import(path: Path) -> frozenset[str]:
    """Return the modules that are imported when a file is imported: not those in functions, or for types only."""
    return frozenset(
        name
        for each in import_statements(path)
        if not (each.is_for_types or each.is_in_function)
        for name in each.names
    )


def test_nothing_outside_imports_a_leaf() -> None:
    upwards = []
    for path in FILES:
        relative = path.relative_to(PACKAGE).as_posix()
        room = relative.partition("/")[0]
        for module in imported_on_import(path) if room == "cli" else imports(path):
            leaf = leaf_of_module(module)
            own = leaf_of(relative)
            if (
                leaf
                and leaf != own
                and leaf not in LEAVES_OF_LEAVES.get(own, ())
                and (relative, room_of(module)) not in UPWARDS
            ):
                upwards.append(f"{relative}: {module}")
    assert upwards == []


def test_each_leaf_exists() -> None:
    assert [path for path in LEAF_PATHS if not (PACKAGE / path).exists()] == []


IMPORT_ALL = """
import gc, importlib, os, pkgutil, signal, sys, traceback
import minirospy

SECONDS = 200  # after which an import hangs
signal.alarm(SECONDS)
commands = os.fdopen(os.dup(0))
os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # for programs that read from it

def import_all(package):
    for found in pkgutil.iter_modules(package.__path__, package.__name__ + "."):
        if found.name.rpartition(".")[2] in ("__main__", "overlay"):
            continue
        try:
            module = importlib.import_module(found.name)
        except ImportError as error:
            print(found.name, error)
        except SystemExit:
            pass  # a program that `rosrun` starts by its path
        else:
            if found.ispkg:
                import_all(module)

assert minirospy.__path__ == [sys.argv[1]], minirospy.__path__
import_all(minirospy)
signal.alarm(0)
gc.freeze()
print("status 0", flush=True)
while commands.readline():
    if os.fork() == 0:
        signal.alarm(SECONDS)
        importlib.invalidate_caches()
        try:
            import_all(minirospy)
            sys.stdout.flush()
            os._exit(0)
        except BaseException:
            traceback.print_exc(file=sys.stdout)
            sys.stdout.flush()
            os._exit(1)
    print("status", os.waitstatus_to_exitcode(os.wait()[1]), flush=True)
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the package's modules, with the message definitions next to it."""
    target = tmp_path_factory.mktemp("copy") / "minirospy"
    for path in FILES:
        copy = target / path.relative_to(PACKAGE)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
    shutil.copytree(PACKAGE.parent / "msgs", target.with_name("msgs"))
    return target


@contextlib.contextmanager
def moved_aside(package: Path, leaves: Iterable[str]) -> Iterator[None]:
    """Move the files of leaves out of a copy of the package, and back at the end."""
    paths = {path for leaf in leaves for path in LEAVES[leaf] if (package / path).exists()}
    gone = {package / path: package.parent / path.replace("/", " ") for path in paths}
    assert gone
    for path, aside in gone.items():
        path.rename(aside)
    try:
        yield
    finally:
        for path, aside in gone.items():
            aside.rename(path)


def read_answer(program: subprocess.Popen[str]) -> list[str]:
    """Return the lines that the program prints up to its next status."""
    lines = []
    assert program.stdout
    for line in program.stdout:
        lines.append(line)
        if line.startswith("status "):
            break
    return lines


@pytest.mark.skipif(sys.platform != "linux", reason="Python can fork safely on Linux only")
@pytest.mark.timeout(480)
def test_rest_can_be_imported_without_each_leaf(copied: Path) -> None:
    """A process imports what belongs to no leaf. For each leaf, a fork of it imports the other leaves."""
    with moved_aside(copied, LEAVES):
        program = subprocess.Popen(
            [sys.executable, "-c", IMPORT_ALL, str(copied)],
            cwd=copied.parent,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        answers = {"any leaf": read_answer(program)}
    with program:
        assert program.stdin
        for leaf in LEAVES:
            with moved_aside(
                copied, [leaf, *(above for above, needed in LEAVES_OF_LEAVES.items() if leaf in needed)]
            ):
                print(file=program.stdin, flush=True)
                answers[leaf] = read_answer(program)
    assert {leaf: lines for leaf, lines in answers.items() if lines != ["status 0\n"]} == {}


def test_every_room_has_its_place() -> None:
    rooms = {path.relative_to(PACKAGE).with_suffix("").parts[0] for path in FILES} - {"__init__"}
    assert rooms == set(DEPTH)


GENERATED = {"_buff", "_connection_header", "_full_text", "_has_header", "_md5sum", "_request_class", "_response_class",
             "_slot_types", "_type"}  # fmt: skip
"""Private names that genpy gives to messages; programs for ROS use them."""
OF_PYTHON = {"_actions", "_ArgumentGroup", "_asdict", "_create_unverified_context", "_current_frames", "_exit", "_getframe",
             "_group_actions", "_make", "_replace"}  # fmt: skip
"""Private names in the standard library, and those of NamedTuple, which are public."""


def test_private_members_stay_in_their_room() -> None:
    """`ros/` is left out, because names such as ``_chain`` are those of the real packages."""
    named: dict[str, set[str]] = {}
    used: dict[str, list[tuple[str, str]]] = {}
    for path in FILES:
        room = path.relative_to(PACKAGE).parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = named.setdefault(room, set())
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                names.add(node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                names.add(node.id)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                names.add(node.value)  # __slots__
            elif isinstance(node, ast.Attribute):
                if isinstance(node.value, ast.Name) and node.value.id in ("self", "cls"):
                    names.add(node.attr)
                elif node.attr.startswith("_") and not node.attr.startswith("__"):
                    used.setdefault(room, []).append((str(path), node.attr))

    foreign = [
        use
        for room, uses in used.items()
        for use in uses
        if room != "ros" and use[1] not in named[room] | GENERATED | OF_PYTHON
    ]
    assert not foreign


TESTS = Path(__file__).parent
ROS_PROGRAMS = [
    "core/tf2/conversation.py", "interop/bag_peer.py", "interop/genpy_peer.py", "overlay", "referee/cases",
    "ros/packages/smach_programs", "ros/tf2_ros/test_interface.py", "ros/tf2_ros/test_transformations.py",
    "ros/tf2_ros/transformations_calls.py",
]  # fmt: skip
"""These use private names of ROS's own packages, as other people's programs do: their accesses have no limit."""
MAX_PRIVATE_ACCESSES = 214  # of tests to members that begin with one underscore; to be lowered, never raised


def private_accesses(path: Path) -> list[str]:
    """Return the private names that a test uses: attributes, imports, and names in strings for getattr() or monkeypatch."""
    public = GENERATED | OF_PYTHON | {"_fields", "_field_defaults"}
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute):
            if not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")):
                found.append(node.attr)
        elif isinstance(node, ast.ImportFrom):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.Call):
            function = (
                node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            )
            if function in ("delattr", "getattr", "hasattr", "object", "setattr"):
                texts = [each.value for each in node.args[:2] if isinstance(each, ast.Constant)]
                found += [text.rpartition(".")[2] for text in texts if isinstance(text, str)]
    return [
        name for name in found if name.startswith("_") and not name.startswith("__") and name not in public
    ]


def test_tests_use_few_private_members() -> None:
    found = {
        path.relative_to(TESTS).as_posix(): names
        for path in TESTS.rglob("*.py")
        if not any(path.is_relative_to(TESTS / program) for program in ROS_PROGRAMS)
        and (names := private_accesses(path))
    }
    count = sum(map(len, found.values()))
    assert count <= MAX_PRIVATE_ACCESSES, found
