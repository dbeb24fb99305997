"""A node's lifecycle in cases in which real rospy hangs or fails: signals, forks, threads, pytest.

tests/referee has the rest.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from minirospy.base.errors import RpcRefused
from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.master_proxy import MasterProxy, SlaveProxy
from minirospy.runtime.transport.loop import LoopThread
from tests.waiting import wait_until

POSIX_ONLY = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals, and no fork")


GUARD = 45.0  # seconds after which a program is considered hung; a machine that runs tests may stall


def read_line(process: subprocess.Popen[str]) -> str:
    """Return a line that a program prints, and read no more, because communicate() would miss buffered data."""
    assert process.stdout
    line = b""
    while not line.endswith(b"\n") and (byte := os.read(process.stdout.fileno(), 1)):
        line += byte
    return line.decode().replace("\r\n", "\n")


def start(script: str, *arguments: str) -> subprocess.Popen[str]:
    """Return a program that has printed "ready"."""
    process = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", script, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.PIPE,
        text=True,
    )
    line = read_line(process)
    assert line == "ready\n", process.communicate()[1]
    return process


# First line of a slow program: disables the report of what a shutdown waits for, which a busy machine triggers.
NO_REPORT = "from minirospy.client import shutdown; shutdown._REPORT_SECONDS = 1000.0\n"


# First line of a program that reports earlier what its shutdown waits for: soon after it has interrupted its main thread.
SOON_REPORT = "from minirospy.client import shutdown; shutdown._REPORT_SECONDS = 1.2\n"


def deliver(process: subprocess.Popen[str], number: int) -> None:
    """Send a signal, and wait until the process has received it: of two pending signals, it would receive only one."""
    process.send_signal(number)
    if sys.platform != "linux":
        time.sleep(0.1)
        return
    status = Path(f"/proc/{process.pid}/status")

    def is_received() -> bool:
        if process.poll() is not None:
            return True
        pending = re.search(r"ShdPnd:\s*([0-9a-f]+)", status.read_text(encoding="utf-8"))
        return not pending or not int(pending[1], 16) >> number - 1 & 1

    wait_until(is_received, pause=0.001)


def signalled(script: str, number: int) -> tuple[int, str, str, float]:
    """Return a program's exit status, its output after the signal, and how long it ran."""
    process = start(script)
    # Keep the program's stdin open, so that a program that reads it can only exit because of the signal.
    open_input, process.stdin = process.stdin, None
    assert open_input
    with open_input:
        start_time = time.monotonic()
        process.send_signal(number)
        output, errors = process.communicate(timeout=GUARD)
        return process.returncode, output, errors, time.monotonic() - start_time


SECONDS = 3.0  # seconds; one is promised, but a machine that runs tests may be slow


def in_time(program: Callable[[], float]) -> None:
    """Check that ``program`` exits within SECONDS. If the machine stalls, try up to three times."""
    took = [program()]
    while min(took) >= SECONDS and len(took) < 3:
        took.append(program())
    assert min(took) < SECONDS, took


PROGRAM = """
import atexit, concurrent.futures, ctypes, multiprocessing, os, socket, subprocess, sys, threading, time
import rospy
from std_msgs.msg import Bool

def ready(once=["ready"]):
    while once:
        print(once.pop(), flush=True)

rospy.init_node("program")
pub = rospy.Publisher("t", Bool, queue_size=1)
rospy.on_shutdown(lambda: print("hook", flush=True))
atexit.register(print, "atexit")
try:
{}
finally:
    if rospy.is_shutdown():
        print("finally", flush=True)
"""

ONE_SIGNAL = {
    # The program's code, and its output from the signal on.
    "time.sleep": ("ready(); time.sleep(60)", "hook finally atexit"),
    "a lock": ("ready(); threading.Event().wait()", "hook finally atexit"),
    "a busy loop": ("ready()\nwhile True: pass", "hook finally atexit"),
    "input": ("ready(); sys.stdin.readline()", "hook finally atexit"),
    "a socket": ("pair = socket.socketpair(); ready(); pair[0].recv(1)", "hook finally atexit"),
    "publishing": ("ready()\nwhile True: pub.publish(True); time.sleep(0.01)", "hook finally atexit"),
    "another program": ("ready(); subprocess.call(['sleep', '60'])", "hook finally atexit"),
    "C code": ("ready(); ctypes.CDLL(None).pause()", "hook finally atexit"),
    "a loop that polls": (
        "while not rospy.is_shutdown(): ready(); time.sleep(0.1)\nprint('after')",
        "hook after finally atexit",
    ),
    "spin beside a thread that cleans up": (
        "def work():\n    while not rospy.is_shutdown(): time.sleep(0.01)\n    threading.main_thread().join()\n"
        "    time.sleep(1)\n    print('cleaned')\n"
        "threading.Thread(target=work).start()\nready(); rospy.spin()",
        "hook finally cleaned atexit",
    ),
    "a thread in rospy.sleep": (
        "threading.Thread(target=lambda: rospy.sleep(60)).start()\nready(); rospy.spin()",
        "hook finally atexit",
    ),
    "slow clean-up": (
        "try: ready(); rospy.spin()\nfinally:\n    time.sleep(1)\n    print('cleaned')",
        "hook cleaned finally atexit",
    ),
}
TWO_SIGNALS = {
    # The program's code; its output between the signals, including the report on stderr of what it waits for; its
    # output afterwards.
    "a slow loop that polls": (
        "while not rospy.is_shutdown(): ready(); time.sleep(60)",
        "hook",
        "MainThread",
        "finally atexit",
    ),
    "a loop that catches": (
        "while True:\n    try: ready(); time.sleep(60)\n    except Exception: print('caught')",
        "hook caught",
        "MainThread",
        "finally atexit",
    ),
    "a loop that catches what ends rospy.sleep": (
        "while True:\n    try: ready(); rospy.sleep(60)\n    except Exception: print('caught')",
        "hook caught",
        "MainThread",
        "finally atexit",
    ),
    "a thread without end": (
        "def work():\n    threading.main_thread().join()\n    ready()\n    time.sleep(60)\n"
        "threading.Thread(target=work, name='endless').start()",
        "hook",
        "endless",
        "atexit",
    ),
    "spin beside a slow thread that polls": (
        "def work():\n    while not rospy.is_shutdown(): ready(); time.sleep(60)\n"
        "threading.Thread(target=work, name='slow').start()\nready(); rospy.spin()",
        "hook finally",
        "slow",
        "atexit",
    ),
    "a pool of threads": (
        "concurrent.futures.ThreadPoolExecutor().submit(time.sleep, 60)\nready(); rospy.spin()",
        "hook finally",
        "ThreadPoolExecutor",
        "atexit",
    ),
    "a child process": (
        "multiprocessing.get_context('fork').Process(target=time.sleep, args=(60,), name='child').start()\n"
        "ready(); rospy.spin()",
        "hook finally",
        "child",
        "atexit",
    ),
}
SIGNALS = [signal.SIGINT, signal.SIGTERM] + ([signal.SIGHUP] if sys.platform != "win32" else [])


@POSIX_ONLY
@pytest.mark.parametrize(
    ("what", "number"), [(what, SIGNALS[index % len(SIGNALS)]) for index, what in enumerate(ONE_SIGNAL)]
)
def test_one_signal_ends_a_program_that_python_can_interrupt(master: str, what: str, number: int) -> None:
    body, prints = ONE_SIGNAL[what]
    script = PROGRAM.format(textwrap.indent(body, "    "))

    def program() -> float:
        status, output, errors, seconds = signalled(script, number)
        # On a machine that stalls, the program reports after two seconds what it is waiting for.
        errors = re.sub(r"\Ashutdown: still waiting for .*\n", "", errors) if seconds > 2 else errors
        assert (status, output.split(), errors) == (0, prints.split(), "")
        assert not is_known(master, "/program")
        return seconds

    in_time(program)


@POSIX_ONLY
@pytest.mark.parametrize(
    ("what", "number"), [(what, SIGNALS[index % len(SIGNALS)]) for index, what in enumerate(TWO_SIGNALS)]
)
def test_a_second_signal_ends_a_program_that_goes_on(master: str, what: str, number: int) -> None:
    body, prints, waits_for, then = TWO_SIGNALS[what]
    process = start(SOON_REPORT + PROGRAM.format(textwrap.indent(body, "    ")))
    process.send_signal(number)
    report = read_report(process)
    assert f" {waits_for}" in report
    for word in prints.split():
        assert read_line(process) == f"{word}\n"
    assert process.poll() is None
    # The report may come before the master's answer.
    wait_until(lambda: not is_known(master, "/program"))

    process.send_signal(number)
    process.wait(GUARD)
    if child := re.search(r"process child \((\d+)\)", report):
        # The child outlives its parent, and keeps the pipes open.
        os.kill(int(child[1]), signal.SIGKILL)
    output, errors = process.communicate(timeout=GUARD)
    assert (process.returncode, output.split(), errors) == (0, then.split(), "")


REQUEST = {
    # The program's code, its output from the request on, and whether it is interrupted.
    "input": ("ready(); sys.stdin.readline()", "hook finally atexit", True),
    "a lock": (
        "ready(); threading.Lock().acquire() and threading.Event().wait()",
        "hook finally atexit",
        True,
    ),
    "a busy loop": ("ready()\nwhile True: pass", "hook finally atexit", True),
    "time.sleep": ("ready(); time.sleep(60)", "hook finally atexit", True),
    "input in a loop that polls": (
        "while not rospy.is_shutdown(): ready(); sys.stdin.readline()\nprint('after')",
        "hook finally atexit",
        True,
    ),
    "input that is saved afterwards": (
        "try: ready(); sys.stdin.readline()\nexcept KeyboardInterrupt: time.sleep(1); print('saved')",
        "hook saved finally atexit",
        True,
    ),
    "a slow hook": (
        "rospy.on_shutdown(lambda: (time.sleep(1), print('saved', flush=True)))\nready(); sys.stdin.readline()",
        "hook saved finally atexit",
        True,
    ),
    "a slow loop that polls": (
        "while not rospy.is_shutdown(): ready(); time.sleep(1.5)\ntime.sleep(1); print('after')",
        "hook after finally atexit",
        False,
    ),
    "slow clean-up": (
        "try: ready(); rospy.spin()\nfinally:\n    time.sleep(1)\n    print('cleaned')",
        "hook cleaned finally atexit",
        False,
    ),
    "its own handler": (
        "import signal\nsignal.signal(signal.SIGINT, lambda *_: sys.exit('own'))\nready(); sys.stdin.readline()",
        "hook finally atexit",
        True,
    ),
    "the system's handler": (
        "import signal\nsignal.signal(signal.SIGINT, signal.SIG_DFL)\nready(); time.sleep(1.5); print('after')",
        "hook after finally atexit",
        False,
    ),
}


# First line of a program that is interrupted after shorter times.
SHORT_GRACE = (
    "from minirospy.client import shutdown; shutdown._REQUEST_GRACE_SECONDS = 0.5\n"
    "shutdown._REQUEST_GRACE_OF_POLLS_SECONDS = {}\n"
)


@POSIX_ONLY
@pytest.mark.parametrize("what", REQUEST)
def test_request_of_another_process_interrupts_a_main_thread_that_does_not_end(
    master: str, what: str
) -> None:
    body, prints, is_interrupted = REQUEST[what]
    # Do not limit the time of a loop that polls and exits by itself: the machine may stall.
    grace = SHORT_GRACE.format(0.5 if is_interrupted else 1000.0)
    process = start(grace + PROGRAM.format(textwrap.indent(body, "    ")))
    open_input, process.stdin = process.stdin, None
    assert open_input
    with open_input:
        request_shutdown(master, "/program", "user request")
        output, errors = process.communicate(timeout=GUARD)
    assert output.split() == ["shutdown", "request:", "user", "request", *prints.split()]
    assert not is_known(master, "/program")
    own = ["own"] if what == "its own handler" else []
    assert process.returncode == len(own)
    if is_interrupted:
        assert errors.splitlines()[1:] == own
        assert re.match(
            r"shutdown: thread MainThread at <string>:\d+ has not ended: interrupting it as Ctrl-C does "
            r"\(external shutdown request from \[/test\]: \[user request\]\)\n",
            errors,
        )
    else:
        assert errors == ""


@POSIX_ONLY
def test_second_node_of_the_name_interrupts_the_first(master: str) -> None:
    process = start(SHORT_GRACE.format(0.5) + PROGRAM.format("    ready(); sys.stdin.readline()"))
    open_input, process.stdin = process.stdin, None
    second = start('import rospy; rospy.init_node("program"); print("ready", flush=True); rospy.spin()')
    try:
        output, errors = process.communicate(timeout=GUARD)
    finally:
        second.kill()
        second.communicate()
        assert open_input
        open_input.close()
    reason = "[/program] Reason: new node registered with same name"
    assert output == f"shutdown request: {reason}\nhook\nfinally\natexit\n"
    assert f"(external shutdown request from [/master]: [{reason}])" in errors
    assert process.returncode == 0


@POSIX_ONLY
def test_an_interactive_session_keeps_its_variables_after_a_request(master: str) -> None:
    """The session prints nothing until the next line is executed."""
    process = start(
        "import sys; sys.ps1 = '> '\n"
        + SHORT_GRACE.format(0.5)
        + PROGRAM.format("    ready(); time.sleep(2)")
    )
    request_shutdown(master, "/program", "user request")
    assert process.communicate(timeout=GUARD) == (
        "shutdown request: user request\nhook\nfinally\natexit\n",
        "",
    )


@POSIX_ONLY
def test_interrupted_program_leads_to_its_interactive_session(master: str) -> None:
    program = 'import time, rospy; rospy.init_node("program"); print("ready", flush=True); time.sleep(60)'
    with subprocess.Popen(
        [sys.executable, "-i", "-c", program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert read_line(process) == "ready\n"
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate("print(rospy.is_shutdown())\n", timeout=GUARD)
    assert (process.returncode, output) == (0, "True\n")
    assert "Error in sys.excepthook" not in errors


def request_shutdown(master: str, name: str, reason: str) -> None:
    """Shut the node down as ``rosnode kill`` does."""
    proxy = MasterProxy(master, "/test")
    slave = SlaveProxy(proxy.lookup_node(name), "/test")
    slave.shutdown(reason)
    slave.close()
    proxy.close()


def read_report(process: subprocess.Popen[str]) -> str:
    """Return the line on stderr that reports what a shutdown waits for."""
    assert process.stderr
    line = process.stderr.readline()
    assert line.startswith("shutdown: still waiting for ")
    assert line.endswith("Press Ctrl-C again to interrupt it, and a third time to end the process\n")
    return line


IN_C_CODE = """
import ctypes, sys, threading, time
import rospy
from minirospy.client.session import current_session
from minirospy.client.shutdown import Action

# Represents zlib.compress() of much data: C code that lets other threads run, and that no signal interrupts. It returns
# when another thread has read a line, and the library's thread is about to raise the exception that the line names.
libc = ctypes.CDLL(None)
mutex = ctypes.create_string_buffer(64)
libc.pthread_mutex_lock(mutex)

watchdog, machine = current_session().signals, current_session().lifecycle.machine

def release():
    exception = sys.stdin.readline().strip()
    while exception and not (watchdog._is_nudge and watchdog._interrupt is Action[exception]):
        time.sleep(0.001)
    libc.pthread_mutex_unlock(mutex)

# The half second before the hooks run are fifty ticks of a hundredth of a second, or fewer, longer ones.
tick, ticks = machine.tick, 0

def count(now):
    global ticks
    ticks += machine.signals > 0
    actions = tick(now)
    if Action.RUN_HOOKS in actions and ticks > 55:
        print("ticks until the hooks run:", ticks, flush=True)
    return actions

machine.tick = count
threading.Thread(target=release, daemon=True).start()
rospy.init_node("saves")
rospy.on_shutdown(lambda: print("motors stopped", flush=True))
print("ready", flush=True)
try:
    libc.pthread_mutex_lock(mutex)
finally:
    print("saved:", type(sys.exc_info()[1]).__name__, flush=True)
"""


@POSIX_ONLY
@pytest.mark.parametrize(
    ("signals", "prints", "status"),
    [
        (1, "motors stopped, saved: ROSInterruptException", 0),
        (2, "motors stopped, saved: KeyboardInterrupt", 0),
        (3, "motors stopped", 130),
    ],
)
def test_c_code_is_awaited_and_finally_runs(master: str, signals: int, prints: str, status: int) -> None:
    process = start(SOON_REPORT + IN_C_CODE)
    process.send_signal(signal.SIGINT)
    report = read_report(process)
    assert "MainThread at <string>:" in report
    assert read_line(process) == "motors stopped\n"
    wait_until(lambda: not is_known(master, "/saves"))

    for _ in range(signals - 1):
        deliver(process, signal.SIGINT)
    if signals < 3:
        # The library's thread notices the signal; after that, the call of C code returns.
        assert process.stdin
        process.stdin.write(("INTERRUPT" if signals == 1 else "KEYBOARD_INTERRUPT") + "\n")
    else:
        # communicate() closes stdin, which would end the call of C code.
        process.wait(timeout=GUARD)
    output, errors = process.communicate(timeout=GUARD)
    assert (process.returncode, errors) == (status, "")
    assert ["motors stopped", *output.splitlines()] == prints.split(", ")


@POSIX_ONLY
def test_hooks_run_in_time_while_the_main_thread_is_in_c_code(master: str) -> None:
    """The test of the state machine covers the half second after which another thread runs the hooks, with a manual clock.

    Here the program counts the clock ticks, because elapsed time proves nothing on a busy machine.
    """
    process = start(IN_C_CODE)
    process.send_signal(signal.SIGTERM)
    assert read_line(process) == "motors stopped\n"
    process.communicate("\n", timeout=GUARD)


@POSIX_ONLY
@pytest.mark.parametrize("numbers", [[signal.SIGINT] * 2, [signal.SIGTERM, signal.SIGHUP]], ids=str)
@pytest.mark.parametrize("waits", ["rospy.spin()", "while not rospy.is_shutdown(): rospy.sleep(60)"])
def test_signals_in_quick_succession(master: str, waits: str, numbers: list[int]) -> None:
    process = start(f'import rospy; rospy.init_node("often"); print("ready", flush=True)\n{waits}')
    for number in numbers:
        process.send_signal(number)
    assert process.communicate(timeout=GUARD) == ("", "")
    assert process.returncode == 0
    assert not is_known(master, "/often")


@POSIX_ONLY
def test_the_third_signal_ends_a_clean_up_that_catches_everything(master: str) -> None:
    script = """
import time, rospy
rospy.init_node("slow")
print("ready", flush=True)
try:
    rospy.spin()
finally:
    while True:
        try:
            print("cleans", flush=True)
            time.sleep(60)
        except BaseException as error:
            print(type(error).__name__, flush=True)
"""
    process = start(script)
    process.send_signal(signal.SIGTERM)

    assert read_line(process) == "cleans\n"
    process.send_signal(signal.SIGTERM)
    assert read_line(process) == "KeyboardInterrupt\n"
    assert read_line(process) == "cleans\n"

    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=GUARD)
    assert (process.returncode, output) == (130, "")


LEAVES = """
import sys, time
import rospy
from minirospy.runtime.node import registration
from std_msgs.msg import Bool
# The limit for a master that is silent, else ten seconds: a signal, not this limit, is to end the wait.
registration.SILENT_SECONDS = registration.STILL_SILENT_SECONDS = 1000.0
rospy.init_node("leaves")
rospy.Publisher("t", Bool, queue_size=1)
print("ready", flush=True)
try:
    {}
finally:
    print("finally", flush=True)
"""


@contextlib.contextmanager
def master_that_stops(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], object]]:
    """Run a master; yield a function that stops it: after that it accepts connections, but never responds."""
    loop, go_on = LoopThread("test-master"), threading.Event()
    serving = Master()
    loop.run(serving.start())
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{serving.port}")
    try:
        yield lambda: loop.post(go_on.wait)
    finally:
        go_on.set()
        loop.run(serving.close(), 30.0)
        loop.close()


@POSIX_ONLY
@pytest.mark.parametrize("body", ["rospy.spin()", "while True: time.sleep(0.1); rospy.loginfo('')"])
def test_a_second_signal_ends_the_wait_for_a_silent_master(
    body: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with master_that_stops(monkeypatch) as stop:
        process = start(SOON_REPORT + LEAVES.format(body))
        stop()
        process.send_signal(signal.SIGINT)

        assert process.stderr
        assert process.stderr.readline() == (
            "shutdown: still waiting for the master to unregister this node. "
            "Press Ctrl-C again to interrupt it, and a third time to end the process\n"
        )
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=GUARD)
        assert (process.returncode, output.splitlines()[-1], errors) == (0, "finally", "")


@POSIX_ONLY
@pytest.mark.parametrize("way", ["passes", "stands", "elsewhere", "twice"])
def test_a_shutdown_at_any_step_of_init_node(master: str, way: str) -> None:
    """Nothing is printed, there is no deadlock, and nothing remains registered at the master.

    Tests each hundredth step; ``python tests/client/signal_steps.py stands`` tests all of them.
    """
    done = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("signal_steps.py")), way, "100"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@POSIX_ONLY
def test_nohup(master: str) -> None:
    """A program that ignores SIGHUP continues when the terminal is closed."""
    process = start("""
import signal, rospy
signal.signal(signal.SIGHUP, signal.SIG_IGN)
rospy.init_node("stays")
print("ready", flush=True)
input()
print("still there")
""")
    process.send_signal(signal.SIGHUP)
    assert process.communicate("\n", timeout=GUARD) == ("still there\n", "")


@pytest.mark.skipif(sys.platform != "linux", reason="Linux has process namespaces")
def test_the_first_process_of_a_container(master: str) -> None:
    """The kernel does not deliver signals to this process unless it has a handler for them."""
    unshare = ["unshare", "--pid", "--fork", "--kill-child"]
    if (
        not shutil.which("unshare")
        or subprocess.run([*unshare, "true"], capture_output=True, check=False).returncode
    ):
        pytest.skip("needs the right to make a process namespace")
    script = """
import os, time, rospy
rospy.init_node("first")
rospy.on_shutdown(lambda: print("hook", flush=True))
print(os.getpid(), flush=True)
time.sleep(60)
"""

    def program() -> float:
        process = subprocess.Popen(
            [*unshare, sys.executable, "-c", script],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout
        assert process.stdout.readline() == "1\n"
        start_time = time.monotonic()
        for child in psutil.Process(process.pid).children():
            child.terminate()
        assert process.communicate(timeout=GUARD) == ("hook\n", "")
        assert process.returncode == 0
        return time.monotonic() - start_time

    in_time(program)


@POSIX_ONLY
def test_a_loop_that_polls_keeps_its_clean_up(master: str) -> None:
    script = """
import time, rospy
rospy.init_node("caller")
took = 9
while took > 1:  # a turn in which the machine stalled shows nothing
    start_time = time.monotonic()
    rospy.is_shutdown()
    time.sleep(0.9)
    took = time.monotonic() - start_time
print("ready", flush=True)
while not rospy.is_shutdown():
    time.sleep(0.9)
time.sleep(0.2)
print("cleaned up", flush=True)
"""
    status, output, errors, _ = signalled(NO_REPORT + script, signal.SIGINT)
    assert (status, output, errors) == (0, "cleaned up\n", "")


@POSIX_ONLY
def test_a_program_that_stands_still_keeps_its_time(master: str) -> None:
    """The grace period after a signal counts only the time during which the program can run, even if the machine stalls."""
    process = start("""
import signal, time, rospy
rospy.init_node("still")
ran = []
rospy.on_shutdown(lambda: ran.append(print("hook", flush=True)))
print("ready", flush=True)
signal.raise_signal(signal.SIGTERM)
while not ran:
    time.sleep(0.001)
# What is granted begins at the library's next tick.
time.sleep(0.1)
print("granted", flush=True)
for _ in range(3):
    time.sleep(0.02)
print("done", flush=True)
""")
    assert read_line(process) == "hook\n"
    assert read_line(process) == "granted\n"
    process.send_signal(signal.SIGSTOP)
    time.sleep(1.0)
    process.send_signal(signal.SIGCONT)
    assert process.communicate(timeout=GUARD) == ("done\n", "")


@POSIX_ONLY
def test_a_program_that_was_notified_keeps_its_clean_up(master: str) -> None:
    script = """
import time, rospy
rospy.init_node("notified")
print("ready", flush=True)
try:
    rospy.wait_for_service("/nobody")
except rospy.ROSInterruptException:
    time.sleep(0.7)
    print("cleaned up", flush=True)
"""
    status, output, errors, _ = signalled(NO_REPORT + script, signal.SIGINT)
    assert (status, output, errors) == (0, "cleaned up\n", "")


@POSIX_ONLY
def test_a_second_ctrl_c_ends_a_hook(master: str) -> None:
    script = """
import time, rospy
def hook():
    print("in the hook", flush=True)
    time.sleep(60)
rospy.init_node("slow")
rospy.on_shutdown(hook)
print("ready", flush=True)
rospy.spin()
"""

    def program() -> float:
        process = start(script)
        process.send_signal(signal.SIGINT)
        assert process.stdout
        assert process.stdout.readline() == "in the hook\n"
        start_time = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=GUARD)
        assert not is_known(master, "/slow")
        return time.monotonic() - start_time

    in_time(program)


FORKS = {
    "os.fork": """
pid = os.fork()
if pid == 0:
    child()
    sys.exit(0)
assert os.waitpid(pid, 0)[1] == 0
""",
    "Process": """
worker = multiprocessing.get_context("fork").Process(target=child)
worker.start()
worker.join()
assert worker.exitcode == 0
""",
    "terminate": """
worker = multiprocessing.get_context("fork").Process(target=time.sleep, args=(60,))
worker.start()
worker.terminate()
worker.join()
assert worker.exitcode == -15
""",
    "Pool": """
with multiprocessing.get_context("fork").Pool(2) as pool:
    assert pool.map(abs, [-1, -2]) == [1, 2]
""",
    "a separate node": """
def own_node():
    child()
    for inherited in (pub, sub):
        inherited.unregister()
    service.shutdown()
    rospy.init_node("own", argv=[])
    rospy.loginfo("own line")
    heard = threading.Event()
    subscriber = rospy.Subscriber("t", Int32, lambda message: heard.set())
    assert heard.wait(30)
    assert rospy.get_name() == "/own"
    assert [kind.__name__ for kind in map(type, logging.getLogger("rosout").handlers)] == [
        "RosStreamHandler", "RosOutHandler"
    ]
worker = multiprocessing.get_context("fork").Process(target=own_node)
worker.start()
while worker.is_alive():
    pub.publish(1)
    worker.join(0.02)
assert worker.exitcode == 0
""",
}


@POSIX_ONLY
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
@pytest.mark.parametrize("how", FORKS)
def test_a_fork_leaves_the_parents_node_alone(master: str, how: str) -> None:
    script = f"""
import logging, multiprocessing, os, sys, threading, time
import rospy
from std_msgs.msg import Int32
from std_srvs.srv import Empty

def child():
    assert rospy.get_name() == "/parent" and not rospy.is_shutdown()
    rospy.loginfo("a line of the child's")
    rospy.Time.now()
    pub.publish(99)
    assert rospy.get_param("/nope", 5) == 5

rospy.init_node("parent", argv=[])
rospy.on_shutdown(lambda: print("hook of", rospy.get_name()))
heard, has_come = [], threading.Event()

def hear(message):
    heard.append(message.data)
    if message.data == 7:
        has_come.set()

sub = rospy.Subscriber("t", Int32, hear)
pub = rospy.Publisher("t", Int32, queue_size=10)
service = rospy.Service("s", Empty, lambda request: {{}})
pub.wait_for_subscribers()
{FORKS[how]}
assert not rospy.is_shutdown()
pub.publish(7)
has_come.wait()
assert 99 not in heard
assert rospy.get_master().lookupNode("/parent")[2] == rospy.get_node_uri()
print("ends")
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", script],
        capture_output=True,
        text=True,
        timeout=GUARD,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if not line.startswith("[INFO]")]
    errors = [line for line in done.stderr.splitlines() if NO_NODE.format("the publisher of /t") not in line]
    assert (done.returncode, lines, errors) == (0, ["ends", "hook of /parent"], [])


NO_NODE = (
    "{} has no effect in this process, which is a fork of node [/parent]: call rospy.init_node() in the child "
    "process, and create it after that"
)
FORK_PROGRAM = """
import multiprocessing, sys, threading, time
import rospy
from std_msgs.msg import Int32
from std_srvs.srv import Empty

def child():
{}

{}
rospy.init_node("parent", argv=[])
pub = rospy.Publisher("t", Int32, queue_size=10)
proxy = rospy.ServiceProxy("s", Empty, persistent=True)
worker = multiprocessing.get_context("fork").Process(target=child)
"""
JOIN = "worker.start(); worker.join(); print(worker.exitcode)"
IN_A_FORK = {
    "inherited publisher": ("pub.publish(1); pub.publish(data=2)", "the publisher of /t", ""),
    "latched inherited publisher": ("pub.impl.enable_latch(); pub.publish(1)", "the publisher of /t", ""),
    "new publisher": ("rospy.Publisher('new', Int32, queue_size=1)", "the publisher of /new", ""),
    "subscriber": ("rospy.Subscriber('new', Int32, print)", "the subscriber of /new", ""),
    "service": ("rospy.Service('new', Empty, print)", "the service /new", ""),
    "listener of tf2": (
        "import tf2_ros; b = tf2_ros.Buffer(debug=False); tf2_ros.TransformListener(b)",
        "the subscriber of /tf",
        "",
    ),
    "buffer of tf2": (
        "import tf2_ros; tf2_ros.Buffer(debug=False).can_transform('a', 'b', rospy.Time(), rospy.Duration(0.01))",
        "a tf2_ros.Buffer of the parent process",
        "",
    ),
    "waiting for a message": ("rospy.wait_for_message('t', Int32)", "", "wait_for_message('t')"),
    "waiting for subscribers": ("pub.wait_for_subscribers()", "", "the publisher of /t"),
    "waiting for an action server": (
        "import actionlib, actionlib_tutorials.msg as m\n"
        "    actionlib.SimpleActionClient('a', m.FibonacciAction).wait_for_server()",
        "the publisher of /a/goal",
        "the action client of a",
    ),
    "simulated time": ("rospy.sleep(0.01)", "", "simulated time"),
}


@POSIX_ONLY
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
@pytest.mark.parametrize("what", IN_A_FORK)
def test_fork_without_a_node_reports_each_handle_that_has_no_effect(master: str, what: str) -> None:
    code, logged, raised = IN_A_FORK[what]
    before = "rospy.set_param('/use_sim_time', True)" if what == "simulated time" else ""
    body = textwrap.indent(f"try:\n    {code}\nexcept rospy.ROSException as error:\n    print(error)", "    ")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORK_PROGRAM.format(body, before) + JOIN],
        capture_output=True,
        text=True,
        timeout=GUARD,
        check=False,
    )
    printed = [NO_NODE.format(raised)] if raised else []
    assert (done.returncode, done.stdout.splitlines()) == (0, [*printed, "0"]), done.stderr
    assert done.stderr.count(NO_NODE.format(logged)) == (1 if logged else 0)
    assert "Traceback" not in done.stderr


@POSIX_ONLY
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
def test_node_of_a_forked_process_that_returns_leaves_the_master(master: str) -> None:
    body = """
    rospy.init_node("child", argv=[])
    rospy.on_shutdown(lambda: print("hook", flush=True))
    rospy.Publisher("mine", Int32, queue_size=1)
    print(rospy.get_master().lookupNode("/child")[0], flush=True)
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORK_PROGRAM.format(body, "") + JOIN],
        capture_output=True,
        text=True,
        timeout=GUARD,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "1\nhook\n0\n", "")
    assert not is_known(master, "/child")


@POSIX_ONLY
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
def test_fork_calls_a_persistent_service_by_its_own_connection(master: str) -> None:
    body = """
    proxy()
    print("called", flush=True)
"""
    script = """
callers = set()
def handle(request):
    callers.add(id(request._connection_header))
    return {}
service = rospy.Service("s", Empty, handle)
proxy()
worker.start(); worker.join()
proxy()
print(worker.exitcode, len(callers))
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORK_PROGRAM.format(body, "") + script],
        capture_output=True,
        text=True,
        timeout=GUARD,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "called\n0 2\n", "")


@pytest.mark.parametrize("method", [m for m in multiprocessing.get_all_start_methods() if m != "fork"])
def test_other_start_methods(master: str, tmp_path: Path, method: str) -> None:
    script = tmp_path / "program.py"
    script.write_text(f"""
import contextlib
import multiprocessing
import rospy

def work(number):
    rospy.init_node("worker", anonymous=True, argv=[])
    rospy.set_param("/done", number)

if __name__ == "__main__":
    rospy.init_node("parent", argv=[])
    worker = multiprocessing.get_context("{method}").Process(target=work, args=(5,))
    worker.start()
    worker.join()
    assert worker.exitcode == 0
    assert rospy.get_param("/done") == 5
    print(rospy.get_name())
""")
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=GUARD, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "/parent\n", "")


def test_init_node_in_another_thread(master: str) -> None:
    script = """
import threading, rospy
from std_msgs.msg import Bool
def work():
    rospy.init_node("threaded")
    rospy.Publisher("t", Bool, queue_size=1)
worker = threading.Thread(target=work)
worker.start()
worker.join()
print(rospy.get_name(), [row[0] for row in rospy.get_published_topics() if row[0] == "/t"])
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=GUARD, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "/threaded ['/t']\n", "")
    assert not is_known(master, "/threaded")


def test_in_pytest(master: str, tmp_path: Path) -> None:
    (tmp_path / "test_user.py").write_text("""
import pytest, rospy
from std_msgs.msg import Bool

@pytest.fixture(scope="module", autouse=True)
def node():
    rospy.init_node("tested", argv=[], disable_signals=True)
    yield
    rospy.signal_shutdown("done")

def test_one(caplog, capsys):
    rospy.loginfo("a line")
    rospy.Publisher("t", Bool, queue_size=1, latch=True).publish(True)
    assert rospy.wait_for_message("t", Bool, timeout=30).data
    assert rospy.get_name() == "/tested"

def test_two():
    assert not rospy.is_shutdown()
""")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "error", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=GUARD,
        check=False,
        cwd=tmp_path,
    )
    assert "2 passed" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0
    assert not is_known(master, "/tested")


@pytest.mark.parametrize(
    ("argument", "output"),
    [
        ("a:=b:=c", "invalid command-line parameters: [a:=b:=c] has more than one :="),
        ("_p:=[1,", "invalid command-line parameters: [_p:=[1,]: while parsing a flow node"),
        ("_p:=null", "invalid command-line parameters: [_p:=null]: XML-RPC has no type for NoneType"),
        ("_p:=99999999999", "invalid command-line parameters: [_p:=99999999999]: the integer"),
    ],
)
def test_a_wrong_argument_is_reported_in_one_line(master: str, argument: str, output: str) -> None:
    script = f"""
import rospy
try:
    rospy.init_node("node", argv=[{argument!r}])
except rospy.ROSInitException as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=GUARD, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(output)
    assert done.stdout.count("\n") == 1


def is_known(master: str, name: str) -> bool:
    proxy = MasterProxy(master, "/test")
    try:
        proxy.lookup_node(name)
    except RpcRefused:
        return False
    finally:
        proxy.close()
    return True


def test_get_master_names_another_by_its_uri(master: str) -> None:
    script = """
import rospy
try:
    rospy.get_master(env={"ROS_MASTER_URI": "http://localhost:1"}).getPid()
except ConnectionRefusedError:
    print("refused", rospy.get_master().getPid()[0])
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=GUARD, check=False
    )
    assert (done.stdout, done.stderr) == ("refused 1\n", "")


@POSIX_ONLY
def test_ctrl_c_while_waiting_for_a_master() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", "import rospy; rospy.init_node('early')"], stderr=subprocess.PIPE, text=True
    )
    assert process.stderr
    assert process.stderr.readline().startswith("Unable to register with master node [http://localhost:1]")
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=GUARD)[1] == ""
    assert process.returncode == 0


@pytest.mark.parametrize("uri", ["foo", "localhost:11311", "http://localhost:99999"])
def test_a_master_uri_that_is_none(uri: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    script = """
import rospy
try:
    rospy.init_node("node")
except rospy.ROSInitException as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=GUARD, check=False
    )
    output = f"ROS_MASTER_URI [{uri}] is not of the form http://host:port, as http://localhost:11311\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, output, "")


@POSIX_ONLY
def test_a_hook_does_not_log_into_a_line_that_is_being_written(master: str) -> None:
    """Files and streams are not reentrant. A signal in the middle of a line must wait until the line is complete."""
    process = start("""
import atexit, logging, os, signal
import rospy

depth, most, lines = 0, 0, []

class Interrupted(logging.Handler):
    def emit(self, record):
        global depth, most
        depth += 1
        most = max(most, depth)
        lines.append(record.getMessage())
        if record.getMessage() == "line":
            os.kill(os.getpid(), signal.SIGINT)
        depth -= 1

# Also if the program has had its time before it comes behind the line: there it is interrupted.
atexit.register(lambda: print(rospy.is_shutdown(), most, lines))
rospy.init_node("writes", argv=[], disable_rosout=True)
logging.getLogger("rosout").addHandler(Interrupted())
rospy.on_shutdown(lambda: rospy.loginfo("hook"))
print("ready", flush=True)
rospy.loginfo("line")
""")
    out, err = process.communicate(timeout=GUARD)
    assert process.returncode == 0
    assert out.splitlines()[-1] == "True 1 ['line', 'hook']", out + err


@POSIX_ONLY
def test_a_fork_is_left_to_the_system_until_it_polls(master: str) -> None:
    """In a pool's worker, a Python handler would have to wait for C code, sometimes forever."""
    process = start("""
import os, signal, sys, time
import rospy
rospy.init_node("parent", argv=[])
child = os.fork()
if child == 0:
    rospy.on_shutdown(lambda: print("the child's hook", flush=True))
    handlers = [signal.getsignal(signal.SIGTERM)]
    rospy.is_shutdown()
    handlers.append(signal.getsignal(signal.SIGTERM))
    print("ready", flush=True)
    while not rospy.is_shutdown():
        time.sleep(0.01)
    print([handler == signal.SIG_DFL for handler in handlers], flush=True)
    os._exit(7)
sys.stdin.readline()
os.kill(child, signal.SIGTERM)
print("ended with", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), rospy.is_shutdown())
""")
    out, _ = process.communicate("now\n", timeout=GUARD)

    assert out.splitlines() == ["the child's hook", "[True, False]", "ended with 7 False"]


def test_another_node_in_the_process_of_one_that_has_shut_down(master: str) -> None:
    script = """
import threading
import rospy
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

for name in ("one", "two"):
    rospy.init_node(name, argv=[])
    rospy.on_shutdown(lambda: print("hook"))
    heard = threading.Event()
    pub = rospy.Publisher("c", Int32, queue_size=1)
    sub = rospy.Subscriber("c", Int32, lambda message: heard.set())
    service = rospy.Service("s", Trigger, lambda request: {"success": True})
    pub.wait_for_subscribers()
    pub.publish(1)
    print(heard.wait(30), rospy.ServiceProxy("s", Trigger)().success, rospy.get_param_cached("/none", 5))
    rospy.loginfo("once")
    old = pub
    rospy.signal_shutdown("")
    rospy.core._shutdown_flag = False
    rospy.client._init_node_args = None
    old.unregister()
print(rospy.is_shutdown(), rospy.core.is_initialized())
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "ROSCONSOLE_FORMAT": "${node} ${message}"},
        capture_output=True,
        text=True,
        timeout=GUARD,
        check=False,
    )
    of_one = ["True True 5", "/one once", "hook"]
    of_two = ["True True 5", "/two once", "hook"]
    assert (done.returncode, done.stdout.splitlines(), done.stderr) == (
        0,
        [*of_one, *of_two, "False False"],
        "",
    )
    assert not is_known(master, "/one")
    assert not is_known(master, "/two")
