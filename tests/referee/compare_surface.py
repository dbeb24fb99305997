"""Compare every public name and signature of rospy and similar modules in real ROS and minirospy: write three pages of docs.

docs/compatibility/rospy.md compares rospy; docs/compatibility/modules.md rosgraph, rosnode, rostopic and similar modules;
docs/compatibility/tf.md tf2_ros, tf and PyKDL. The modules are all that minirospy's overlay has and real ROS, too. Also writes
minirospy/ros/passed_on.json: the names that stars bring in real ROS (`os`, `rospy`).

    .venv/bin/python tests/referee/compare_surface.py            write the pages
    .venv/bin/python tests/referee/compare_surface.py --check    exit status 1 if one would change

Real rospy is the one that /usr/bin/python3 imports. With --describe, the same file describes one of the two, so it runs
under both.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import importlib.util
import inspect
import json
import os
import pkgutil
import re
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

try:
    from minirospy.ros import overlay_modules
except ImportError:  # in real ROS's interpreter
    overlay_modules = None  # type: ignore[assignment]

REAL_PYTHON = "/usr/bin/python3"
DOCS = Path(__file__).resolve().parents[2] / "docs"
OF_THE_C_CODE = ("_tf2", "tf2", "minirospy")  # homes of classes that no emulated module is named after


@functools.cache
def emulated_modules() -> tuple[str, ...]:
    """Return the modules that minirospy offers under the names of ROS's packages, without generated messages.

    In real ROS's interpreter the list comes from the environment, as the first process found it.
    """
    if LISTED in os.environ:
        return tuple(os.environ[LISTED].split())
    return tuple(sorted(name for name in overlay_modules.modules() if not name.startswith("RPi")))


LISTED = "COMPARED_MODULES"
"""The variable that passes :func:`emulated_modules` to the other interpreter."""


@functools.cache
def of_ros() -> frozenset[str]:
    """Return the packages whose functions and classes are compared."""
    return frozenset(
        {*(name.partition(".")[0] for name in emulated_modules()), *OF_THE_C_CODE, "std_msgs", "roscpp"}
    )


def page_of(module: str) -> str:
    """Return the page that lists a module: rospy, tf or modules."""
    package = module.partition(".")[0]
    if package == "rospy":
        return "rospy"
    return "tf" if package == "PyKDL" or re.fullmatch("tf|tf2_.*|tf_.*", package) else "modules"


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
    **dict.fromkeys(("ROS_LOG_DIR",), "the inside of rospy's logging"),
}
"""The reasons why names in real rospy are not offered, by name: only rospy itself uses them."""

LEFT_OUT = [
    (
        "actionlib",
        "s_goalcount s_goalcount_lock ActionServer.publish_status_async",
        "the inside of actionlib",
    ),
    ("bondpy", "BondSM_sm", "the inside of Bond's state machine"),
    ("camera_calibration_parsers", "camera_calibration_parsers_wrapper", "the module in C++"),
    (
        "dynamic_reconfigure",
        "ParameterGenerator.deleteobsolete ParameterGenerator.deleteoneobsolete ParameterGenerator.mkdir",
        "the generator's inside",
    ),
    ("genpy.generator", "*", "genpy's own compiler; ours is minirospy.core.idl"),
    ("image_geometry.cameramodels", "cv2", "passed on from OpenCV, which is not needed here"),
    ("resource_retriever", "r", "a variable of the module's own loop"),
    ("rosbag.bag", "AES gnupg roslz4", "passed on from libraries that are not needed here"),
    ("rosbag.rosbag_main", "*", "the inside of the command rosbag"),
    ("roslaunch.config", "load_roscore", "there is no launch file for the master's own nodes"),
    ("roslaunch.launch", "*", "the inside of roslaunch's runner"),
    ("roslaunch.loader", "*", "the inside of roslaunch's reader; ours is minirospy.ros.roslaunch.launcher"),
    ("roslaunch.nodeprocess", "*", "the inside of roslaunch's processes"),
    ("roslaunch.pmon", "*", "the inside of roslaunch's processes"),
    ("roslaunch.remote", "*", "the inside of roslaunch's processes on other machines"),
    ("roslaunch.server", "*", "the inside of roslaunch's processes on other machines"),
    (
        "roslaunch.xmlloader",
        "*",
        "the inside of roslaunch's reader; ours is minirospy.ros.roslaunch.launcher",
    ),
    ("roslib", "manifestlib stack_manifest Manifest.xml", "of rosbuild: use rospkg"),
    ("rosmaster.master_api", "apivalidate ROSMasterHandler.param_update_task", "the inside of rosmaster"),
    ("rosmaster.threadpool", "*", "the inside of the pool of threads"),
    (
        "catkin_pkg.package",
        "parse_package_for_distutils",
        "deprecated: use catkin_pkg.python_setup.generate_distutils_setup",
    ),
    ("catkin_pkg", "terminal_color", "for the scripts of catkin_pkg"),
    (
        "catkin_pkg.condition",
        "infixNotation pp",
        "passed on from the library pyparsing, which is not needed here",
    ),
    ("rospkg.distro", "*", "the distributions before catkin, whose files are no longer on the web"),
    ("rospkg.manifest", "*", "the inside of parse_manifest"),
    ("rospkg.os_detect", "distro", "passed on from the library distro, which is not needed here"),
    ("rospkg.rospack", "*", "the inside of ManifestManager"),
    ("rospy.impl", "*", "rospy's threads and sockets; ours are minirospy.runtime"),
    ("rospy.rosconsole", "*", "the inside of the command rosconsole"),
    ("rostest.rostest_main", "write_bad_filename_failure", "the inside of the command rostest"),
    ("rosunit.baretest", "*", "the inside of the command rosunit"),
    ("rosunit.junitxml", "RE_XML_ILLEGAL pattern", "the source of invalid_chars"),
    ("rosunit.pmon", "*", "the inside of the command rosunit"),
    ("rosunit.rosunit_main", "BareTestCase", "the inside of the command rosunit"),
    ("", "logger", "the module's own logger"),
]
"""(module or the start of its name, names or "*", the reason why they are not offered)."""

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


def private_names(not_only_own: bool = False) -> dict[str, list[str]]:
    """Return each submodule's functions and classes whose names start with an underscore, or all of its names."""
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
    """Return the importable modules of the emulated packages, without generated messages."""
    found = []
    for package in sorted({name.partition(".")[0] for name in emulated_modules()}):
        try:
            path = getattr(importlib.import_module(package), "__path__", [])
        except ImportError:  # in real ROS: not installed
            continue
        names = [module.name for module in pkgutil.walk_packages(path, f"{package}.", lambda name: None)]
        found += [package, *names]
    kept = [name for name in found if not re.search(r"\.(msg|srv|cfg)(\.|$)|__main__", name)]
    return [name for name in kept if importlib.util.find_spec(name) is not None]


def describe() -> Description:
    """Return module -> name -> its home module and what it is, for the modules that this interpreter has."""
    found: Description = {}
    for module in emulated_modules():
        try:
            imported = importlib.import_module(module)
        except ImportError:
            continue
        found[module] = {
            name: value
            for name in sorted({*dir(imported), *getattr(imported, "__all__", ())})
            if not name.startswith("_") and (value := describe_value(getattr(imported, name)))
        }
    return found


def stars() -> dict[str, list[str]]:
    """Return module -> the names that `from MODULE import *` brings, for the modules that this interpreter has."""
    found = {}
    for module in emulated_modules():
        names: dict[str, object] = {}
        try:
            exec(f"from {module} import *", names)
        except ImportError:
            continue
        found[module] = sorted(name for name in names if not name.startswith("__"))
    return found


def origins() -> dict[str, dict[str, list[str]]]:
    """Return module without ``__all__`` -> name that its star brings from elsewhere -> the places that also have it."""
    places = [*emulated_modules(), *STANDARD]
    homes: dict[int, list[str]] = {}
    kept = []
    for place in places:
        try:
            variables = vars(importlib.import_module(place))
        except ImportError:
            continue
        for name, value in variables.items():
            homes.setdefault(id(value), []).append(f"{place}:{name}")
            kept.append(value)  # so that its id is not given to another object
    found: dict[str, dict[str, list[str]]] = {}
    for module, names in stars().items():
        imported = sys.modules[module]
        if hasattr(imported, "__all__"):
            continue
        found[module] = {}
        for name in names:
            value = getattr(imported, name)
            if inspect.ismodule(value):
                found[module][name] = [value.__name__]
            elif (
                (home := getattr(value, "__module__", ""))
                and home != module
                and not isinstance(value, (int, str))
            ):
                own = f"{home}:{getattr(value, '__name__', name)}"
                found[module][name] = [own, *homes.get(id(value), [])]
            elif not (home == module and (inspect.isroutine(value) or inspect.isclass(value))):
                found[module][name] = [each for each in homes.get(id(value), []) if each.endswith(f":{name}")]
    return found


ELSEWHERE = {
    "_hashlib:openssl_md5": "hashlib:md5",
    "_thread:allocate_lock": "threading:Lock",
    "_thread:lock": "threading:Lock",
    "distutils.spawn:find_executable": "shutil:which",
    "imp:reload": "importlib:reload",
    "genericpath:isdir": "os.path:isdir",
    "genericpath:isfile": "os.path:isfile",
    "posix:urandom": "os:urandom",
}
"""Place that is not on every system or in every Python -> one that is."""
NOT_EVERYWHERE = (
    "cv2",
    "gnupg",
    "Cryptodome",
    "tzlocal",
    "dateutil",
    "roslz4",
    "imp",
    "distutils",
    "pwd",
    "fcntl",
    "termios",
    "curses",
)
"""Modules that a star does not bring: not all of minirospy's systems have them."""


def resolve(place: str) -> object:
    """Return what `module` or `module:name` means here; None if it does not exist."""
    module, _, name = place.partition(":")
    try:
        found: object = importlib.import_module(module)
    except ImportError:
        return None
    return getattr(found, name, None) if name else found


def passed_on() -> str:
    """Return the text of minirospy/ros/passed_on.json: what stars bring in real ROS, and here from other modules."""
    table = {}
    for module, names in described_by(REAL_PYTHON, "--origins").items():
        by_place: dict[str, list[str]] = {}
        own = overlay_modules.listed(overlay_modules.modules()[module])
        for name, places in names.items():
            if name in own:
                continue
            for place in places:
                place = re.sub(r"^(\w+\.(?:msg|srv))\._\w+:", r"\1:", ELSEWHERE.get(place, place))  # noqa: PLW2901
                place = re.sub(r"^_(io|heapq|bisect|queue|functools):", r"\1:", place)  # noqa: PLW2901
                start, _, inner = place.partition(":")
                if (start == module and inner) or start.partition(".")[0] in NOT_EVERYWHERE:
                    continue
                if start in overlay_modules.modules() and inner:
                    if inner not in overlay_modules.exported(overlay_modules.modules()[start]):
                        continue
                elif resolve(place) is None and place != "builtins:None":
                    continue
                key, found = (start, inner) if inner else ("", start)
                by_place.setdefault(key, []).append(name if name == found else f"{name}={found}")
                break
        if by_place:
            table[module] = {place: " ".join(sorted(each)) for place, each in sorted(by_place.items())}
    return json.dumps(table, indent=1) + "\n"


PASSED_ON = Path(__file__).resolve().parents[2] / "minirospy" / "ros" / "passed_on.json"


STANDARD = (
    "threading", "queue", "io", "math", "itertools", "functools", "operator", "collections", "xmlrpc.client", "xmlrpc.server",
    "http.server", "urllib.parse", "urllib.request", "subprocess", "socketserver", "errno", "shutil", "copy", "importlib",
    "xml.dom", "xml.dom.minidom", "xml.sax.saxutils", "xml.etree.ElementTree", "hashlib", "argparse", "optparse", "os",
    "os.path", "time", "socket", "select", "yaml", "numpy", "builtins", "string", "datetime", "logging", "__future__",
)  # fmt: skip
"""Modules of Python and of others whose names ROS's modules import one by one."""


def describe_value(value: Any) -> dict[str, Any] | None:
    """Return the parts of a value that are compared, or None if it is not from ROS."""
    if isinstance(value, (bool, int, float, str)):
        return {"home": "", "is": repr(value)}
    home = getattr(value, "__module__", None) or ""
    is_of_ros = home.partition(".")[0] in of_ros()
    if inspect.isclass(value) and (is_of_ros or value.__name__ == "NullHandler"):
        members = {
            name: parameters(member)
            for name in dir(value)
            if not name.startswith("_") and callable(member := getattr(value, name)) and not inspect.isclass(member)
            and not (getattr(member, "__module__", None) or "threading").startswith(("threading", "logging"))
        }  # fmt: skip
        refuses = {"refuses": True} if getattr(value, "_refuses", False) else {}
        return {"home": home, "is": parameters(value), "members": members, "class": True, **refuses}
    if callable(value) and (is_of_ros or home == "logging" or inspect.ismethod(value)):
        return {"home": home, "is": parameters(value)}
    return None


def parameters(value: Any) -> list[list[str]] | None:
    """Return [name, default, kind] for each parameter, or None if it cannot be determined."""
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
    shown = re.sub(r"<.*_?Unspecified object at .*>", "<unspecified>", repr(default))
    shown = re.sub(r"<function (\S+) at 0x[0-9a-f]+>", r"\1", shown)
    return " ".join(re.sub(r"<(?:\S+\.)?(\S+) object at 0x[0-9a-f]+>", r"<\1>", shown).split())


def compare(real: Any, ours: Any) -> str:
    """Return "same", "wider" (minirospy accepts every call that real rospy accepts) or "differs"."""
    if real == ours or real is None:
        return "same"
    if isinstance(real, list) and real and all("VAR" in kind for _, _, kind in real):
        return "same"  # a decorator hides the parameters
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


def reason_for(module: str, name: str) -> str:
    """Return the reason why a name is not offered; an empty string if there is none."""
    if name in REASONS:
        return REASONS[name]
    owner = name.partition(".")[0]
    return next(
        (
            reason
            for start, names, reason in LEFT_OUT
            if module.startswith(start) and (names == "*" or {name, owner} & set(names.split()))
        ),
        MEMBERS_INSIDE.get(name.partition(".")[2], ""),
    )


def rows_of(
    module: str, real: dict[str, Any], ours: dict[str, Any], star: Iterable[str] = ()
) -> list[tuple[str, str, str, str]]:
    """Return (name, real signature, state, note) of a module's names; of those that it only re-exports, the missing ones.

    ``star`` has the names that `from MODULE import *` brings in real ROS only.
    """
    rows = []

    for name, is_real in sorted(real.items(), key=lambda item: item[0].lower()):
        is_ours = ours.get(name)
        listed_at_home = is_real["home"] != module and is_real["home"] in emulated_modules()
        reason = reason_for(module, name)
        if is_ours is None and listed_at_home and not reason and name not in star:
            continue

        if is_ours is None:
            state = "left out" if reason else "missing"
            rows.append((name, shown(is_real["is"]), state, reason))
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
                reason = reason_for(module, at)
                rows.append((at, shown(signature), "left out" if reason else "missing", reason))
                continue
            theirs = is_ours["members"][member]
            state = compare(signature, theirs)
            rows.append((at, shown(signature), state, "" if state == "same" else f"ours: `{shown(theirs)}`"))

    for name in star:
        if name not in real:
            reason = reason_for(module, name)
            rows.append((name, "", "left out" if reason else "missing", reason))
    return rows


Stars = dict[str, list[str]]


def page(title: str, name: str, described: tuple[Description, Description], both: tuple[Stars, Stars]) -> str:
    """Return a page's text, from the descriptions and stars of real ROS and ours."""
    real, ours = described
    of_page = [module for module in ours if page_of(module) == name]
    modules = [module for module in of_page if module in real]
    unknown = [module for module in of_page if module not in real]
    tables, counts = [], Counter[str]()
    for module in modules:
        lacking = sorted({*both[0].get(module, ())} - {*both[1].get(module, ())})
        rows = rows_of(module, real[module], ours[module], lacking)
        if not rows:
            continue
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
`from MODULE import *` brings here all that it brings in real ROS, such as `os` and `rospy`, except the names in the tables.

""" + "\n".join([*tables, *not_compared(unknown)])


def not_compared(modules: list[str]) -> list[str]:
    """Return the section on the modules that the real ROS of the comparison lacks."""
    if not modules:
        return []
    return [
        "## Modules that are not compared\n\nThe real ROS that this page is generated from does not have "
        f"{', '.join(f'`{module}`' for module in modules)}.\n"
    ]


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
"""Descriptions of modules that are not offered, by the prefix of their names."""


def described_by(python: str, option: str = "--describe") -> dict[str, Any]:
    done = subprocess.run(
        [python, "-W", "ignore", __file__, option],
        env={**os.environ, LISTED: " ".join(emulated_modules())},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"{python}: {done.stderr.strip()}")
    description: dict[str, Any] = json.loads(done.stdout)
    return description


def main() -> int:
    warnings.filterwarnings("ignore", "roslib.rospack is deprecated")
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
    parser.add_argument("--stars", action="store_true", help="print what each module's star brings, as JSON")
    parser.add_argument("--origins", action="store_true", help="print where these names come from, as JSON")
    options = parser.parse_args()
    if options.stars or options.origins:
        print(json.dumps(stars() if options.stars else origins()))
        return 0
    if options.describe:
        print(json.dumps(describe()))
        return 0
    if options.private or options.all_private:
        print(json.dumps(private_names(options.all_private)))
        return 0
    pythons = REAL_PYTHON, sys.executable
    described = described_by(pythons[0]), described_by(pythons[1])
    both = described_by(pythons[0], "--stars"), described_by(pythons[1], "--stars")
    submodule_text = submodule_tables(
        described_by(REAL_PYTHON, "--private"), described_by(sys.executable, "--all-private")
    )
    folder = DOCS / "compatibility"
    pages = {
        folder / f"{name}.md": page(f"{title} and minirospy, name by name", name, described, both)
        for name, title in (
            ("rospy", "rospy"),
            ("modules", "rosgraph, rosnode, rostopic and similar modules"),
            ("tf", "tf2_ros, tf and PyKDL"),
        )
    }
    pages[folder / "modules.md"] += "\n" + submodule_text
    pages[PASSED_ON] = passed_on()
    status = 0

    for path, text in pages.items():
        if not options.check:
            path.write_text(text)
            print(path.name, *text.split("\n\n")[2:3] if path.suffix == ".md" else ())
        elif not path.exists() or path.read_text() != text:
            print(f"{path} is not up to date: run {sys.executable} {__file__}", file=sys.stderr)
            status = 1

    return status


if __name__ == "__main__":
    sys.exit(main())
