"""Two machines: network namespaces with their own addresses and a router between them, which drops packets on demand.

::

    alpha 10.99.1.2 (fd99:1::2)  --va--  router  --vb--  10.99.2.2 (fd99:2::2) beta

Each machine has its own host name and hosts file. The router drops packets silently, as firewalls do; a cable is pulled by
setting its interface down.
"""

from __future__ import annotations

import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.interop.conftest import PATIENCE

HERE = Path(__file__).parent
REAL_PYTHON = "/usr/bin/python3"
OUR_BIN = Path(sys.executable).parent
PORT = 11411
ALPHA, BETA = "10.99.1.2", "10.99.2.2"
ALPHA6, BETA6 = "fd99:1::2", "fd99:2::2"
URI = f"http://alpha:{PORT}"
HOSTS = f"127.0.0.1 localhost\n::1 localhost\n{ALPHA} alpha\n{BETA} beta\n{ALPHA6} alpha6\n{BETA6} beta6\n"


def sh(command: str) -> None:
    """Run an `ip` command. Raise CalledProcessError if it fails."""
    subprocess.run(command.split(), check=True, capture_output=True, text=True)


class Network:
    """The three namespaces, and the programs that run in them."""

    def __init__(self) -> None:
        self.names = {each: f"minirospy-{each}-{os.getpid()}" for each in ("alpha", "beta", "router")}
        self.running = ExitStack()

    def ip(self, machine: str, command: str) -> None:
        """Run `ip` in a machine or the router."""
        sh(f"ip -n {self.names[machine]} {command}")

    def build(self) -> None:
        """Create the namespaces. Raise CalledProcessError if this is not permitted."""
        for name in self.names.values():
            sh(f"ip netns add {name}")

        for machine, at, address, address6 in (("alpha", "va", ALPHA, ALPHA6), ("beta", "vb", BETA, BETA6)):
            self.ip(machine, "link set lo up")
            sh(
                f"ip link add eth0 netns {self.names[machine]} type veth peer name {at} netns {self.names['router']}"
            )
            self.ip(machine, f"addr add {address}/24 dev eth0")
            self.ip(machine, f"addr add {address6}/64 dev eth0 nodad")
            self.ip("router", f"addr add {address[:-1]}1/24 dev {at}")
            self.ip("router", f"addr add {address6[:-1]}1/64 dev {at} nodad")
            self.ip(machine, "link set eth0 up")
            self.ip("router", f"link set {at} up")
            self.ip(machine, f"route add default via {address[:-1]}1")
            self.ip(machine, f"-6 route add default via {address6[:-1]}1")
            folder = Path("/etc/netns") / self.names[machine]
            folder.mkdir(parents=True)
            (folder / "hosts").write_text(HOSTS)
            # This name server refuses immediately, whereas an external one would time out.
            (folder / "resolv.conf").write_text("nameserver 127.0.0.1\n")

        for switch in ("ipv4/ip_forward", "ipv6/conf/all/forwarding"):
            subprocess.run(
                ["ip", "netns", "exec", self.names["router"], "sh", "-c", f"echo 1 > /proc/sys/net/{switch}"],
                check=True,
            )

    def remove(self) -> None:
        self.running.close()
        for name in self.names.values():
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)
            shutil.rmtree(Path("/etc/netns") / name, ignore_errors=True)

    def command(self, machine: str, words: list[str]) -> list[str]:
        """Return a command that runs ``words`` on a machine, with its host name, as one process that receives the signals."""
        script = f'hostname {machine} && exec "$@"'
        return [
            "ip",
            "netns",
            "exec",
            self.names[machine],
            "unshare",
            "--uts",
            "sh",
            "-c",
            script,
            "sh",
            *words,
        ]

    def start(self, machine: str, words: list[str], **variables: str) -> Program:
        """Start a program on a machine."""
        environ = {"ROS_MASTER_URI": URI, **variables}
        # Tests run with ROS_HOSTNAME=localhost, which is not set on machines in a network.
        kept = {name: value for name, value in os.environ.items() if name != "ROS_HOSTNAME"}
        program = Program(self.command(machine, words), {**kept, **environ})
        self.running.callback(program.end)
        return program

    def peer(self, machine: str, role: str, stack: str = "ours", **variables: str) -> Program:
        """Start network_peer.py on a machine, with minirospy or real rospy, as the node /ROLE_MACHINE."""
        python = sys.executable if stack == "ours" else REAL_PYTHON
        words = [python, str(HERE / "network_peer.py"), role, f"__name:={role}_{machine}"]
        return self.start(machine, words, **variables)

    def doctor(self, machine: str, *others: str, **variables: str) -> list[str]:
        """Return the output of `minirospy doctor` on a machine."""
        words = [str(OUR_BIN / "minirospy"), "doctor", *others]
        return self.start(machine, words, **variables).lines_until_end()

    def publish(self, machine: str, **variables: str) -> None:
        """Start another publisher of /beat on a machine."""
        words = [str(OUR_BIN / "rostopic"), "pub", "/beat", "std_msgs/Int32", "1"]
        self.start(machine, words, **variables)

    @contextmanager
    def firewall(self, rule: str) -> Iterator[None]:
        """Make the router drop packets that match an `ip rule`: `to ADDRESS ipproto tcp dport 1-5`."""
        self.ip("router", f"rule add {rule} blackhole")
        try:
            yield
        finally:
            self.ip("router", f"rule del {rule} blackhole")


class Program:
    """A program, with methods that wait for lines on its stdout or stderr."""

    def __init__(self, command: list[str], environ: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            command,
            env=environ,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self.seen: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_for(self, text: str) -> str:
        """Return the next line that contains ``text``."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                line = self._lines.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                raise AssertionError(f"no line with {text!r} in {PATIENCE} s: {self.seen}") from None
            assert line is not None, f"ended without a line with {text!r}: {self.seen}"
            if text in line:
                return line

    def lines_until_end(self) -> list[str]:
        """Return all lines up to the program's exit."""
        self._reader.join(PATIENCE)
        assert not self._reader.is_alive(), f"goes on after {PATIENCE} s: {self.seen}"
        return self.seen

    def end(self, *, kill: bool = False) -> None:
        """Stop the program: close stdin, then send signals. Idempotent."""
        process = self._process
        assert process.stdin
        if process.poll() is None and not kill:
            process.stdin.close()
            process.terminate()
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                kill = True
        if kill:
            process.kill()
        process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        assert process.stdout
        process.stdin.close()
        process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self.seen.append(line.rstrip())
            self._lines.put(line.rstrip())
        self._lines.put(None)


@pytest.fixture(scope="module")
def built() -> Iterator[Network]:
    """Return the machines; skip the tests with the reason if they cannot be created."""
    network = Network()
    why: object = "`ip` is missing (apt-get install iproute2)" if shutil.which("ip") is None else ""
    try:
        if not why:
            network.build()
    except (OSError, subprocess.CalledProcessError) as error:
        network.remove()
        why = getattr(error, "stderr", "") or error
    if why:
        pytest.skip(f"NETWORK NAMESPACES CANNOT BE MADE HERE, two machines are not tested: {why}")
    yield network
    network.remove()


@pytest.fixture
def network(built: Network) -> Iterator[Network]:
    """Return the machines; stop their programs after the test."""
    built.running = ExitStack()
    yield built
    built.running.close()


def start_master(network: Network, machine: str = "alpha", stack: str = "ours", **variables: str) -> Program:
    """Start a master on a machine, and return once it runs."""
    if stack == "ours":
        master = network.start(
            machine, [str(OUR_BIN / "roscore"), "-p", str(PORT), "--no-journal"], **variables
        )
        master.wait_for("Ctrl-C stops the master")
        return master
    master = network.start(machine, ["/usr/bin/rosmaster", "--core", "-p", str(PORT)], **variables)
    probe = f"import socket, time\nwhile socket.socket().connect_ex(('127.0.0.1', {PORT})): time.sleep(0.05)"
    network.start(machine, [sys.executable, "-c", probe]).lines_until_end()
    return master


ALL = [
    "beat True",
    "heard forward",
    "flag True from afar",
    "param [('name', 'r2'), ('wheels', 4)]",
    "count 42",
]


@pytest.mark.parametrize(
    ("core", "robot", "laptop"),
    [
        ("ours", "ours", "ours"),
        ("ours", "rospy", "ours"),
        ("ours", "ours", "rospy"),
        ("rospy", "ours", "ours"),
    ],
)
def test_two_machines_exchange_messages_calls_and_goals(
    network: Network, core: str, robot: str, laptop: str
) -> None:
    """ROS_MASTER_URI is the only variable set. Machines announce their host names, which the hosts files resolve."""
    start_master(network, stack=core)
    network.peer("alpha", "robot", robot).wait_for("ready")
    lines = network.peer("beta", "laptop", laptop).lines_until_end()
    assert [line for line in lines if line in ALL] == ALL, lines


def test_two_machines_exchange_messages_by_ipv6(network: Network) -> None:
    start_master(network, ROS_IPV6="on", ROS_HOSTNAME="alpha6")
    on = {"ROS_IPV6": "on", "ROS_MASTER_URI": f"http://alpha6:{PORT}"}
    network.peer("alpha", "robot", "rospy", ROS_HOSTNAME="alpha6", **on).wait_for("ready")
    lines = network.peer("beta", "laptop", ROS_IP=BETA6, **on).lines_until_end()
    assert [line for line in lines if line in ALL] == ALL, lines
    lines = network.doctor("beta", ROS_HOSTNAME="beta6", **on)
    assert "ok      return path: the master's machine (alpha6) reaches nodes of this one" in lines
    assert not [line for line in lines if line.startswith("PROBLEM")]


# --- diagnosis: which side, which variable


def test_subscriber_names_the_side_with_the_wrong_address(network: Network) -> None:
    """The address is an unknown host name or an unused address, or a firewall blocks its ports."""
    start_master(network)

    with network.firewall(f"to {ALPHA} ipproto tcp dport 20000-20019"):
        listener = network.peer("beta", "listen")
        network.publish("alpha", ROS_HOSTNAME="alfa")
        network.publish("alpha", ROS_IP="10.99.1.77")
        network.publish("alpha", MINIROSPY_PORTS="20000-20019")
        # The reverse direction is open.
        network.peer("beta", "robot").wait_for("ready")
        network.peer("alpha", "listen", MINIROSPY_PORTS="20000-20019").wait_for("beat")
        lines = {}
        while len(lines) < 3:
            line = listener.wait_for("cannot connect to the publisher of /beat at http://")
            lines[line.split("http://")[1].split(":")[0]] = line

    assert (
        "This machine does not know the name 'alfa': on the publisher's machine set ROS_IP" in lines["alfa"]
    )
    assert "set ROS_IP on the publisher's machine to the address by which this one" in lines["10.99.1.77"]
    assert "timed out" in lines["alpha"]
    assert "if it can, a firewall is in the way" in lines["alpha"]


def test_node_on_loopback_warns_of_a_remote_master(network: Network) -> None:
    start_master(network)
    line = network.peer("beta", "robot", ROS_IP="127.0.0.1").wait_for("set ROS_IP")
    assert "is registered at '127.0.0.1', but the master is on another machine" in line


def test_doctor_checks_the_return_path_from_the_master(network: Network) -> None:
    start_master(network)
    assert network.doctor("beta")[-1] == "all is well"
    assert (
        "PROBLEM variables: ROS_IP=127.0.0.1 is this machine alone, but the master is on another one (alpha) -> "
        f"export ROS_IP={BETA}" in network.doctor("beta", ROS_IP="127.0.0.1")
    )
    network.ip("beta", "addr add 10.99.2.77/24 dev eth0")
    try:
        with network.firewall(f"to 10.99.2.77 from {ALPHA}"):
            lines = network.doctor("beta", ROS_IP="10.99.2.77")
    finally:
        network.ip("beta", "addr del 10.99.2.77/24 dev eth0")
    (line,) = [each for each in lines if "return path" in each]
    assert line.startswith(
        "PROBLEM return path: the master's machine (alpha) does not reach this one at 10.99.2.77:"
    )
    assert line.endswith(f" -> export ROS_IP={BETA}")


def test_two_doctors_check_both_directions(network: Network) -> None:
    """The master is on alpha, and beta listens. Check alpha's report with and without beta's name, and behind a firewall."""
    start_master(network)
    listener = network.start("beta", [str(OUR_BIN / "minirospy"), "doctor", "--listen"])
    listener.wait_for("listening: type `minirospy doctor` on the other machine")
    lines = network.doctor("alpha")
    assert lines[-1] == "all is well"
    assert "ok      both directions: this machine reaches beta, and beta this one" in lines
    listener.wait_for("ok      both directions: alpha (/minirospy_doctor_alpha_")
    lines = network.doctor("alpha", "beta")
    assert lines[-1] == "all is well"
    assert (
        f"ok      other machine: beta ({BETA}) is reached: it answers, and no master listens at its port {PORT}; "
        f"this machine is {ALPHA} to it" in lines
    )
    ports = {"MINIROSPY_PORTS": "20000-20019"}
    with network.firewall(f"to {ALPHA} ipproto tcp dport 20000-20019"):
        lines = network.doctor("alpha", ROS_IP=ALPHA, **ports)
    (line,) = [each for each in lines if each.startswith("PROBLEM")]
    assert line.startswith(
        "PROBLEM return path: beta does not reach this one at 10.99.1.2:20001: no answer -> a firewall"
    )
    listener.wait_for(
        "PROBLEM both directions: 10.99.1.2: it reaches this machine, and this one does not reach it"
    )

    with network.firewall(f"from {BETA} to {ALPHA}"):
        # beta's responses are lost, so it counts as unreachable.
        (line,) = [each for each in network.doctor("alpha") if each.startswith("PROBLEM")]

    assert "nothing comes back from 'beta' -> if `ping beta` fails too" in line
    listener.end()
    assert network.doctor("alpha")[-1] == "all is well"
    (line,) = [each for each in network.doctor("alpha", BETA) if each.startswith("warning")]
    assert line.startswith(
        f"warning both directions: no doctor listens on {BETA}, so the return path was not checked -> type"
    )
    with network.firewall(f"from {BETA} to {ALPHA}"):
        lines = network.doctor("alpha", "beta")
    assert f"PROBLEM other machine: nothing comes back from beta ({BETA}) -> see that it is on" in "\n".join(
        lines
    )


@pytest.mark.parametrize(
    ("uri", "said"),
    [
        (
            f"http://alpha:{PORT}",
            "alpha is there, but nothing listens at http://alpha:11411 (10.99.1.2) -> start `roscore`",
        ),
        (
            f"http://10.99.1.55:{PORT}",
            "nothing comes back from http://10.99.1.55:11411 -> see that 10.99.1.55 is on",
        ),
        (f"http://alpa:{PORT}", "this machine does not know the name 'alpa' of ROS_MASTER_URI"),
    ],
)
def test_doctor_explains_an_unreachable_master(network: Network, uri: str, said: str) -> None:
    assert "PROBLEM master: " + said in "\n".join(network.doctor("beta", ROS_MASTER_URI=uri))


# --- what breaks, and comes back


def test_connection_recovers_after_a_cable_was_pulled(network: Network) -> None:
    """The cable is unplugged for longer than keepalive takes, so the subscriber closes the connection, and reconnects later."""
    start_master(network)
    robot = network.peer("alpha", "robot")
    listener = network.peer("beta", "listen", TEST_KEEPALIVE="1")
    listener.wait_for("beat")
    robot.wait_for("subscribed")
    for end in ("va", "vb"):
        network.ip("router", f"link set {end} down")
    time.sleep(3.5)  # the test needs this silence
    for end in ("va", "vb"):
        network.ip("router", f"link set {end} up")
    robot.wait_for("subscribed")
    listener.wait_for("beat")


def test_nodes_register_again_with_an_empty_master(network: Network) -> None:
    """Nodes, also those on the other machine, register again with the new master, and connections stay open."""
    master = start_master(network)
    robot = network.peer("beta", "robot")
    robot.wait_for("ready")
    listener = network.peer("alpha", "listen")
    listener.wait_for("beat")
    master.end(kill=True)
    start_master(network)
    listener.wait_for("has restarted: registered again")
    network.peer("alpha", "listen").wait_for("beat")
    # The program's output may arrive later than the message that it sent.
    for _ in range(2):
        robot.wait_for("subscribed")
    assert sum(line == "subscribed" for line in robot.seen) == 2
