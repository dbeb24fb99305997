"""Finds rosbag's message migration, and imports its modules only when they are used.

No other module refers to these modules. If their folder and `rosbag/migration.py` are deleted, only the verbs and
programs for migration are missing.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.command.verbs import Verb

__all__ = ["migration_scripts", "migration_verbs"]

_MIGRATION = "minirospy.ros.rosbag.migration"


def migration_verbs() -> tuple[Verb, ...]:
    """Return the verbs `rosbag check` and `rosbag fix`."""
    module = _module("verbs")
    return module.VERBS if module else ()


def migration_scripts() -> dict[str, Callable[[list[str]], int]]:
    """Return a dict from the names of the migration programs to the programs."""
    module = _module("scripts")
    return module.SCRIPTS if module else {}


def _module(name: str) -> ModuleType | None:
    """Return a module of the package ``migration``, or None if that package has been deleted."""
    try:
        return importlib.import_module(f"{_MIGRATION}.{name}")
    except ModuleNotFoundError as error:
        if error.name != _MIGRATION:
            raise
        return None
