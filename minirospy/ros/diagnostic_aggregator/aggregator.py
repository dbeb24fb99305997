"""The node aggregator_node: sorts /diagnostics into /diagnostics_agg and /diagnostics_toplevel_state.

Parameters: ~base_path, ~pub_rate (1 Hz), ~other_as_errors, ~path, ~analyzers. Other nodes add analyzers with the service
/diagnostics_agg/add_diagnostics. Source: http://wiki.ros.org/diagnostic_aggregator.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_msgs.srv import AddDiagnostics, AddDiagnosticsRequest, AddDiagnosticsResponse

from minirospy import client as rospy
from minirospy.ros.bondpy.bondpy.bondpy import Bond
from minirospy.ros.diagnostic_aggregator.analyzers import AnalyzerGroup, Item, OtherAnalyzer

__all__ = ["Aggregator", "RosLog", "analyzer_loader", "load_group", "main", "toplevel_level"]


class RosLog:
    """Logs the analyzers' warnings and errors under the node's name."""

    def warn(self, text: str) -> None:
        """Log a warning."""
        rospy.logwarn(text)

    def error(self, text: str) -> None:
        """Log an error."""
        rospy.logerr(text)


def main() -> int:
    """Run the node; return the exit status."""
    rospy.init_node("diagnostic_aggregator")
    rate = rospy.get_param("~pub_rate", 1.0)
    if isinstance(rate, bool) or not isinstance(rate, (int, float)) or not rate > 0:
        print(f"ERROR: ~pub_rate is not a number above 0: {rate!r}", file=sys.stderr)
        return 1
    try:
        aggregator = Aggregator()
        pause = rospy.Rate(rate)
        while not rospy.is_shutdown():
            aggregator.publish()
            pause.sleep()
    except rospy.ROSInterruptException:
        pass
    return 0


def analyzer_loader() -> int:
    """Return 0 if all analyzers in the private parameters can be created, else 1.

    Test program; a launch file sets the parameters and runs `<test pkg="diagnostic_aggregator" type="analyzer_loader">`.
    """
    import unittest

    from minirospy.ros.rostest.runner.node import rosrun

    rospy.init_node("analyzer_loader")

    class AnalyzerLoader(unittest.TestCase):
        def runTest(self) -> None:
            """Create the analyzers and run their reports."""
            group = load_group("", "~")
            assert group.is_complete, "Analyzer group failed to initialize: see its log messages"
            assert group.report(rospy.get_time())

    rosrun("diagnostic_aggregator", "analyzer_loader", AnalyzerLoader, sys.argv)
    return 0


def load_group(base_path: str, namespace: str) -> AnalyzerGroup:
    """Create the analyzers from the parameters in a namespace; errors are logged."""
    params = rospy.get_param(namespace, {})
    if not isinstance(params, dict):
        params = {}
    return AnalyzerGroup(base_path, params, rospy.resolve_name(namespace), rospy.get_time(), RosLog())


def toplevel_level(levels: Iterable[int]) -> int:
    """Return the level of the whole tree: stale only if every level is stale; -1 if there are no levels."""
    found = list(levels)
    highest = max(found, default=-1)
    return 2 if highest > 2 and min(found) <= 2 else highest


class Aggregator:
    """The tree of analyzers, and the node's topics."""

    def __init__(self) -> None:
        base_path = str(rospy.get_param("~base_path", ""))
        self._base_path = f"/{base_path}" if base_path and not base_path.startswith("/") else base_path
        # Guards the tree and the bonds.
        self._lock = threading.Lock()
        self._bonds: dict[str, Bond] = {}
        self._warned: set[str] = set()
        self._log = RosLog()
        self._tree = load_group(self._base_path, "~")
        if not self._tree.is_complete:
            rospy.logerr("Analyzer group for diagnostic aggregator failed to initialize!")
        self._other = OtherAnalyzer(self._base_path, rospy.get_param("~other_as_errors", False) is True)

        self._tree_topic: rospy.Publisher[DiagnosticArray] = rospy.Publisher(
            "/diagnostics_agg", DiagnosticArray, queue_size=1
        )
        self._level_topic: rospy.Publisher[DiagnosticStatus] = rospy.Publisher(
            "/diagnostics_toplevel_state", DiagnosticStatus, queue_size=1
        )
        self._service = rospy.Service("/diagnostics_agg/add_diagnostics", AddDiagnostics, self._add)
        self._subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, self._analyze, queue_size=1000)

    def publish(self) -> None:
        """Publish the tree and its overall level."""
        now = rospy.get_time()
        with self._lock:
            statuses = self._tree.report(now) + self._other.report(now)
        array = DiagnosticArray(status=statuses)
        array.header.stamp = rospy.Time.now()
        self._tree_topic.publish(array)
        level = toplevel_level(status.level for status in statuses)
        self._level_topic.publish(DiagnosticStatus(name="toplevel_state", level=level))

    def _analyze(self, array: DiagnosticArray) -> None:
        if not array.header.stamp:
            self._warn_of_stamp(array)
        with self._lock:
            for status in array.status:
                item = Item.of(status, rospy.get_time(), self._log)
                if not self._tree.analyze(item):
                    self._other.analyze(item)

    def _warn_of_stamp(self, array: DiagnosticArray) -> None:
        names = ", ".join(status.name for status in array.status)
        if names not in self._warned:
            rospy.logwarn(f"No timestamp set for diagnostic message. Message names: {names}")
            self._warned.add(names)

    def _add(self, request: AddDiagnosticsRequest) -> AddDiagnosticsResponse:
        """Create analyzers from the parameters in the requested namespace.

        Remove them when the bond with the requesting node breaks.
        """
        namespace: str = request.load_namespace
        if not namespace.startswith("/"):
            return AddDiagnosticsResponse(
                False,
                "Requested load from non-global namespace. Private and relative namespaces are not supported.",
            )
        with self._lock:
            if namespace in self._bonds:
                return AddDiagnosticsResponse(
                    False, f"Requested load from namespace {namespace} which is already in use"
                )
            # Use one topic per bond: on a shared topic, the heartbeats of different bonds would overwrite each other.
            bond = self._bonds[namespace] = Bond(f"/diagnostics_agg/bond{namespace}", namespace)

        group = load_group(self._base_path, namespace)
        bond.set_formed_callback(lambda: self._form(group))
        bond.set_broken_callback(lambda: self._break(namespace, group))
        bond.start()
        if not group.is_complete:
            return AddDiagnosticsResponse(False, "Failed to initialise AnalyzerGroup.")
        return AddDiagnosticsResponse(
            True, "Successfully initialised AnalyzerGroup. Waiting for bond to form."
        )

    def _form(self, group: AnalyzerGroup) -> None:
        with self._lock:
            self._tree.add(group)

    def _break(self, namespace: str, group: AnalyzerGroup) -> None:
        rospy.logwarn(f"Bond for namespace {namespace} was broken")
        with self._lock:
            bond = self._bonds.pop(namespace, None)
            is_known = self._tree.remove(group)
        if not is_known:
            rospy.logwarn("Broken bond tried to remove an analyzer which didn't exist.")
        if bond is not None:
            bond.shutdown()
