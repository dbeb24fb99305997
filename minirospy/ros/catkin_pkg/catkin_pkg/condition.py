"""catkin_pkg.condition: conditions in package.xml, format 3. Source: https://ros.org/reps/rep-0149.html."""

from __future__ import annotations

from collections.abc import Mapping

from minirospy.workspace import manifest

__all__ = ["evaluate_condition"]


def evaluate_condition(condition: str | None, context: Mapping[str, str]) -> bool:
    """Return whether a condition is true; None counts as true. Raise ValueError if the condition is invalid."""
    if condition is None:
        return True
    try:
        return manifest.evaluate_condition(condition, context)
    except ValueError as error:
        raise ValueError(f"condition '{condition}' failed to parse: {error}") from error
