"""transform and relay_field: evaluate a Python expression for each message on a topic, or for a field, and publish the result.

The user writes the expression, on the command line or in a launch file; ``m`` is the message or the field.
Source: http://wiki.ros.org/topic_tools/transform, http://wiki.ros.org/topic_tools/relay_field.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable
from types import CodeType, ModuleType

from std_msgs.msg import Header

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError
from minirospy.base.yaml_text import safe_load
from minirospy.core.idl.fill_message import fill_message_args
from minirospy.core.idl.load import message_class
from minirospy.core.idl.protocols import Message
from minirospy.ros.rostopic import rostopic

__all__ = ["relay_field_main", "transform_main"]


_Start = Callable[[], rospy.Subscriber[Message]]


def transform_main() -> int:
    """Run transform; return its exit status."""
    return _run("transform", _transform_parser(), _transform)


def relay_field_main() -> int:
    """Run relay_field; return its exit status."""
    return _run(
        "relay_field",
        _parser("relay_field", "Relay a topic, or a field of it, as fields of another one."),
        _relay,
    )


def _parser(name: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(name, description=description)
    parser.add_argument("input", help="Input topic or topic field.")
    parser.add_argument("output_topic", help="Output topic.")
    parser.add_argument("output_type", help="Output topic type.")
    parser.add_argument("expression", help="Python expression to apply on the input message 'm'.")
    parser.add_argument("--wait-for-start", action="store_true", help="Wait for input messages.")
    parser.add_argument(
        "--tcpnodelay",
        dest="tcp_nodelay",
        action="store_true",
        help="Set TCP_NODELAY transport hint when subscribing to topics.",
    )
    return parser


def _transform_parser() -> argparse.ArgumentParser:
    parser = _parser("transform", "Apply a Python operation to a topic, or to a field of it.")
    parser.add_argument(
        "-i",
        "--import",
        dest="modules",
        nargs="+",
        default=["numpy"],
        help="List of Python modules to import.",
    )
    parser.add_argument("--latch", action="store_true", help="Set publisher to latched.")
    return parser


def _run(
    name: str,
    parser: argparse.ArgumentParser,
    prepare: Callable[[argparse.Namespace], _Start],
) -> int:
    """Check the arguments before contacting a master, then run the node until it shuts down. Return the exit status."""
    try:
        start = prepare(parser.parse_args(rospy.myargv()[1:]))
        rospy.init_node(name, anonymous=True)
        running = start()
        rospy.spin()
        del running
    except (MinirospyError, rostopic.ROSTopicException) as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    except rospy.ROSInterruptException:
        pass
    return 0


def _transform(options: argparse.Namespace) -> _Start:
    modules: dict[str, ModuleType] = {}
    for name in options.modules:
        try:
            # Store the top-level module: an expression such as tf.transformations.X needs the name tf.
            modules[name.partition(".")[0]] = importlib.import_module(name.partition(".")[0])
            importlib.import_module(name)
        except ImportError as error:
            print(f"Failed to import module: {name} ({error})", file=sys.stderr)
    code = _compiled(options.expression)
    cls = message_class(options.output_type)

    def start() -> rospy.Subscriber[Message]:
        publisher: rospy.Publisher[Message] = rospy.Publisher(
            options.output_topic, cls, queue_size=1, latch=options.latch
        )

        def convert(value: object) -> None:
            result = eval(code, dict(modules), {"m": value})
            publisher.publish(*(result if isinstance(result, list | tuple) else [result]))

        return _subscribe(options, convert)

    return start


def _relay(options: argparse.Namespace) -> _Start:
    import yaml

    try:
        template = safe_load(options.expression)
    except yaml.YAMLError as error:
        raise MinirospyError(f"the expression is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(template, dict):
        raise MinirospyError(f"the expression is not a dictionary of fields: {options.expression!r}")
    cls = message_class(options.output_type)

    def start() -> rospy.Subscriber[Message]:
        publisher: rospy.Publisher[Message] = rospy.Publisher(options.output_topic, cls, queue_size=1)

        def convert(value: object) -> None:
            now = rospy.get_rostime()
            message = cls()
            fill_message_args(message, [_evaluated(template, value)], {"now": now, "auto": Header(stamp=now)})
            publisher.publish(message)

        return _subscribe(options, convert)

    return start


def _subscribe(options: argparse.Namespace, convert: Callable[[object], None]) -> rospy.Subscriber[Message]:
    """Call a function with each message, or with the chosen field. Raise MinirospyError if the topic does not exist."""
    name = rospy.resolve_name(options.input)
    cls, topic, field = rostopic.get_topic_class(name, blocking=options.wait_for_start)
    if cls is None or topic is None:
        raise MinirospyError(f"Wrong input topic (or topic field): {name}")

    def received(message: Message) -> None:
        try:
            convert(field(message) if field else message)
        except Exception as error:  # noqa: BLE001 - the user's expression
            rospy.logerr_throttle(10, f"{options.expression!r}: {type(error).__name__}: {error}")

    return rospy.Subscriber(topic, cls, received, tcp_nodelay=options.tcp_nodelay)


def _compiled(expression: str) -> CodeType:
    try:
        return compile(expression.strip(), "<expression>", "eval")
    except (SyntaxError, ValueError) as error:
        raise MinirospyError(f"{expression!r} is not an expression of Python: {error}") from error


def _evaluated(template: dict[str, object], value: object) -> dict[str, object]:
    """Evaluate the strings in a template as expressions. Leave strings that are not valid expressions unchanged."""
    found: dict[str, object] = {}
    for name, each in template.items():
        if isinstance(each, dict):
            found[name] = _evaluated(each, value)
        elif isinstance(each, str):
            try:
                found[name] = eval(each, {}, {"m": value})
            except (NameError, SyntaxError):
                found[name] = each
        else:
            found[name] = each
    return found
