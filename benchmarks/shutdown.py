"""Many nodes shut down together. How many registrations are left at the master?

    python benchmarks/shutdown.py --nodes 200 --rounds 20
    python benchmarks/shutdown.py --launch --nodes 100 --rounds 10

Each node publishes, subscribes and offers a service. All receive Ctrl-C at the same moment, like the processes of one terminal;
with ``--launch``, roslaunch receives it, and with ``--kill`` the nodes get SIGKILL while roslaunch keeps running. Each round
prints a line; the exit status is 1 if a node, a topic or a service is left. Does not run on Windows.
"""

from __future__ import annotations

import argparse
import atexit
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil

from minirospy.base.errors import MinirospyError
from minirospy.runtime.rpc.master_proxy import MasterProxy

TESTED = "/tested"
START_SECONDS = 300.0
EXIT_SECONDS = 120.0
STARTING = 20

NODE = """\
import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

rospy.init_node("node")
name = rospy.get_name()
publisher = rospy.Publisher(name + "/out", String, queue_size=1)
rospy.Subscriber("/common", String, print)
rospy.Service("~trigger", Trigger, lambda request: TriggerResponse())
"""


def left(master: MasterProxy) -> set[str]:
    """Return the names of the tested nodes that the master knows."""
    return {
        node
        for table in master.get_system_state()
        for nodes in table.values()
        for node in nodes
        if node.startswith(TESTED)
    }


def wait_until(condition: Callable[[], bool], seconds: float, what: str) -> None:
    """Wait for a condition. Raise SystemExit with ``what`` if it does not become true."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f"{what} within {seconds:g} s")
        time.sleep(0.05)


def fork_nodes(master: MasterProxy, count: int, pids: list[int]) -> None:
    """Fork nodes in groups, so that each need not import the modules; append their process ids to ``pids``."""
    import rospy
    import std_srvs.srv  # noqa: F401

    for number in range(count):
        pid = os.fork()
        if pid:
            pids.append(pid)
            wait_until(
                lambda: ready(master) > len(pids) - STARTING,
                START_SECONDS,
                f"node {len(pids)} has not started",
            )
            continue
        status = 1
        try:
            # Put all processes into one group, as for the terminal's Ctrl-C.
            os.setpgid(0, pids[0] if pids else 0)
            sys.argv = ["node", f"__name:={TESTED[1:]}{number}"]
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            exec(NODE, {})
            rospy.spin()
            status = 0
        except Exception:  # noqa: BLE001 - a fault of this node must be seen, and not reach the parent's code
            traceback.print_exc()
        finally:
            atexit._run_exitfuncs()
            sys.stdout.flush()
            os._exit(status)


def round_of_forks(master: MasterProxy, nodes: int) -> tuple[float, int]:
    """Start nodes and interrupt all; return the seconds until the last process has exited, and the number of failed ones."""
    pids: list[int] = []
    try:
        fork_nodes(master, nodes, pids)
        wait_until(lambda: ready(master) >= nodes, START_SECONDS, f"{nodes} nodes have not started")
        start = time.monotonic()
        os.killpg(pids[0], signal.SIGINT)
        failed = sum(os.waitpid(pid, 0)[1] != 0 for pid in pids)
        pids.clear()
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGKILL)
    return time.monotonic() - start, failed


def ready(master: MasterProxy) -> int:
    """Return how many of the tested nodes have registered their service, which is their last call."""
    services = master.get_system_state().services
    return sum(name.startswith(TESTED) and name.endswith("/trigger") for name in services)


def write_package(folder: Path, nodes: int) -> Path:
    """Write a package with the node, and a launch file; return the file's path."""
    package = folder / "src" / "shutdown_nodes"
    (package / "scripts").mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package format='2'><name>shutdown_nodes</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@b.c'>m</maintainer><license>MIT</license></package>"
    )
    script = package / "scripts" / "node.py"
    script.write_text(f"#!{sys.executable}\n{NODE}rospy.spin()\n")
    script.chmod(0o755)
    file = package / "all.launch"
    lines = [
        f"<node name='{TESTED[1:]}{number}' pkg='shutdown_nodes' type='node.py'/>" for number in range(nodes)
    ]
    file.write_text("\n".join(["<launch>", *lines, "</launch>"]))
    return file


def round_of_launch(
    master: MasterProxy, nodes: int, file: Path, environ: dict[str, str], *, kill: bool
) -> tuple[float, int]:
    """Launch the nodes and stop them; return the number of seconds, and roslaunch's exit status."""
    command = [sys.executable, "-m", "minirospy.ros.roslaunch.commands.roslaunch", "--wait", str(file)]
    launch = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL)
    try:
        wait_until(lambda: ready(master) >= nodes, START_SECONDS, f"{nodes} nodes have not started")
        start = time.monotonic()
        if kill:
            for process in psutil.Process(launch.pid).children():
                if any(word.startswith("__name:=") for word in process.cmdline()):
                    process.kill()
        else:
            launch.send_signal(signal.SIGINT)
        status = launch.wait(EXIT_SECONDS)
    finally:
        launch.kill()
    return time.monotonic() - start, status


@contextmanager
def running_master(environ: dict[str, str], *, is_real: bool) -> Iterator[MasterProxy]:
    """Run a master, minirospy's or rosmaster."""
    from minirospy.base.environment import split_uri

    port = str(split_uri(environ["ROS_MASTER_URI"], "http")[1])
    command = [sys.executable, "-m", "minirospy.ros.rosmaster.commands.master", "-q", "-p", port]
    if is_real:
        environ = {name: value for name, value in environ.items() if name != "PYTHONPATH"}
        command = [shutil.which("rosmaster", path="/usr/bin") or "rosmaster", "--core", "-p", port]
    process = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL)
    # Real rosmaster may be busy for a long time.
    master = MasterProxy(environ["ROS_MASTER_URI"], "/benchmark", timeout=60.0)
    try:
        wait_until(master.is_online, 20.0, "the master has not started")
        yield master
    finally:
        master.close()
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            # Real rosmaster may hang after its nodes have exited.
            process.kill()
            process.wait()


@contextmanager
def busy_loops(count: int) -> Iterator[None]:
    """Keep processors busy."""
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def main() -> int:
    """Run the rounds and print what is left after each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--nodes", type=int, default=200, help="how many")
    parser.add_argument("--rounds", type=int, default=20, help="how often")
    parser.add_argument("--launch", action="store_true", help="by a roslaunch, which gets the Ctrl-C")
    parser.add_argument("--kill", action="store_true", help="kill the launched nodes instead")
    parser.add_argument("--real", action="store_true", help="with the real rosmaster")
    parser.add_argument("--busy", type=int, default=0, metavar="N", help="busy loops beside the nodes")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    ghosts = []

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        for name in [name for name in os.environ if name.startswith("ROS_")]:
            del os.environ[name]
        os.environ |= {
            "ROS_HOME": str(folder / "home"),
            "ROS_LOG_DIR": str(folder / "log"),
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_IP": "127.0.0.1",
            "ROS_PACKAGE_PATH": str(folder / "src"),
        }
        file = write_package(folder, options.nodes)
        stack.enter_context(busy_loops(options.busy))

        try:
            master = stack.enter_context(running_master(dict(os.environ), is_real=options.real))

            for _ in range(options.rounds):
                if options.launch or options.kill:
                    seconds, failed = round_of_launch(
                        master, options.nodes, file, dict(os.environ), kill=options.kill
                    )
                else:
                    seconds, failed = round_of_forks(master, options.nodes)

                ghosts.append(len(left(master)))
                print(
                    f"{options.nodes} nodes, {seconds:6.2f} s, {failed} failed, {ghosts[-1]} left", flush=True
                )
        except MinirospyError as error:
            raise SystemExit(f"the master: {error}") from error

    print(f"left: {min(ghosts)} to {max(ghosts)} of {options.nodes}, {options.rounds} rounds")
    return 1 if any(ghosts) else 0


if __name__ == "__main__":
    sys.exit(main())
