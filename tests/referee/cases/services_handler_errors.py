"""Handlers that raise: the client's error, the server's log, and error_handler's arguments."""

import logging

import rospy
from referee import outcome, show
from std_srvs.srv import SetBool, Trigger

rospy.init_node("case", argv=[])


class Lines(logging.Handler):
    """Prints log lines without the traceback, which each stack formats differently."""

    def emit(self, record):
        show("  log", record.levelname, record.getMessage().splitlines()[0])


logging.getLogger("rosout").addHandler(Lines())


class Odd(Exception):
    def __str__(self):
        return "odd text"


def raises(error):
    def handler(request):
        raise error

    return handler


errors = {
    "ValueError": ValueError("bad thing"),
    "no text": ValueError(),
    "two arguments": ValueError("a", 1),
    "KeyError": KeyError("k"),
    "own class": Odd(),
    "ROSException": rospy.ROSException("ros"),
    "ServiceException": rospy.ServiceException("service"),
    "ServiceException without text": rospy.ServiceException(),
    "ROSInterruptException": rospy.ROSInterruptException("interrupt"),
    "ROSSerializationException": rospy.ROSSerializationException("ser"),
    "TransportException": rospy.TransportException("transport"),
    "unicode": ValueError("zażółć"),
    "lines": ValueError("first\nsecond"),
    "format": ValueError("100 %s %d"),
    "AssertionError": AssertionError("assertion"),
    "TypeError": TypeError("a type"),
}
for number, (label, error) in enumerate(errors.items()):
    service = rospy.Service(f"s{number}", Trigger, raises(error))
    outcome(label, rospy.ServiceProxy(f"s{number}", Trigger))

show("wrong returns are logged")
for label, value in (
    ("None", None),
    ("one too few", [True]),
    ("unknown field", {"x": 1}),
    ("wrong type", [True, 5]),
):
    service = rospy.Service("r" + label.replace(" ", "_"), Trigger, lambda request, value=value: value)
    outcome(label, rospy.ServiceProxy("r" + label.replace(" ", "_"), Trigger))

show("error_handler")


def on_error(e, exception_type, exception_value, tb):
    show("failing", repr(e), exception_type.__name__, repr(exception_value), type(tb).__name__)


offered = rospy.Service("failing", Trigger, raises(ValueError("bad")), error_handler=on_error)
outcome("the client", rospy.ServiceProxy("failing", Trigger))
offered_none = rospy.Service("told_none", Trigger, lambda request: None, error_handler=on_error)
outcome("None", rospy.ServiceProxy("told_none", Trigger))
offered_wrong = rospy.Service("told_wrong", Trigger, lambda request: [1, 2], error_handler=on_error)
outcome("wrong", rospy.ServiceProxy("told_wrong", Trigger))
offered_service = rospy.Service(
    "told_service", Trigger, raises(rospy.ServiceException("s")), error_handler=on_error
)
outcome("ServiceException", rospy.ServiceProxy("told_service", Trigger))

show("the service goes on after an error")
calls = []


def sometimes(request):
    calls.append(request.data)
    if request.data:
        raise ValueError("this time")
    return True, f"call {len(calls)}"


flaky = rospy.Service("flaky", SetBool, sometimes)
for persistent in (False, True):
    proxy = rospy.ServiceProxy("flaky", SetBool, persistent=persistent)
    for flag in (False, True, False, True, False):
        outcome(f"persistent {persistent} {flag}", lambda: proxy(flag))
    proxy.close()
