"""Add messages to the plans: those that no add_message_files() lists, but that other definitions use as fields.

Real catkin builds such a package, because it finds the file when it computes the md5sum of the containing type. However,
it generates no class for the message, so Python programs cannot create the message. Here the class is generated, with a
warning.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping
from pathlib import Path

from minirospy.core.idl.load import read_definition
from minirospy.workspace.plan import Plan

__all__ = ["with_unlisted"]

_FIELD = re.compile(
    r"^[ \t]*((?:\w+/)?[A-Za-z]\w*)(?:\[\d*\])?[ \t]+\w+[ \t]*(?:#|$)", re.ASCII | re.MULTILINE
)


def with_unlisted(plans: Mapping[str, Plan]) -> dict[str, Plan]:
    """Return the plans; add messages to their definitions that are used but not listed in CMakeLists.txt.

    Raise DefinitionError if a definition is invalid.
    """
    # Find the unlisted messages first: most workspaces have none, and then no definition needs to be read.
    unlisted = {
        f"{plan.name}/{path.stem}": path
        for plan in plans.values()
        if plan.definitions
        for path in sorted((plan.folder / "msg").glob("*.msg"))
        if path not in plan.definitions
    }
    used: dict[str, tuple[Path, Path]] = {}
    waiting = deque((plan.name, path) for plan in plans.values() if unlisted for path in plan.definitions)
    while waiting:
        package, user = waiting.popleft()
        for name in _FIELD.findall(read_definition(user)):
            full_name = name if "/" in name else f"{package}/{name}"
            if full_name in unlisted and full_name not in used:
                used[full_name] = (unlisted[full_name], user)
                waiting.append((full_name.partition("/")[0], unlisted[full_name]))

    found = dict(plans)
    for full_name, (path, user) in sorted(used.items()):
        plan = found[full_name.partition("/")[0]]
        others = tuple(warning for warning in plan.warnings if not warning.startswith(f"{path} is not built"))
        found[plan.name] = plan._replace(
            definitions=(*plan.definitions, path),
            not_installed=plan.not_installed | {path},
            warnings=(
                *others,
                f"{path}: no add_message_files() names it, but {user} has it: ROS would make no class of it",
            ),
        )
    return found
