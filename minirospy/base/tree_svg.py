"""Draw a tree with labelled edges as SVG text, for machines without graphviz. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

__all__ = ["Edge", "tree_svg"]

_LETTER, _LINE = 7.2, 16
_GAP_X, _GAP_Y, _HEIGHT = 24, 28, 28
_STYLE = (
    "text{font:12px monospace;text-anchor:middle}rect,ellipse{fill:white;stroke:black}"
    "line{stroke:black}.round{stroke:blue}"
)


class Edge(NamedTuple):
    """An arrow from a parent to its child. The lines of ``label`` are drawn next to it."""

    parent: str
    child: str
    label: tuple[str, ...] = ()


def tree_svg(
    edges: Sequence[Edge], title: str, *, alone: Iterable[str] = (), round_: Iterable[str] = ()
) -> str:
    """Return an SVG drawing of one or several trees, with the roots at the top.

    ``alone``: nodes without an edge. ``round_``: nodes drawn as ellipses. A node with several parents is drawn once, below
    the first one.
    """
    children: dict[str, list[Edge]] = {name: [] for name in alone}
    below: set[str] = set()
    for edge in edges:
        children.setdefault(edge.parent, [])
        children.setdefault(edge.child, [])
        if edge.child not in below and edge.child != edge.parent:
            below.add(edge.child)
            children[edge.parent].append(edge)

    drawing = _Drawing(children, frozenset(round_))
    right = float(_GAP_X)
    # Draw the roots first. Any nodes left after that are part of a cycle.
    for name in [*(name for name in children if name not in below), *children]:
        if name not in drawing.places:
            right = drawing.place(name, right)
    return drawing.text(title, right)


class _Drawing:
    def __init__(self, children: dict[str, list[Edge]], round_: frozenset[str]) -> None:
        self._children = children
        self._round = round_
        self.places: dict[str, tuple[float, float]] = {}

    def place(self, root: str, left: float) -> float:
        """Place a tree to the right of ``left``; return its right edge."""
        # Use an explicit list for the way down and back up: recursion would exhaust Python's stack for deep trees.
        order: list[tuple[str, float]] = []
        waiting = [(root, float(_GAP_Y + _LINE))]
        seen = set()
        while waiting:
            name, y = waiting.pop()
            if name in seen or name in self.places:
                continue
            seen.add(name)
            order.append((name, y))
            lines = max((len(edge.label) for edge in self._children[name]), default=0)
            below = y + _HEIGHT + _GAP_Y + lines * _LINE
            waiting += [(edge.child, below) for edge in reversed(self._children[name])]

        for name, y in order:
            if not self._children[name]:
                half = self._width(name) / 2
                self.places[name] = (left + half, y)
                left += 2 * half + _GAP_X
        for name, y in reversed(order):
            if name not in self.places:
                xs = [
                    self.places[edge.child][0] for edge in self._children[name] if edge.child in self.places
                ]
                x = (xs[0] + xs[-1]) / 2 if xs else left
                self.places[name] = (x, y)
                left = max(left, x + self._width(name) / 2 + _GAP_X)
        return left

    def _width(self, name: str) -> float:
        """Return a node's width, including the label above it."""
        labels = [
            len(line)
            for edges in self._children.values()
            for edge in edges
            if edge.child == name
            for line in edge.label
        ]
        return max([len(name) + 3, *labels]) * _LETTER

    def text(self, title: str, width: float) -> str:
        height = max((y for _, y in self.places.values()), default=0.0) + _HEIGHT + _GAP_Y
        width = max(width, len(title) * _LETTER + 2 * _GAP_X)
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}">',
            f"<style>{_STYLE}</style>",
            '<defs><marker id="a" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
            '<path d="M0 0L8 4L0 8z"/></marker></defs>',
            f'<text x="{width / 2:.0f}" y="{_LINE}">{escape(title)}</text>',
        ]
        for parent, edges in self._children.items():
            lines += [line for edge in edges for line in self._edge(parent, edge)]
        lines += [line for name in self.places for line in self._node(name)]
        return "\n".join([*lines, "</svg>\n"])

    def _edge(self, parent: str, edge: Edge) -> list[str]:
        (x1, y1), (x2, y2) = self.places[parent], self.places[edge.child]
        middle = (x1 + x2) / 2
        top = (y1 + _HEIGHT + y2) / 2 - (len(edge.label) - 1) * _LINE / 2
        line = (
            f'<line x1="{x1:.0f}" y1="{y1 + _HEIGHT:.0f}" x2="{x2:.0f}" y2="{y2:.0f}" marker-end="url(#a)"/>'
        )
        return [line] + [
            f'<text x="{middle:.0f}" y="{top + number * _LINE:.0f}">{escape(text)}</text>'
            for number, text in enumerate(edge.label)
        ]

    def _node(self, name: str) -> list[str]:
        x, y = self.places[name]
        half = (len(name) + 2) * _LETTER / 2
        shape = f'<rect x="{x - half:.0f}" y="{y:.0f}" width="{2 * half:.0f}" height="{_HEIGHT}"/>'
        if name in self._round:
            cy = y + _HEIGHT / 2
            shape = (
                f'<ellipse class="round" cx="{x:.0f}" cy="{cy:.0f}" rx="{half:.0f}" ry="{_HEIGHT / 2:.0f}"/>'
            )
        return [shape, f'<text x="{x:.0f}" y="{y + _HEIGHT / 2 + 4:.0f}">{escape(name)}</text>']
