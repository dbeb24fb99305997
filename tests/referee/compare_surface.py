"""Compare every public name and signature of rospy and similar modules in real ROS and minirospy: write three pages of docs.

docs/compatibility/rospy.md compares rospy; docs/compatibility/modules.md rosgraph, rosnode, rostopic and similar modules;
docs/compatibility/tf.md tf2_ros, tf and PyKDL.

    .venv/bin/python tests/referee/compare_surface.py            write the pages
    .venv/bin/python tests/referee/compare_surface.py --check    exit status 1 if one would change

Real rospy is the one that /usr/bin/python3 imports. With --describe, the same file describes one of the two, so it runs
under both.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import inspect
import json
import os
import pkgutil
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

ROSPY = [
    "rospy",
    "rospy.client",
    "rospy.core",
    "rospy.names",
    "rospy.rostime",
    "rospy.timer",
    "rospy.topics",
    "rospy.service",
    "rospy.msproxy",
    "rospy.exceptions",
    "rospy.msg",
]
AROUND = [
    "rosgraph",
    "rosgraph.masterapi",
    "rosgraph.names",
    "rosgraph.network",
    "rosgraph.rosenv",
    "rosgraph.roslogging",
    "rosgraph.xmlrpc",
    "rosgraph.impl.graph",
    "rosnode",
    "rostopic",
    "rosservice",
    "rosparam",
    "rosmsg",
    "rosmaster.exceptions",
    "rosmaster.master_api",
    "rosmaster.paramserver",
    "rosmaster.util",
    "rosmaster.validators",
    "roswtf.environment",
    "roswtf.model",
    "roswtf.rules",
    "rosclean",
    "roslib",
    "roslib.gentools",
    "roslib.srvs",
    "roslib.message",
    "roslib.names",
    "roslib.packages",
    "roslib.rosenv",
    "roslib.scriptutil",
    "roslib.launcher",
    "roslib.exceptions",
    "genpy",
    "genpy.base",
    "genpy.message",
    "genpy.rostime",
    "genpy.dynamic",
    "genmsg",
    "genmsg.base",
    "genmsg.names",
    "genmsg.srvs",
    "genmsg.msgs",
    "genmsg.msg_loader",
    "genmsg.gentools",
    "catkin.find_in_workspaces",
    "catkin.terminal_color",
    "rospkg",
    "rospkg.os_detect",
    "message_filters",
    "sensor_msgs.point_cloud2",
    "angles",
    "topic_tools",
    "cv_bridge",
    "cv_bridge.core",
    "image_geometry",
    "image_geometry.cameramodels",
    "laser_geometry",
    "laser_geometry.laser_geometry",
    "camera_calibration_parsers",
    "resource_retriever",
    "rosbag",
    "rosbag.bag",
    "rosbag.migration",
    "dynamic_reconfigure",
    "dynamic_reconfigure.client",
    "dynamic_reconfigure.encoding",
    "dynamic_reconfigure.server",
    "dynamic_reconfigure.parameter_generator_catkin",
    "diagnostic_updater",
    "bondpy.bondpy",
    "interactive_markers.interactive_marker_server",
    "interactive_markers.menu_handler",
]
"""The modules of the second page."""
FRAMES = [
    "tf2_py",
    "tf2_ros",
    "tf2_ros.buffer",
    "tf2_ros.buffer_client",
    "tf2_ros.buffer_interface",
    "tf2_ros.static_transform_broadcaster",
    "tf2_ros.transform_broadcaster",
    "tf2_ros.transform_listener",
    "tf2_geometry_msgs",
    "tf2_geometry_msgs.tf2_geometry_msgs",
    "tf2_sensor_msgs",
    "tf2_sensor_msgs.tf2_sensor_msgs",
    "tf2_kdl",
    "tf2_kdl.tf2_kdl",
    "tf",
    "tf.broadcaster",
    "tf.listener",
    "tf.transformations",
    "tf_conversions",
    "tf_conversions.posemath",
    "PyKDL",
]
"""The modules of the third page."""

REAL_PYTHON = "/usr/bin/python3"
DOCS = Path(__file__).resolve().parents[2] / "docs"
OF_ROS = (
    "rospy", "genpy", "rosgraph", "roscpp", "std_msgs", "rosgraph_msgs", "minirospy", "rosnode", "rostopic", "rosservice",
    "rosparam", "rosmsg", "rosclean", "roslib", "genmsg", "catkin", "rospkg", "rosbag", "message_filters", "sensor_msgs",
    "angles", "tf2_py", "tf2_ros", "tf2", "_tf2", "tf", "tf2_geometry_msgs", "tf2_sensor_msgs", "tf2_kdl", "tf_conversions",
    "PyKDL",
    "rosparam", "rosmsg", "rosclean", "roslib", "genmsg", "catkin", "rospkg", "message_filters",
    "diagnostic_updater", "bondpy", "interactive_markers",
    "sensor_msgs", "angles", "cv_bridge", "dynamic_reconfigure", "image_geometry", "laser_geometry", "camera_calibration_parsers",
    "resource_retriever", "topic_tools",
)  # fmt: skip
REASONS = {
    "LoggingIdentical": "bookkeeping inside rospy's log functions",
    "LoggingOnce": "bookkeeping inside rospy's log functions",
    "LoggingThrottle": "bookkeeping inside rospy's log functions",
    "configure_logging": "called by rospy's own init_node",
    "deprecated": "a decorator for rospy's own use",
    "set_initialized": "called by rospy's own init_node",
    "set_node_uri": "called by rospy's own init_node",
    "Poller": "rospy's select loop; ours is asyncio's",
    "QueuedConnection": "rospy's thread each connection; ours has an outbox",
    "SubscriberStatisticsLogger": "rospy's inside of topic statistics",
    "get_registration_listeners": "rospy's inside of registration",
    "set_topic_manager": "rospy's inside of registration",
    "get_tcpros_handler": "rospy's inside of TCPROS",
    "set_service_manager": "rospy's inside of registration",
    "TIMEOUT_READY": "not used by rospy itself",
    "python3": "a leftover of Python 2",
    "ComparableMixin": "the inside of rosbag's index entries",
    **dict.fromkeys(
        (
            "argv_publish",
            "file_yaml_arg",
            "param_publish",
            "param_publish_once",
            "stdin_publish",
            "stdin_yaml_arg",
            "wait_for_subscriber",
            "SUBSCRIBER_TIMEOUT",
        ),
        "the inside of the command rostopic",
    ),
    **dict.fromkeys(
        (
            "lookup_uri",
            "rosnode_debugnode",
        ),
        "the inside of the command rosnode",
    ),
    **dict.fromkeys(
        (
            "construct_angle_degrees",
            "construct_angle_radians",
            "construct_yaml_binary",
            "represent_foo",
            "represent_xml_binary",
        ),
        "given to PyYAML when rosparam is imported",
    ),
    **dict.fromkeys(
        (
            "MAX_DEFAULT_NON_FLOW_ITEMS",
            "RosMsgProtoArgsException",
            "RosMsgProtoException",
            "construct_ordered_mapping",
            "construct_yaml_map_with_ordered_dict",
            "create_names_filter",
            "fullusage",
            "get_array_type_instance",
            "init_rosmsg_proto",
            "represent_ordered_mapping",
            "rosmsg_cmd_list",
            "rosmsg_cmd_md5",
            "rosmsg_cmd_package",
            "rosmsg_cmd_packages",
            "rosmsg_cmd_prototype",
            "rosmsg_cmd_show",
            "rosmsg_debug",
        ),
        "the inside of the commands rosmsg and rosmsg-proto",
    ),
    "compute_md5_v1": "the md5sum before ROS 1.0",
    **dict.fromkeys(
        (
            "Arch",
            "Conda",
            "Cygwin",
            "Funtoo",
            "Gentoo",
            "Manjaro",
            "OpenEmbedded",
            "OpenSuse",
            "QNX",
            "Slackware",
        ),
        "FdoDetect recognizes it by os-release",
    ),
    "cvtColorForDisplay": "for the window of image_view",
    **dict.fromkeys(("LINEDEBUG", "id"), "the generator's inside"),
    "ForkingXMLRPCServer": "a server that forks: not on every system",
    "isstring": "a leftover of Python 2",
    "SIOCGIFADDR": "Linux's own number of a call",
    "SIOCGIFCONF": "Linux's own number of a call",
    "ROS_BINDEPS_PATH": "of rosbuild",
    "ROS_BOOST_ROOT": "of rosbuild",
    "PIPE": "passed on from subprocess",
    "generate_dynamic": "genpy.dynamic has it",
    "msg_generator": "genpy's own compiler; ours is minirospy.core.idl",
    "get_depends": "the inside of load_manifest",
    **dict.fromkeys(("log", "log_verbose", "plog"), "the log of genmsg's own tools"),
    "find_packages": "catkin_pkg has it",
    "catkin_find": "passed on from catkin.find_in_workspaces",
    **dict.fromkeys(
        ("convert_constant_value", "load_msg_depends", "normalize_package_context", "verbose"),
        "genmsg's inside",
    ),
    **dict.fromkeys(("compute_full_type_name", "compute_md5_v2"), "not used by genmsg itself"),
    **dict.fromkeys(
        ("ROS_LOG_DIR", "makedirs_with_parent_perms", "renew_latest_logdir"), "the inside of rospy's logging"
    ),
}
"""Name of real rospy -> the reason why it is not offered: only rospy itself uses it."""

MEMBERS_INSIDE = {
    "acquire_impl": "rospy's inside",
    "release_impl": "rospy's inside",
    "handle": "rospy's inside",
    "emit": "logging's own",
    "get_num_connections": "Publisher and Subscriber have it",
    "unregister": "Publisher and Subscriber have it",
    "error_handler": "rospy's inside",
    "register": "rospy's inside",
    "unregister_all": "rospy's inside",
    **dict.fromkeys(
        (
            "get_last_printed_tn",
            "set_last_printed_tn",
            "get_msg_t0",
            "set_msg_t0",
            "get_msg_tn",
            "set_msg_tn",
            "get_times",
            "set_times",
        ),
        "the inside of ROSTopicHz",
    ),
    **dict.fromkeys(
        (
            "appendgroup",
            "appendline",
            "crepr",
            "generatecpp",
            "generatedoc",
            "generatepy",
            "generateusage",
            "generatewikidoc",
            "mkdirabs",
            "replace_infinity",
        ),
        "the generator's inside",
    ),
    **dict.fromkeys(
        ("Connected", "Death", "Heartbeat", "SisterDied", "StartDying"), "the inside of Bond's state machine"
    ),
    "decode": "xmlrpc's own",
    "custom_strify_message": "the inside of CallbackEcho",
    "findCaller": "logging's own",
}

Description = dict[str, dict[str, Any]]


PACKAGES = (
    "rosgraph", "rosnode", "rostopic", "rosservice", "rosparam", "rosmsg", "rosclean", "roslib", "genpy", "genmsg", "catkin",
    "rospkg", "roslaunch", "rosmaster", "roswtf", "rostest", "rosunit", "rospy", "actionlib", "rosbag", "dynamic_reconfigure",
    "topic_tools", "message_filters",
)  # fmt: skip
"""The packages whose submodules and private names are listed."""


def private_names(not_only_own: bool = False) -> dict[str, list[str]]:
    """Return submodule -> its own functions and classes whose names start with an underscore, or all of its names."""
    found = {}
    for name in submodules():
        try:
            module = importlib.import_module(name)
        except (AttributeError, ImportError):  # in real ROS: rospy.impl.udpros
            continue
        found[name] = sorted(
            each
            for each, value in vars(module).items()
            if each.startswith("_") and not each.startswith("__")
            and (inspect.isroutine(value) or inspect.isclass(value))
            and (not_only_own or getattr(value, "__module__", "") == name)
        )  # fmt: skip
    return found


def submodules() -> list[str]:
    """Return the importable modules of :data:`PACKAGES`, without generated messages."""
    found = []
    for package in PACKAGES:
        path = getattr(importlib.import_module(package), "__path__", [])
        names = [module.name for module in pkgutil.walk_packages(path, f"{package}.", lambda name: None)]
        found += [package, *names]
    kept = [name for name in found if not re.search(r"\.(msg|srv|cfg)(\.|$)|__main__", name)]
    return [name for name in kept if importlib.util.find_spec(name) is not None]


def describe() -> Description:
    """Return module -> name -> its home module and what it is, for the rospy of this interpreter."""
    return {
        module: {
            name: value
            for name in dir(importlib.import_module(module))
            if not name.startswith("_") and (value := describe_value(getattr(sys.modules[module], name)))
        }
        for module in (*ROSPY, *AROUND, *FRAMES)
    }


def describe_value(value: Any) -> dict[str, Any] | None:
    """Return the parts of a value that are compared; None if it is not rospy's own."""
    if isinstance(value, (bool, int, float, str)):
        return {"home": "", "is": repr(value)}
    home = getattr(value, "__module__", None) or ""
    if inspect.isclass(value) and (home.startswith(OF_ROS) or value.__name__ == "NullHandler"):
        members = {
            name: parameters(member)
            for name in dir(value)
            if not name.startswith("_") and callable(member := getattr(value, name)) and not inspect.isclass(member)
            and not (getattr(member, "__module__", None) or "threading").startswith(("threading", "logging"))
        }  # fmt: skip
        refuses = {"refuses": True} if getattr(value, "_refuses", False) else {}
        return {"home": home, "is": parameters(value), "members": members, "class": True, **refuses}
    if callable(value) and (home.startswith(OF_ROS) or home == "logging" or inspect.ismethod(value)):
        return {"home": home, "is": parameters(value)}
    return None


def parameters(value: Any) -> list[list[str]] | None:
    """Return [name, default, kind] of each parameter; None if it cannot be determined."""
    try:
        signature = inspect.signature(value)
    except (TypeError, ValueError):
        return None
    return [
        [p.name, "" if p.default is p.empty else shown_default(p.default), p.kind.name]
        for p in signature.parameters.values()
    ]


def shown_default(default: Any) -> str:
    if default is os.environ:
        return "os.environ"
    if default is sys.argv:
        return "sys.argv"
    if isinstance(default, set):
        return "{" + ", ".join(sorted(map(repr, default))) + "}"
    return " ".join(re.sub(r"<.*_?Unspecified object at .*>", "<unspecified>", repr(default)).split())


def compare(real: Any, ours: Any) -> str:
    """Return one of: same; wider (minirospy accepts every call that real rospy accepts); differs."""
    if real == ours or real is None:
        return "same"
    if not isinstance(real, list) or not isinstance(ours, list):
        return "differs"
    kinds = {kind for _, _, kind in ours}
    if {"VAR_POSITIONAL", "VAR_KEYWORD"} <= kinds and len(ours) == len(real) == 2:
        return "same"
    positional = [row for row in ours if row[2] != "KEYWORD_ONLY"]
    extra = [row for row in ours if row not in real]
    is_wider = [row for row in positional if row in real] == real and all(default for _, default, _ in extra)
    return "wider" if is_wider else "differs"


def shown(value: Any) -> str:
    """Return a signature in Python's syntax."""
    if not isinstance(value, list):
        return "" if value is None else str(value)
    stars = {"VAR_POSITIONAL": "*", "VAR_KEYWORD": "**"}
    words, after_star = [], False
    for name, default, kind in value:
        if kind == "KEYWORD_ONLY" and not after_star:
            words.append("*")
        after_star = after_star or kind in {"VAR_POSITIONAL", "KEYWORD_ONLY"}
        words.append(stars.get(kind, "") + name + (f"={default}" if default else ""))
    return f"({', '.join(words)})"


def rows_of(module: str, real: dict[str, Any], ours: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return (name, real signature, state, note) of a module's names; of those that it only re-exports, the missing ones."""
    rows = []

    for name, is_real in sorted(real.items(), key=lambda item: item[0].lower()):
        is_ours = ours.get(name)
        listed_at_home = is_real["home"] != module and is_real["home"] in (*ROSPY, *AROUND, *FRAMES)
        if is_ours is None and listed_at_home and name not in REASONS:
            continue

        if is_ours is None:
            rows.append(
                (
                    name,
                    shown(is_real["is"]),
                    "left out" if name in REASONS else "missing",
                    REASONS.get(name, ""),
                )
            )
            continue

        if is_ours.get("refuses"):
            rows.append((name, shown(is_real["is"]), "left out", "refuses by name"))
            continue
        passed_on = (
            module != "rospy" and is_real["home"] not in {module, ""} and "impl" not in is_real["home"]
        )
        if passed_on:
            continue
        state = compare(is_real["is"], is_ours["is"])
        rows.append(
            (name, shown(is_real["is"]), state, "" if state == "same" else f"ours: `{shown(is_ours['is'])}`")
        )

        for member, signature in is_real.get("members", {}).items():
            at = f"{name}.{member}"
            if member not in is_ours.get("members", {}):
                rows.append((at, shown(signature), "left out" if member in MEMBERS_INSIDE else "missing",
                             MEMBERS_INSIDE.get(member, "")))  # fmt: skip
                continue
            theirs = is_ours["members"][member]
            state = compare(signature, theirs)
            rows.append((at, shown(signature), state, "" if state == "same" else f"ours: `{shown(theirs)}`"))

    return rows


def page(title: str, modules: list[str], real: Description, ours: Description) -> str:
    """Return a page's text."""
    tables, counts = [], Counter[str]()
    for module in modules:
        rows = rows_of(module, real[module], ours[module])
        counts.update(state for _, _, state, _ in rows)
        lines = [f"| `{name}` | `{signature}` | {state} | {note} |" for name, signature, state, note in rows]
        lines = [line.replace("| `` |", "| |") for line in lines]
        tables.append(
            f"## {module}\n\n| name | real ROS | ours | |\n|---|---|---|---|\n" + "\n".join(lines) + "\n"
        )
    total = ", ".join(
        f"{counts[state]} {state}" for state in ("same", "wider", "differs", "left out", "missing")
    )
    return f"""# {title}

Generated by `tests/referee/compare_surface.py` from a real ROS 1 (Debian's) and ours: do not edit. `--check` checks
that it is up to date.

{total}.

*same*: the same parameters and defaults (of a constant: the same value). *wider*: every call that real ROS takes, ours
takes too. *left out*: an inside that nothing else has a use for. Names that a module only passes on from
another are listed once, where they are at home. The `__module__` of a class, which its repr shows, names ours. What the functions
do is compared by the programs in `tests/referee/cases`; each name called with nothing, None, wrong types and the normal case, by
`tests/interop/test_interop_called_names.py`, whose differences are in `called_names.json` next to it, each with its reason.

""" + "\n".join(tables)


def submodule_tables(real: dict[str, list[str]], ours: dict[str, list[str]]) -> str:
    """Return the sections on submodules, and on names that start with an underscore."""
    lacking = [name for name in real if name not in ours]
    rows = [f"| `{name}` | {reason_of(name)} |" for name in sorted(lacking)]
    lines = [
        "## Submodules",
        "",
        f"{len(real) - len(lacking)} of real ROS's {len(real)} submodules can be imported here too. These cannot:",
        "",
        "| module | what it is |",
        "|---|---|",
        *rows,
        "",
        "## Names that start with an underscore",
        "",
        "Functions and classes of real ROS's modules that are private by their name; programs use some of them all the same.",
        "",
        "| module | here too | not here |",
        "|---|---|---|",
    ]
    for name in sorted(real):
        if name in ours and real[name]:
            here = [each for each in real[name] if each in ours[name]]
            gone = [each for each in real[name] if each not in ours[name]]
            lines.append(f"| `{name}` | {_code(here)} | {_code(gone)} |")
    return "\n".join([*lines, ""])


def _code(names: list[str]) -> str:
    return " ".join(f"`{name}`" for name in names)


def reason_of(module: str) -> str:
    """Return the reason why a submodule is not offered."""
    return next(reason for start, reason in NOT_OFFERED.items() if module.startswith(start))


NOT_OFFERED = {
    "genpy": "genpy's own compiler; ours is minirospy.core.idl",
    "genmsg": "the inside of message generators, which CMake runs",
    "catkin": "what catkin's CMake macros and its release tools run",
    "roslib": "of rosbuild: use rospkg",
    "rospkg.rosversion": "the command `rosversion`",
    "rospkg.stack": "stacks are of rosbuild",
    "roslaunch": "the inside of roslaunch's processes on other machines",
    "roswtf": "roswtf's own checks; ours are `minirospy doctor`",
    "rosunit": "the inside of the command `rosunit`",
    "rospy.impl": "rospy's threads and sockets; ours are minirospy.runtime",
    "": "its command's inside",
}
"""Prefix of a module's name -> what it is."""


def described_by(python: str, option: str = "--describe") -> dict[str, Any]:
    done = subprocess.run([python, __file__, option], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{python}: {done.stderr.strip()}")
    description: dict[str, Any] = json.loads(done.stdout)
    return description


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--check", action="store_true", help="compare with the page that is there, write nothing"
    )
    parser.add_argument(
        "--describe", action="store_true", help="print what this interpreter's rospy offers, as JSON"
    )
    parser.add_argument(
        "--private", action="store_true", help="print this interpreter's private names, as JSON"
    )
    parser.add_argument("--all-private", action="store_true", help="print those of other modules as well")
    options = parser.parse_args()
    if options.describe:
        print(json.dumps(describe()))
        return 0
    if options.private or options.all_private:
        print(json.dumps(private_names(options.all_private)))
        return 0
    real, ours = described_by(REAL_PYTHON), described_by(sys.executable)
    submodule_text = submodule_tables(
        described_by(REAL_PYTHON, "--private"), described_by(sys.executable, "--all-private")
    )
    pages = {
        DOCS / "compatibility" / "rospy.md": page("rospy and minirospy, name by name", ROSPY, real, ours),
        DOCS / "compatibility" / "modules.md": page(
            "rosgraph, rosnode, rostopic and their kin and minirospy, name by name", AROUND, real, ours
        )
        + "\n"
        + submodule_text,
        DOCS / "compatibility" / "tf.md": page(
            "tf2_ros, tf and PyKDL and minirospy, name by name", FRAMES, real, ours
        ),
    }
    status = 0

    for path, text in pages.items():
        if not options.check:
            path.write_text(text)
            print(path.name, *text.split("\n\n")[2:3])
        elif not path.exists() or path.read_text() != text:
            print(f"{path} is not up to date: run {sys.executable} {__file__}", file=sys.stderr)
            status = 1

    return status


if __name__ == "__main__":
    sys.exit(main())
