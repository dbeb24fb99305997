"""The table in docs/ros2.md: the types in msgs/ that are bridged, and why others are not, based on ROS 2 Jazzy's definitions."""

from __future__ import annotations

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.spec import MessageSpec
from minirospy.ros2.layouts import TypesDiffer, layout_of
from minirospy.ros2.rules import BUILT_IN
from tests.ros2.ros2_definitions import catalogue, ros2_lookup, typestore


def table() -> str:
    """Return the lines of the table: for each package, the bridged types, and the others with the reason."""
    lines = ["| package | bridged | not bridged |", "|---|---|---|"]
    packages = {name.partition("/")[0] for name in typestore().fielddefs}
    elsewhere = []
    for package in sorted(catalogue().packages):
        maps, fails = [], []
        of_actions = {message.name for action in catalogue().actions(package) for message in action.messages}
        for spec in catalogue().messages(package):
            if not _is_known(spec, packages):
                continue
            reason = _reason(spec)
            if spec.name in of_actions:
                continue
            if reason:
                fails.append(f"{spec.name}: {reason}")
            else:
                renamed = BUILT_IN.message(spec.full_name).names
                maps.append(f"{spec.name} (`{renamed[0]}`)" if renamed else spec.name)
        if maps or fails:
            lines.append(f"| {package} | {', '.join(maps)} | {'; '.join(fails)} |")
        elif catalogue().messages(package):
            elsewhere.append(package)
    names = ", ".join(elsewhere)
    lines += ["", f"Not part of ROS 2's base, so that the bridge compares them when it meets them: {names}."]
    return "\n".join(lines)


def _is_known(spec: MessageSpec, packages: set[str]) -> bool:
    name = BUILT_IN.ros2_messages(spec.full_name)[0]
    return name.partition("/")[0] in packages


def _reason(spec: MessageSpec) -> str:
    name = BUILT_IN.ros2_messages(spec.full_name)[0]
    try:
        layout_of(spec, catalogue().message, ros2_lookup(name), ros2_lookup, BUILT_IN)
    except KeyError:
        return "ROS 2 has no such type"
    except (TypesDiffer, DefinitionError) as error:
        return str(error)
    return ""
