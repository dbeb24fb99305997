"""Print the messages of diagnostic_aggregator's programs, minirospy's or the real ones.

The arguments are a command that starts one of its programs by name.
"""

import queue
import subprocess
import sys
import threading

import rospy
import yaml
from bond.msg import Status
from bondpy import bondpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from diagnostic_msgs.srv import AddDiagnostics

FOLDER, *STARTER = sys.argv[1:]
SECONDS = 100  # seconds after which a program is considered hung
rospy.init_node("drive", argv=[])
pause = threading.Event()


def say(*words):
    print(*words, flush=True)


def eventually(condition):
    for _ in range(int(SECONDS / 0.02)):
        if condition():
            return True
        pause.wait(0.02)
    say("waited too long")
    return False


class Program:
    def __init__(self, name, *words, node=None, **params):
        node = node or name
        if rospy.has_param(f"/{node}"):
            rospy.delete_param(f"/{node}")
        if params:
            rospy.set_param(f"/{node}", params)
        command = [*STARTER, f"{FOLDER}/{name}", *words, f"__name:={node}"]
        self.process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()


diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=50)


def status(name, level=0, message="fine", **values):
    return DiagnosticStatus(
        level, name, message, "hw", [KeyValue(key, value) for key, value in values.items()]
    )


def report(*statuses):
    array = DiagnosticArray(status=list(statuses))
    array.header.stamp = rospy.Time.now()
    diagnostics.publish(array)


def line(each):
    values = ", ".join(f"{pair.key}={pair.value}" for pair in each.values)
    return f"  {each.level} {each.name} | {each.message} | {each.hardware_id} | {values}"


class Tree:
    """Collects the messages of /diagnostics_agg."""

    def __init__(self):
        self.arrays, self.levels = queue.Queue(), queue.Queue()
        self.subscribers = [
            rospy.Subscriber("/diagnostics_agg", DiagnosticArray, self.arrays.put),
            rospy.Subscriber("/diagnostics_toplevel_state", DiagnosticStatus, self.levels.put),
        ]
        eventually(lambda: all(each.get_num_connections() for each in self.subscribers))
        eventually(diagnostics.get_num_connections)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for each in self.subscribers:
            each.unregister()

    def next_lines(self):
        return [line(each) for each in self.arrays.get(timeout=SECONDS).status]

    def show(self, label, is_it=lambda lines: True, again=None):
        """Print the first tree that fulfils a condition, and the top level; call ``again`` before each attempt."""
        for _ in range(400):
            if again:
                again()
            lines = self.next_lines()
            if not is_it(lines):
                continue
            # The two topics use two connections, so give the level of an earlier tree time to arrive.
            for _ in range(10):
                if again:
                    again()
                pause.wait(0.05)
            while not self.levels.empty():
                self.levels.get()
            level = self.levels.get(timeout=SECONDS)
            # The level belongs to the same tree only if the tree is unchanged after it.
            while not self.arrays.empty():
                self.arrays.get()
            if is_it(self.next_lines()):
                break
        else:
            say("waited too long")
        say(label, level.name, level.level)
        for text in lines:
            say(text)


BASIC = yaml.safe_load("""
pub_rate: 20
base_path: Robot
analyzers:
  prefix:
    type: diagnostic_aggregator/GenericAnalyzer
    path: First
    find_and_remove_prefix: [/base_hokuyo_node, tilt]
    num_items: 3
    timeout: 0
  expected:
    type: diagnostic_aggregator/GenericAnalyzer
    path: Second
    expected: ["/a/b: c", "plain"]
    timeout: 0
  regex:
    type: GenericAnalyzer
    path: Third
    regex: ["imu [0-9]+", "(broken"]
    contains: battery
    name: "exact"
    startswith: ["motor", "servo"]
    remove_prefix: servo
    timeout: -1
  group:
    type: diagnostic_aggregator/AnalyzerGroup
    path: Sensors
    analyzers:
      lasers:
        type: diagnostic_aggregator/GenericAnalyzer
        path: Lasers
        contains: ["laser", "hokuyo"]
        timeout: 0
      none:
        type: diagnostic_aggregator/GenericAnalyzer
        path: Nothing
        contains: "never reported"
        num_items: 0
      few:
        type: diagnostic_aggregator/GenericAnalyzer
        path: Few
        contains: "not there"
        num_items: 2
  discard:
    type: diagnostic_aggregator/DiscardAnalyzer
    path: Discarded
    contains: noise
  ignored:
    type: diagnostic_aggregator/IgnoreAnalyzer
    anything: 5
""")


def has(*parts):
    return lambda lines: all(any(part in each for each in lines) for part in parts)


with Program("aggregator_node", node="basic", **BASIC), Tree() as tree:
    tree.show("nothing yet")
    first = (
        status("/base_hokuyo_node: Frequency", 0, "good", rate="40"),
        status("/base_hokuyo_node: Connection", 1, "slow"),
        status("tilt: x/y", 0),
        status("plain", 2, "no"),
        status("imu 12"), status("imu x"), status("a battery of them", 1, "low"), status("exact"), status("exact too"),
        status("servo: one"), status("motor/two"), status("noise: a", 2, "loud"), status("my laser", 7, "odd level"),
    )  # fmt: skip
    # Repeat: an item that matches no analyzer is omitted after five seconds.
    tree.show("one of each", has("my laser", "exact too"), lambda: report(*first))
    rest = status("/a/b: c", 0, "there"), status("plain", 0, "yes"), status("another tilt"), status("tilt")
    tree.show("all expected", has("a b: c | there", "another tilt"), lambda: report(*first, *rest))

STALE = {
    "pub_rate": 20,
    "other_as_errors": True,
    "analyzers": {
        "keeps": {"type": "diagnostic_aggregator/GenericAnalyzer", "path": "Keeps", "startswith": "k", "timeout": 1.0},
        "drops": {
            "type": "diagnostic_aggregator/GenericAnalyzer", "path": "Drops", "startswith": "d", "timeout": 1.0,
            "discard_stale": True,
        },
        "long": {"type": "diagnostic_aggregator/GenericAnalyzer", "path": "Long", "startswith": "l", "timeout": 1000},
    },
}  # fmt: skip
with Program("aggregator_node", node="stale", **STALE), Tree() as tree:
    tree.show("empty")
    found = has("0 /Keeps/k1", "0 /Drops/d1", "0 /Long/l1", "0 /Keeps/k2", "/Other/zzz")
    tree.show(
        "fresh", found, lambda: report(status("k1"), status("k2"), status("d1"), status("l1"), status("zzz"))
    )
    gone = has("3 /Keeps/k1", "3 /Keeps/k2")
    tree.show("old", lambda lines: gone(lines) and not has("/Drops/d1")(lines) and not has("/Other")(lines))
    tree.show("partly", has("0 /Keeps/k1", "3 /Keeps/k2"), lambda: report(status("k1")))

WRONG = {
    "pub_rate": 20,
    "base_path": "/Base",
    "analyzers": {
        "no_type": {"path": "A"},
        "no_path": {"type": "diagnostic_aggregator/GenericAnalyzer", "startswith": "a"},
        "no_check": {"type": "diagnostic_aggregator/GenericAnalyzer", "path": "B"},
        "no_class": {"type": "other_package/Analyzer", "path": "C"},
        "no_words": {
            "type": "diagnostic_aggregator/GenericAnalyzer",
            "path": "D",
            "startswith": ["a", 5],
            "name": "b",
        },
        "no_group": {"type": "diagnostic_aggregator/AnalyzerGroup", "path": "E"},
        "right": {
            "type": "diagnostic_aggregator/GenericAnalyzer",
            "path": "Right",
            "name": "right",
            "timeout": 0,
        },
    },
}
with Program("aggregator_node", node="wrong", **WRONG), Tree() as tree:
    tree.show(
        "wrong", has("0 /Base/Right/right", "/Other/alone"), lambda: report(status("right"), status("alone"))
    )

with Program("aggregator_node", node="none", pub_rate=20), Tree() as tree:
    tree.show("no analyzers", has("/Other/x"), lambda: report(status("x")))

# Analyzers that another node adds.
with Program("aggregator_node", node="open", pub_rate=20, base_path="Top"), Tree() as tree:
    add = rospy.ServiceProxy("/diagnostics_agg/add_diagnostics", AddDiagnostics)
    add.wait_for_service(SECONDS)
    for name in ("relative", "", "/nowhere"):
        answer = add(name)
        say("add", repr(name), answer.success, answer.message)
    rospy.set_param("/added", {"path": "Added", "analyzers": {"g": {
        "type": "diagnostic_aggregator/GenericAnalyzer", "path": "Mine", "startswith": "mine", "timeout": 0,
    }}})  # fmt: skip
    bond = bondpy.Bond("/diagnostics_agg/bond/added", "/added")
    bond.set_connect_timeout(SECONDS)
    bond.set_heartbeat_timeout(SECONDS)
    bond.start()
    answer = add("/added")
    say("add", answer.success, answer.message)
    say("add twice", add("/added").message)
    say("formed", bond.wait_until_formed(rospy.Duration(SECONDS)))
    tree.show("added", has("/Top/Added/Mine"))
    report(status("mine 1"))
    tree.show("reported", has("/Top/Added/Mine/mine 1"))
    bond.break_bond()
    tree.show("removed", lambda lines: not has("/Top/Added")(lines))

    beats = queue.Queue()
    heartbeats = rospy.Subscriber("/diagnostics_agg/bond/adder", Status, beats.put)
    with Program("add_analyzers", node="adder", **rospy.get_param("/added")):
        tree.show("by the program", has("/Top/Added/Mine"))
        # The real aggregator never notices the exit of a program that has sent only one heartbeat.
        seen = 0
        while seen < 3:
            seen += beats.get(timeout=SECONDS)._connection_header["callerid"] == "/adder"
    tree.show("program ended", lambda lines: not has("/Top/Added")(lines))
