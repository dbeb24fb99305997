"""rostopic's texts, publishers and measurements in programs that monitor topics."""

import contextlib
import io
import re
import threading

import rosgraph
import rospy
import rostopic
from referee import outcome, show
from referee import printed as printed_exactly
from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import Bool, Float32, Header, String


def printed(label, call):
    """Print a call's result with a measured number masked, which differs each time."""
    printed_exactly(label, call, (r"\d+\.\d+(e-\d+)?", "<n>"))


outcome("master", rostopic._check_master)
rospy.init_node("tester")
bools = rospy.Publisher("/ns/bools", Bool, queue_size=1, latch=True)
numbers = rospy.Publisher("/numbers", Float32, queue_size=1, latch=True)
listener = rospy.Subscriber("/heard", String, lambda message: None)
anything = rospy.Subscriber("/any", rospy.AnyMsg, lambda message: None)
master = rosgraph.Master("/odd_node")

show("# info")
for topic in ("/ns/bools", "/heard", "/any", "/none"):
    outcome(topic, lambda t=topic: rostopic.get_info_text(t))
outcome("api", lambda: (rostopic.get_api(master, "/tester"), rostopic.get_api(master, "/nobody")))
outcome(
    "types", lambda: [row for row in sorted(rostopic._master_get_topic_types(master)) if "ros" not in row[0]]
)
outcome("type", lambda: rostopic._get_topic_type("/ns/bools"))
master.registerPublisher("/odd", "no_such_msgs/Nope", "http://localhost:1")
outcome("odd", lambda: rostopic.get_topic_type("/odd"))
outcome("odd class", lambda: rostopic.get_topic_class("/odd"))
master.unregisterPublisher("/odd", "http://localhost:1")
for options in (
    {},
    {"verbose": True},
    {"publishers_only": True},
    {"subscribers_only": True},
    {"group_by_host": True},
):
    printed(f"list {options}", lambda o=options: rostopic._rostopic_list(None, **o))
printed("list below", lambda: rostopic._rostopic_list("/ns"))
printed("info", lambda: rostopic._rostopic_info("/heard"))
printed("type", lambda: rostopic._rostopic_type("/heard"))
printed("type none", lambda: rostopic._rostopic_type("/none"))
printed("command", lambda: rostopic.rostopicmain(["rostopic", "list"]))
printed("command fails", lambda: rostopic.rostopicmain(["rostopic", "info", "/none"]))

show("# publish")
printed("publish", lambda: rostopic.publish_message(numbers, Float32, [1.5], once=True))
outcome("heard", lambda: rospy.wait_for_message("/numbers", Float32, 5))
for values in (["x"], [1, 2]):
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            rostopic.publish_message(numbers, Float32, values, once=True)
    except rostopic.ROSTopicException as error:
        show(values, type(error).__name__)
for name in ("no_such_msgs/Nope", "Nope"):
    try:
        rostopic.create_publisher("/made", name, True)
    except rostopic.ROSTopicException as error:
        show(type(error).__name__, str(error).splitlines()[0])

show("# echo")
echo = rostopic.CallbackEcho("/ns/bools", None, count=2)
for value in (True, False, True):
    printed("echo", lambda v=value: echo.callback(Bool(v), {"topic": "/ns/bools", "type_information": None}))
    show(echo.count, echo.done, echo.max_count)
scan = LaserScan(header=Header(stamp=rospy.Time(5, 6)), ranges=[1.0, 2.0])
given = {"topic": "/scan", "type_information": "sensor_msgs/LaserScan"}
plot = rostopic.CallbackEcho("/scan", None, plot=True)
printed("plot", lambda: plot.callback(scan, given))
printed("plot", lambda: plot.callback(scan, given))
printed(
    "field", lambda: rostopic.CallbackEcho("/scan", rostopic.msgevalgen("/header/seq")).callback(scan, given)
)
odd = rostopic.CallbackEcho("/scan", None, filter_fn=lambda message: message.data)
printed("filter", lambda: odd.callback(Bool(False), {"topic": "/scan", "type_information": None}))
printed("filter", lambda: odd.callback(Bool(True), {"topic": "/scan", "type_information": None}))
printed("other topic", lambda: odd.callback(Bool(True), {"topic": "/other", "type_information": None}))
joints = JointState(name=["a"], position=[1.0])
for words in ((True, False), (False, True), (True, True), (False, False)):
    fields, transform = rostopic.create_field_filter(*words), rostopic.create_value_transform(*words)
    show(words, list(fields(joints)), list(fields(Header())))
    for options in ({"field_filter_fn": fields}, {"value_transform_fn": transform}):
        shown = rostopic.CallbackEcho("/joints", None, **options)
        of_joints = {"topic": "/joints", "type_information": "sensor_msgs/JointState"}
        printed("chosen", lambda s=shown, o=of_joints: s.callback(joints, o))


class Changes(rostopic.CallbackEcho):
    """Prints only changes, as programs' subclasses do."""

    def __init__(self, topic):
        super().__init__(topic, None)
        self.last = None
        self.filter_fn = self.is_new

    def is_new(self, message):
        new, self.last = message != self.last, message
        return new


changes = Changes("/ns/bools")
for value in (True, True, False):
    printed(
        "changes", lambda v=value: changes.callback(Bool(v), {"topic": "/ns/bools", "type_information": None})
    )

show("# measure")
hz = rostopic.ROSTopicHz(5, filter_expr=lambda message: message.data)
for value in (True, True, False, True):
    hz.callback_hz(Bool(value))
    rospy.sleep(0.02)
found = hz.get_hz()
show(type(found).__name__, len(found), found[4], found[1] <= found[2], hz.get_hz())
printed("print", lambda: hz.print_hz())
hz.callback_hz(Bool(True))
printed("print", lambda: hz.print_hz())
printed("print", lambda: hz.print_hz(["/a"]))
bandwidth = rostopic.ROSTopicBandwidth(3)


class Raw:
    """A raw message, like AnyMsg."""

    _buff = b"x" * 1500


for _ in range(4):
    bandwidth.callback(Raw)
    rospy.sleep(0.02)
show(bandwidth.sizes, len(bandwidth.times), bandwidth.window_size)
printed("print", bandwidth.print_bw)
delay = rostopic.ROSTopicDelay(10)
outcome("no header", lambda: delay.callback_delay(Bool()))
for _ in range(3):
    delay.callback_delay(LaserScan(header=Header(stamp=rospy.Time.now())))
printed("print", delay.print_delay)

show("# waiting ends with the node")
waited = []
ends = threading.Thread(
    target=lambda: waited.append(rostopic.get_topic_type("/never", blocking=True)), daemon=True
)
ends.start()
rospy.sleep(0.2)
rospy.signal_shutdown("done")
ends.join(30.0)
show(waited)
