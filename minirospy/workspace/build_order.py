"""The build order of packages, as in catkin, from their manifests.

Source: the behaviour of catkin_pkg.topological_order.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Mapping
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

from minirospy.workspace.dependencies import CircularDependencyError
from minirospy.workspace.manifest import Kind, Manifest

__all__ = ["build_order"]

_BUILT_FROM = (Kind.BUILD, Kind.BUILDTOOL, Kind.TEST)
_RUN_WITH = (Kind.BUILD_EXPORT, Kind.EXEC)


def build_order(
    manifests: Mapping[str, Manifest], also: Mapping[str, Collection[str]] | None = None
) -> list[str]:
    """Return the names of the packages in topological order, so that each follows its build dependencies.

    Among the packages whose dependencies are done, the alphabetically first one is next. A package's build dependencies
    are those that it needs to build and test, their run dependencies, and the packages that ``also`` lists for its name.
    Message generators and their dependencies come first. Raise CircularDependencyError if dependencies form a cycle.
    """
    routes = {name: _routes(name, manifests, (also or {}).get(name, ())) for name in manifests}
    early = _generators(manifests, routes)

    sorter = TopologicalSorter(routes)
    try:
        sorter.prepare()
    except CycleError as error:
        raise CircularDependencyError(_circle(error.args[1], routes)) from error

    ordered: list[str] = []
    ready = [(name not in early, name) for name in sorter.get_ready()]
    heapq.heapify(ready)
    while ready:
        _, name = heapq.heappop(ready)
        ordered.append(name)
        sorter.done(name)
        for each in sorter.get_ready():
            heapq.heappush(ready, (each not in early, each))
    return ordered


def _routes(name: str, manifests: Mapping[str, Manifest], also: Collection[str]) -> dict[str, str]:
    """Return a package's direct and indirect build dependencies, each mapped to the package that requires it."""
    found = dict.fromkeys(sorted({*manifests[name].depends(*_BUILT_FROM), *also} & manifests.keys()), name)
    waiting = list(found)
    for each in waiting:
        for other in manifests[each].depends(*_RUN_WITH):
            if other in manifests and other not in found:
                found[other] = each
                waiting.append(other)
    return found


def _generators(manifests: Mapping[str, Manifest], routes: Mapping[str, Mapping[str, str]]) -> set[str]:
    """Return the packages that export a message generator, and the build dependencies of these packages."""
    waiting = {
        name
        for name, manifest in manifests.items()
        if any(export.tag == "message_generator" for export in manifest.exports)
    }
    found: set[str] = set()
    while waiting:
        name = waiting.pop()
        found.add(name)
        waiting |= routes[name].keys() - found
    return found


def _circle(nodes: list[str], routes: Mapping[str, Mapping[str, str]]) -> tuple[str, ...]:
    """Return the names in a cycle, each followed by one of its dependencies, from the alphabetically first name to itself.

    ``nodes`` is graphlib's cycle: each name before a package that depends on it, with the first name repeated at the end.
    """
    backwards: list[str] = []
    for needed, name in pairwise(nodes):
        backwards.append(needed)
        # Add the packages between the two: ``name`` may require ``needed`` only through their run dependencies.
        between = routes[name][needed]
        while between != name:
            backwards.append(between)
            between = routes[name][between]
    circle = backwards[::-1]
    start = circle.index(min(circle))
    return (*circle[start:], *circle[:start], circle[start])
