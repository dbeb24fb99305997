"""Names of rospy's inside that programs read, and set: each is asked for, or told, when it is used."""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

__all__ = ["live_names"]


def live_names(module: str, **names: tuple[Callable[[], Any], Callable[[Any], object]]) -> None:
    """Give the module ``module`` attributes: a function that gives the value, and one that takes a new one.

    To delete one brings back the value before, which is how unittest.mock ends a patch.
    """

    def attribute(get: Callable[[], Any], put: Callable[[Any], object]) -> property:
        before: list[Any] = []

        def replace(_: ModuleType, value: Any) -> None:
            before[:] = [get()]
            put(value)

        def restore(_: ModuleType) -> None:
            for value in before:
                put(value)

        return property(lambda _: get(), replace, restore)

    kind = type("module", (ModuleType,), {name: attribute(*both) for name, both in names.items()})
    sys.modules[module].__class__ = kind
