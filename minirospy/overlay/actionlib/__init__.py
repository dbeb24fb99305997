"""actionlib: its messages (`actionlib.msg`). Servers and clients of actions are not part of minirospy yet."""

from typing import Any


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    raise NotImplementedError(
        f"actionlib.{name}: this version of minirospy has no actions yet, only actionlib.msg"
    )
