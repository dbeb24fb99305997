"""roslaunch.arg_dump, filled in by minirospy."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.launch.load import describe_args

__all__ = ["get_args"]


def get_args(roslaunch_files: Sequence[str]) -> dict[str, tuple[str | None, str | None]]:
    """The args that launch files declare: name -> (doc, default)."""
    return {arg.name: (arg.doc, arg.default) for file in roslaunch_files for arg in describe_args(file)}
