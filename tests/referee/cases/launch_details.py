"""roslaunch for programs: a node's lists, handlers of its output that raise, a parameter's types, tags in <machine>."""

import roslaunch.core
import roslaunch.xmlloader
from referee import outcome, printed, show
from roslaunch.config import ROSLaunchConfig


def load(body):
    """Return the configuration for the body of a launch file."""
    config = ROSLaunchConfig()
    roslaunch.xmlloader.XmlLoader().load_string(f"<launch>{body}</launch>", config, verbose=False)
    return config


show("# lists")
remaps, variables = [("a", "b")], [("x", "y")]
node = roslaunch.core.Node("p", "t", remap_args=remaps, env_args=variables)
show(node.remap_args is remaps, node.env_args is variables)
remaps.append(("c", "d"))
show(node.remap_args, node.env_args)
test = roslaunch.core.Test("n", "p", "t", remap_args=remaps)
show(test.remap_args, test.env_args, roslaunch.core.Node("p", "t").remap_args)
config = load(
    '<remap from="q" to="r"/><env name="V" value="1"/>'
    '<node name="n" pkg="p" type="t"><remap from="a" to="b"/><env name="E" value="2"/></node>'
    '<test test-name="t" pkg="p" type="t"><remap from="c" to="d"/></test>'
)
for each in (*config.nodes, *config.tests):
    show(each.remap_args, each.env_args)

show("# handlers")


def broken(text):
    """Raise for each line."""
    raise ValueError(text)


heard = []
roslaunch.core.add_printlog_handler(broken)
roslaunch.core.add_printlog_handler(heard.append)
roslaunch.core.add_printerrlog_handler(broken)
roslaunch.core.add_printerrlog_handler(heard.append)
printed("printlog", lambda: roslaunch.core.printlog("a line"))
printed("printerrlog", lambda: roslaunch.core.printerrlog("an error"))
show(heard)

show("# types")
for type_ in ("double", "Double", " int", "int", "str", "string", "bool", "boolean", "yaml", "auto", ""):
    outcome(repr(type_), lambda t=type_: load(f'<param name="p" type="{t}" value="1"/>').params["/p"].value)
for type_ in ("float", "text", "list"):
    try:
        load(f'<param name="p" type="{type_}" value="1"/>')
    except roslaunch.xmlloader.XmlParseException as error:
        show(type_, f"Unknown type '{type_}'" in str(error))

show("# machines")
for inner in ("<foo/>", '<param name="p" value="1"/>', "text", "<foo/><bar/>"):
    config = load(f'<machine name="m" address="a">{inner}</machine>')
    show(inner, sorted(config.machines), [each.partition("unrecognized")[2] for each in config.config_errors])
for inner in ('<env name="E" value="1"/>', '<foo/><env name="E" value="1"/>'):
    try:
        load(f'<machine name="m" address="a">{inner}</machine>')
    except roslaunch.xmlloader.XmlParseException as error:
        show(inner, "<env> tag is not supported since ROS Fuerte" in str(error))
