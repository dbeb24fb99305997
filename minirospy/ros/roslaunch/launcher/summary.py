"""The summary that roslaunch prints before it starts any process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from minirospy.ros.roslaunch.launcher.spec import NodeSpec

__all__ = ["summary"]

_MAX_LENGTH = 20


def summary(
    nodes: Iterable[NodeSpec],
    params: Mapping[str, object],
    clear: Iterable[str],
    machines: Iterable[str] | None = None,
) -> str:
    """Return the summary to print before starting nodes.

    ``machines`` are the names to list; None omits the section MACHINES.
    """
    lines = ["", "SUMMARY", "========", ""]
    cleared = sorted({f" * {name.rstrip('/')}/" for name in clear})
    if cleared:
        lines += ["CLEAR PARAMETERS", *cleared, ""]
    if params:
        lines += ["PARAMETERS", *sorted(f" * {name}: {_short(value)}" for name, value in params.items()), ""]
    if machines is not None:
        lines += ["MACHINES", *(sorted(f" * {name}" for name in machines) or [""]), ""]
    lines += ["NODES"]
    by_namespace: dict[str, list[str]] = {}
    for node in nodes:
        text = f"    {node.base_name} ({node.package}/{node.type})"
        by_namespace.setdefault(node.namespace, []).append(text)
    for namespace, texts in sorted(by_namespace.items()):
        lines += [f"  {namespace}", *sorted(texts)]
    return "\n".join([*lines, ""])


def _short(value: object) -> str:
    text = str(value)
    if len(text) > _MAX_LENGTH:
        text = f"{text[: _MAX_LENGTH - 3]}..."
    text = text.rstrip()
    return text if text.isascii() and text.isprintable() else "<...>"
