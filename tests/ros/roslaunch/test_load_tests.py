"""`<test>` tags in launch files."""

from __future__ import annotations

import pytest

from minirospy.base.errors import LaunchError
from minirospy.ros.roslaunch.launcher.load import load_text
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
from minirospy.workspace.packages import Packages

TEST = '<launch><test test-name="a" pkg="p" type="t" {}>{}</test></launch>'


def load(attributes: str = "", inside: str = "") -> LaunchSpec:
    return load_text(TEST.format(attributes, inside), {}, Packages.below(), {})


def test_attributes_of_a_test() -> None:
    spec = load()
    (test,) = spec.tests
    assert (test.test_name, test.time_limit, test.retry) == ("a", 60.0, 0)
    assert test.node.name == "/a"
    assert not spec.nodes

    inside = '<param name="v" value="1"/><remap from="x" to="y"/><env name="E" value="f"/>'
    spec = load(
        'name="n" ns="q" args="b c" retry="2" time-limit="3.5" cwd="node" clear_params="true"', inside
    )
    (test,) = spec.tests

    assert (test.time_limit, test.retry) == (3.5, 2)
    node = test.node
    assert (node.name, node.args, node.cwd, node.remaps, node.env) == (
        "/q/n",
        "b c",
        "node",
        (("x", "y"),),
        (("E", "f"),),
    )
    assert spec.params == {"/q/n/v": 1}
    assert spec.clear == ["/q/n"]
    assert not load('if="false"').tests


@pytest.mark.parametrize(
    ("attributes", "text"),
    [
        ('retry="x"', "'retry' must be a number: [x]"),
        ('time-limit="x"', "'time-limit' must be a number: [x]"),
        ('time-limit="-1"', "'time-limit' must be a positive number"),
        ('output="screen"', "<test> tags cannot have 'output' attribute"),
        ('respawn="false"', "<test> tags cannot have 'respawn' attribute"),
        ('name="a/b"', "cannot contain a namespace"),
    ],
)
def test_what_is_refused(attributes: str, text: str) -> None:
    with pytest.raises(LaunchError) as raised:
        load(attributes)
    assert text in str(raised.value)
    assert raised.value.line == 1


def test_a_test_may_be_called_as_a_node() -> None:
    node = '<node name="a" pkg="p" type="t"/>'
    text = (
        f'<launch>{node}<test test-name="a" pkg="p" type="t"/><test test-name="a" pkg="p" type="t"/></launch>'
    )
    spec = load_text(text, {}, Packages.below(), {})
    assert (len(spec.nodes), len(spec.tests)) == (1, 2)


def test_a_name_is_required() -> None:
    with pytest.raises(LaunchError, match="missing required attribute: 'test-name'"):
        load_text('<launch><test pkg="p" type="t"/></launch>', {}, Packages.below(), {})


def test_empty_name_leaves_the_node_unnamed() -> None:
    """As in rostest, the parameters are in the namespace, and the node gets a unique name when it runs."""
    param = '<param name="~v" value="1"/>'
    text = f'<launch><group ns="g"><test test-name="" pkg="p" type="t.py">{param}</test></group></launch>'
    spec = load_text(text, {}, Packages.below(), {})

    (test,) = spec.tests
    assert (test.test_name, test.node.base_name, test.node.namespace) == ("", "", "/g/")
    assert spec.params == {"/g/v": 1}
    one, other = test.node.named(), test.node.named()
    assert one.name.startswith("/g/t_py_")
    assert one.name != other.name
    assert one.named() == one

    with pytest.raises(LaunchError, match="must have a 'name' attribute to use 'clear_params'"):
        load_text(text.replace("type=", 'clear_params="true" type='), {}, Packages.below(), {})
