"""Nodes and tests of `import roslaunch` as launch-file text: compared with Debian's roslaunch."""

from __future__ import annotations

from roslaunch.core import Node, Test

Test.__test__ = False  # type: ignore[attr-defined]

NODE = """\
<node pkg="p" type="t" machine="m" ns="/a/" args="x &quot;y&quot; &lt;z&gt;" output="screen" cwd="node" respawn="True" \
respawn_delay="2.0" name="n" launch-prefix="gdb" required="False">
  <remap from="a" to="b" />
  <remap from="c" to="d" />
  <env name="E" value="1" />
</node>"""


def test_node_as_text() -> None:
    node = Node(
        "p", "t", "n", "/a", "m", 'x "y" <z>', True, 2.0, [("a", "b"), ("c", "d")], [("E", "1")], "screen", "node", "gdb"
    )  # fmt: skip
    assert node.to_xml() == NODE
    assert node.to_remote_xml() == NODE.replace(' machine="m"', "")
    assert node.xmltype() == "node"
    bare = '<node pkg="p" type="t" ns="/" args="" respawn="False" respawn_delay="0.0" name="n" required="False">\n</node>'
    assert Node("p", "t", name="n").to_xml() == bare
    assert ("machine", None) in Node("p", "t").xmlattrs()


def test_test_as_text() -> None:
    bare = '<test pkg="p" type="t" ns="/" args="" output="log" required="False" test-name="x">\n</test>'
    assert Test("x", "p", "t").to_xml() == bare
    limited = bare.replace(">\n", ' retry="2" time-limit="3.0">\n')
    assert Test("x", "p", "t", time_limit=3.0, retry=2).to_xml() == limited
