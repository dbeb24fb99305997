"""rospy's internal variables that programs read and set, as properties of their modules.

`import rospy` imports this module last, because this module needs the others.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import rospy.client
import rospy.core
import rospy.names
import rospy.rostime

from minirospy.client.identity import Identity
from minirospy.client.session import current_session, replace_session
from minirospy.client.time import get_rostime
from minirospy.ros.rospy.rospy.rostime import (
    is_rostime_initialized,
    is_wallclock,
    set_rostime,
    set_rostime_initialized,
)

__all__: list[str] = []


_Get = Callable[[], object]
_Put = Callable[[Any], object]


def _install(module: ModuleType, **names: tuple[_Get, _Put]) -> None:
    """Add attributes to ``module``. ``names`` maps each attribute to two functions: one returns its value, the other sets it.

    Deleting an attribute restores its previous value, because unittest.mock deletes it at the end of a patch.
    """

    def attribute(get: _Get, put: _Put) -> property:
        before: list[object] = []

        def replace(_: ModuleType, value: object) -> None:
            before[:] = [get()]
            put(value)

        def restore(_: ModuleType) -> None:
            for value in before:
                put(value)

        return property(lambda _: get(), replace, restore)

    kind = type("module", (ModuleType,), {name: attribute(*both) for name, both in names.items()})
    module.__class__ = kind


def _restart_unless(value: object) -> None:
    if not value:
        replace_session()


# Programs reset these flags to start another node after the first one has shut down.
_install(
    rospy.core,
    _shutdown_flag=(lambda: current_session().is_shutdown(), _restart_unless),
    _in_shutdown=(lambda: current_session().lifecycle.is_shutdown_requested, _restart_unless),
    _client_shutdown_hooks=(
        lambda: current_session().lifecycle.hooks,
        lambda value: current_session().lifecycle.hooks.__setitem__(slice(None), value),
    ),
)
_install(
    rospy.client,
    _init_node_args=(lambda: current_session().init_arguments, _restart_unless),
)
_install(
    rospy.rostime,
    _rostime_initialized=(is_rostime_initialized, set_rostime_initialized),
    _rostime_current=(lambda: None if is_wallclock() else get_rostime(), set_rostime),
)


def _identity() -> Identity:
    return current_session().identity


_install(
    rospy.names,
    _mappings=(lambda: _identity().mappings, lambda value: setattr(_identity(), "mappings", value)),
    _resolved_mappings=(
        lambda: _identity().remappings,
        lambda value: setattr(_identity(), "remappings", value),
    ),
    # Setting a new name keeps the namespace, as in rospy, which stores them separately.
    _caller_id=(
        lambda: _identity().name,
        lambda value: _identity().be_called(value, _identity().namespace),
    ),
    _caller_namespace=(
        lambda: _identity().namespace,
        lambda value: _identity().be_called(_identity().name, value),
    ),
)
