"""Trees as SVG: the SVG is well-formed and contains each node once, and no name becomes a tag."""

from __future__ import annotations

from xml.etree import ElementTree

from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.tree_svg import Edge, tree_svg

NAMES = st.sampled_from(["a", "b", "c", "d", "<script>", "ü&"])


def texts_of(svg: str) -> list[str]:
    return [each.text or "" for each in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]


@given(st.lists(st.builds(Edge, NAMES, NAMES, st.just(("label",)))))
def test_any_graph_is_drawn(edges: list[Edge]) -> None:
    names = {edge.parent for edge in edges} | {edge.child for edge in edges}
    texts = texts_of(tree_svg(edges, "title"))
    assert sorted(set(texts) - {"title", "label"}) == sorted(names)


def test_children_are_below_their_parent() -> None:
    svg = ElementTree.fromstring(tree_svg([Edge("a", "b"), Edge("a", "c"), Edge("b", "d", ("x", "y"))], ""))
    places = {
        each.text: (float(each.attrib["x"]), float(each.attrib["y"]))
        for each in svg.iter("{http://www.w3.org/2000/svg}text")
    }
    assert places["a"][1] < places["b"][1] == places["c"][1] < places["d"][1]
    assert places["b"][0] < places["a"][0] < places["c"][0]


def test_deep_trees_are_drawn() -> None:
    edges = [Edge(f"n{number}", f"n{number + 1}") for number in range(2000)]
    assert len(texts_of(tree_svg(edges, "deep"))) == 2002


def test_single_nodes_are_drawn() -> None:
    assert texts_of(tree_svg([], "t", alone=["only"])) == ["t", "only"]
