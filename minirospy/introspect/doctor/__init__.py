"""Check this machine's ROS installation, network and graph: return findings for an environment.

Source: http://wiki.ros.org/roswtf, http://wiki.ros.org/ROS/NetworkSetup, http://wiki.ros.org/ROS/Troubleshooting.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, RpcError, UsageError
from minirospy.introspect.doctor.findings import Finding, Status, ok, problem, warning
from minirospy.introspect.doctor.machine import (
    check_packages,
    check_python,
    check_shared_memory,
    check_variables,
)
from minirospy.introspect.doctor.reach import CONNECT_SECONDS, MasterLocation, addresses_of

__all__ = ["Examination", "Finding", "Status", "ok", "problem", "warning"]


class Examination:
    """Context manager that runs all checks in order; ``findings`` yields each result as soon as it is known.

    ``machines``: names or addresses of other machines to check; ``offline`` skips the network checks.
    """

    def __init__(
        self,
        environ: Mapping[str, str] | None = None,
        *,
        machines: Sequence[str] = (),
        offline: bool = False,
    ) -> None:
        self._environ = os.environ if environ is None else environ
        self._machines = machines
        self._offline = offline
        self._stack = contextlib.ExitStack()
        self._listen: Callable[[Callable[[Finding], object]], None] | None = None

    def __enter__(self) -> Examination:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def findings(self) -> Iterator[Finding]:
        """Run the checks and yield their findings."""
        yield from check_python()
        try:
            environment = Environment.read(self._environ)
        except UsageError as error:
            yield problem("variables", str(error), "correct it, or unset it")
            return
        host, port = environment.master_address
        # Look up all host names in parallel, so that an unreachable name server costs only one timeout.
        known = addresses_of((host, environment.host, self._environ.get("ROS_HOSTNAME") or environment.host))
        place = MasterLocation(host, port, known[host])
        yield from check_variables(self._environ, environment, place, known)
        yield from check_shared_memory(environment)
        if not self._offline:
            yield from self._network(environment, place, known[environment.host])
        yield from check_packages(environment)

    def listen(self, report: Callable[[Finding], object]) -> bool:
        """Serve doctors on other machines until the context exits. Return False if there is no master."""
        if self._listen is None:
            return False
        self._listen(report)
        return True

    def _network(
        self, environment: Environment, place: MasterLocation, own_addresses: list[str]
    ) -> Iterator[Finding]:
        from minirospy.introspect.doctor import graph as graph_checks
        from minirospy.introspect.doctor.frames import check_frames
        from minirospy.introspect.doctor.listening import check_listeners, listen, listeners
        from minirospy.introspect.doctor.master import check_clock, check_master
        from minirospy.introspect.doctor.other_machine import check_listens, check_machine
        from minirospy.introspect.doctor.own_node import DoctorNode, check_own_address, check_way_back
        from minirospy.introspect.graph import Graph
        from minirospy.runtime.rpc.master_proxy import MasterProxy

        own = DoctorNode(environment)
        try:
            self._stack.enter_context(own)
        except (OSError, UsageError) as error:
            yield problem(
                "own address", f"no server can be opened here: {error}", "correct ROS_IP, or MINIROSPY_PORTS"
            )
            return
        if own_addresses:
            yield from check_own_address(own)
        for host in self._machines:
            yield from check_machine(host, place.port)
        master = MasterProxy(environment.master_uri, own.name, CONNECT_SECONDS, same_host=False)
        graph = self._stack.enter_context(Graph(master, own.name.lstrip("/")))
        answers = list(check_master(master, place))
        yield from answers
        if any(finding.status is Status.PROBLEM for finding in answers):
            return
        try:
            yield from check_clock(master, place)
            state = graph.state()
            own.register()
            nodes = graph_checks.ask_nodes(graph, state)
            yield from graph_checks.check_nodes(nodes, place)
            hearing = {
                node
                for node in state.subscribers.get("/rosout", ())
                if node in nodes and not nodes[node].trouble
            }
            yield from check_way_back(own, place.host, hearing)
            yield from check_listeners(own, graph, nodes, place)
            for host in self._machines:
                yield from check_listens(host, listeners(state, nodes), environment.master_uri)
            yield from graph_checks.check_topics(state, nodes)
            yield from graph_checks.check_connections(graph, state, nodes)
            yield from graph_checks.check_large_messages(nodes)
            yield from graph_checks.check_services(graph, state, nodes)
            yield from check_frames(environment, state)
        except (MasterUnreachableError, RpcError) as error:
            yield problem("master", f"it answered, and then no more: {error}", "look at its terminal")
        else:
            self._listen = lambda report: listen(own, graph, report)
