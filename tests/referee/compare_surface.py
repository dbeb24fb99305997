"""Every public name and signature of real rospy beside ours: writes docs/rospy_compatibility.md.

    .venv/bin/python tests/referee/compare_surface.py            write the page
    .venv/bin/python tests/referee/compare_surface.py --check    exit status 1 where it would change

Real rospy is what /usr/bin/python3 imports. The same file describes one of the two with --describe, so it runs
under both.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import json
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

MODULES = [
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
REAL_PYTHON = "/usr/bin/python3"
PAGE = Path(__file__).resolve().parents[2] / "docs" / "rospy_compatibility.md"
OF_ROS = ("rospy", "genpy", "rosgraph", "roscpp", "std_msgs", "rosgraph_msgs", "minirospy")
REASONS = {
    "LoggingIdentical": "bookkeeping inside rospy's log functions",
    "LoggingOnce": "bookkeeping inside rospy's log functions",
    "LoggingThrottle": "bookkeeping inside rospy's log functions",
    "configure_logging": "called by rospy's own init_node",
    "deprecated": "a decorator for rospy's own use",
    "set_initialized": "called by rospy's own init_node",
    "set_node_uri": "called by rospy's own init_node",
    "get_rostime_cond": "the lock inside rospy's simulated time",
    "Poller": "rospy's select loop; ours is asyncio's",
    "QueuedConnection": "rospy's thread each connection; ours has an outbox",
    "SubscriberStatisticsLogger": "rospy's inside of topic statistics",
    "get_registration_listeners": "rospy's inside of registration",
    "set_topic_manager": "rospy's inside of registration",
    "get_tcpros_handler": "rospy's inside of TCPROS",
    "ServiceManager": "rospy's inside of registration",
    "set_service_manager": "rospy's inside of registration",
    "Transport": "rospy's inside of TCPROS",
    "DeadTransport": "rospy's inside of TCPROS",
    "ProtocolHandler": "rospy's inside of TCPROS",
    "TIMEOUT_READY": "not used by rospy itself",
    "python3": "a leftover of Python 2",
}
"""Why a name of real rospy is not offered: nothing but rospy itself has a use for it."""

MEMBERS_INSIDE = {
    "acquire_impl": "rospy's inside",
    "release_impl": "rospy's inside",
    "handle": "rospy's inside",
    "emit": "logging's own",
    "get_num_connections": "Publisher and Subscriber have it",
    "unregister": "Publisher and Subscriber have it",
    "error_handler": "rospy's inside",
}

Description = dict[str, dict[str, Any]]


def describe() -> Description:
    """Module -> name -> its home module and what it is, for the rospy of this interpreter."""
    return {
        module: {
            name: value
            for name in dir(importlib.import_module(module))
            if not name.startswith("_") and (value := describe_value(getattr(sys.modules[module], name)))
        }
        for module in MODULES
    }


def describe_value(value: Any) -> dict[str, Any] | None:
    """What there is to compare of a value; None of one that is not rospy's own."""
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
        return {"home": home, "is": parameters(value), "members": members, "class": True}
    if callable(value) and (home.startswith(OF_ROS) or home == "logging" or inspect.ismethod(value)):
        return {"home": home, "is": parameters(value)}
    return None


def parameters(value: Any) -> list[list[str]] | None:
    """[name, default, kind] of each parameter; None where that cannot be told."""
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
    return re.sub(r"<.*_?Unspecified object at .*>", "<unspecified>", repr(default))


def compare(real: Any, ours: Any) -> str:
    """same; wider: every call that real rospy takes, ours takes too; differs."""
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
    """A signature as it is written."""
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
    """(name, real's signature, state, note) of a module; of what it only passes on, just what is missing."""
    rows = []
    for name, is_real in sorted(real.items(), key=lambda item: item[0].lower()):
        is_ours = ours.get(name)
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


def page(real: Description, ours: Description) -> str:
    """The page's text."""
    tables, counts = [], Counter[str]()
    for module in MODULES:
        rows = rows_of(module, real[module], ours[module])
        counts.update(state for _, _, state, _ in rows)
        lines = [f"| `{name}` | `{signature}` | {state} | {note} |" for name, signature, state, note in rows]
        lines = [line.replace("| `` |", "| |") for line in lines]
        tables.append(
            f"## {module}\n\n| name | real rospy | ours | |\n|---|---|---|---|\n" + "\n".join(lines) + "\n"
        )
    total = ", ".join(
        f"{counts[state]} {state}" for state in ("same", "wider", "differs", "left out", "missing")
    )
    return f"""# rospy beside minirospy, name by name

Generated by `tests/referee/compare_surface.py` from a real rospy (Debian's) and ours: do not edit. `--check` tells
whether it is up to date.

{total}.

*same*: the same parameters and defaults (of a constant: the same value). *wider*: every call that real rospy takes, ours
takes too. *left out*: the inside of rospy, which nothing else has a use for. Names that a module only passes on from
another are listed once, where they are at home; here only where they are not there. What the functions do is
compared by the programs in `tests/referee/cases`.

""" + "\n".join(tables)


def described_by(python: str) -> Description:
    done = subprocess.run([python, __file__, "--describe"], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{python}: {done.stderr.strip()}")
    description: Description = json.loads(done.stdout)
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
    options = parser.parse_args()
    if options.describe:
        print(json.dumps(describe()))
        return 0
    text = page(described_by(REAL_PYTHON), described_by(sys.executable))
    if options.check:
        if PAGE.exists() and PAGE.read_text() == text:
            return 0
        print(f"{PAGE} is not up to date: run {sys.executable} {__file__}", file=sys.stderr)
        return 1
    PAGE.write_text(text)
    print(*text.split("\n\n")[2:3])
    return 0


if __name__ == "__main__":
    sys.exit(main())
