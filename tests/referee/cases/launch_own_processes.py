"""roslaunch.pmon.ProcessMonitor with processes of the program's own class."""

import contextlib
import io
import re
import sys
import threading
import time

import roslaunch.core
import roslaunch.pmon
from referee import eventually, outcome, show

process = roslaunch.pmon.Process("package", "name", ["a"], {"e": "f"}, True, 2.0, False)
show(sorted(name for name in vars(process)), process, process.get_info())
show(
    process.is_alive(),
    1 < process.should_respawn() <= 2,
    process.start(),
    process.stop([]),
    process.spawn_count,
)
show(process.get_exit_description(), roslaunch.pmon.Process("p", "n", [], {}).should_respawn())
dead = roslaunch.pmon.DeadProcess(process)
show(
    dead,
    dead.is_alive(),
    dead.spawn_count,
    issubclass(roslaunch.pmon.FatalProcessLaunch, roslaunch.core.RLException),
)

events, lock = [], threading.Lock()


def note(*event):
    with lock:
        events.append(event)


def noted(*event):
    """Return whether something happens."""
    return eventually(lambda: event in events)


class Mine(roslaunch.pmon.Process):
    """A process that exists only here."""

    def __init__(self, name, **options):
        super().__init__("package", name, ["arg"], {"E": "V"}, **options)
        self.alive = True

    def is_alive(self):
        if not self.alive and self.time_of_death is None:
            self.time_of_death = time.time()
        return self.alive

    def start(self):
        self.spawn_count += 1
        self.exit_code = self.time_of_death = None
        self.alive = True
        note("start", self.name)
        return True

    def stop(self, errors=None):
        note("stop", self.name, errors)
        self.alive = False

    def exit(self, code):
        self.exit_code = code
        self.alive = False

    def get_exit_description(self):
        return f"described {self.name}"


class Listener(roslaunch.pmon.ProcessListener):
    """Notes the exits."""

    def process_died(self, process_name, exit_code):
        note("died", process_name, exit_code)


class Faulty(roslaunch.pmon.ProcessListener):
    """Fails."""

    def process_died(self, process_name, exit_code):
        raise RuntimeError("a fault")


def monitored():
    monitor = roslaunch.pmon.ProcessMonitor()
    show(monitor.name, monitor.daemon, monitor.is_alive(), monitor.done, monitor.is_shutdown)
    listener = Listener()
    monitor.add_process_listener(listener)
    show(monitor.listeners == [listener])
    one, two = Mine("one"), Mine("two", respawn=True)
    monitor.register(one)
    monitor.register(two)
    outcome("twice", lambda: monitor.register(Mine("one")))
    show(monitor.get_active_names(), monitor.has_process("one"), monitor.has_process("z"))
    show(
        monitor.get_process("one") is one,
        monitor.get_process("z"),
        monitor.get_process_names_with_spawn_count(),
    )
    monitor.start()
    show(monitor.is_alive(), monitor.done, monitor.is_shutdown, monitor.procs == [one, two])

    one.exit(3)
    show(noted("stop", "one", []), events[-2:], eventually(lambda: monitor.get_active_names() == ["two"]))
    show(monitor.get_process_names_with_spawn_count(), [type(each).__name__ for each in monitor.dead_list])
    two.exit(1)
    show(noted("start", "two"), events[-3:], monitor.get_active_names())
    events.clear()
    show(
        monitor.kill_process("two"),
        noted("start", "two"),
        ("stop", "two", []) in events,
        monitor.kill_process("z"),
    )
    outcome("kill", lambda: monitor.kill_process(two))
    three = Mine("three")
    monitor.register(three)
    monitor.unregister(three)
    show(monitor.get_active_names(), monitor.has_process("three"))
    monitor.register_core_proc(Mine("core"))
    show(monitor.get_active_names(), len(monitor.core_procs))
    events.clear()
    monitor.shutdown()
    monitor.join(30)
    show(monitor.done, monitor.is_shutdown, events, monitor.get_active_names())
    outcome("late", lambda: monitor.register(Mine("late")))

    show("# the last process")
    monitor = roslaunch.pmon.ProcessMonitor("named")
    only = Mine("only")
    monitor.register(only)
    monitor.start()
    monitor.registrations_complete()
    show(monitor.name, monitor.done)
    only.exit(0)
    show(eventually(lambda: monitor.done))

    show("# a required process")
    events.clear()
    monitor = roslaunch.pmon.ProcessMonitor()
    other, required = Mine("other"), Mine("required", required=True)
    monitor.register(other)
    monitor.register(required)
    monitor.start()
    required.exit(0)
    show(eventually(lambda: monitor.done), monitor.is_shutdown, events, monitor.get_active_names())


def shut_down():
    """Return a monitor after the exit of a required process, and one whose shutdown was requested."""
    faulty = roslaunch.pmon.ProcessMonitor()
    faulty.add_process_listener(Faulty())
    required = Mine("required", required=True)
    faulty.register(required)
    faulty.start()
    required.exit(0)
    eventually(lambda: faulty.done)
    requested = roslaunch.pmon.ProcessMonitor()
    requested.shutdown()
    return faulty, requested


# ROS's roslaunch prints in colours on everything.
told, sys.stdout = sys.stdout, io.StringIO()
with contextlib.redirect_stderr(io.StringIO()):
    monitored()
out, sys.stdout = sys.stdout.getvalue(), told
for line in out.splitlines():
    if not line.startswith("all processes"):
        show(re.sub(r"\x1b\[\d+m", "", line))

show("# a required process, and a listener that fails")
with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
    faulty, requested = shut_down()
show(faulty.done, faulty.is_shutdown, faulty.get_active_names())
show("# a shutdown that has not ended")
show(requested.is_shutdown)
outcome("late", lambda: requested.register(Mine("late")))

show("# while shutting down")
show(roslaunch.pmon._shutting_down)
roslaunch.pmon._shutting_down = True
show(roslaunch.pmon.start_process_monitor())
roslaunch.pmon._shutting_down = False
monitor = roslaunch.pmon.start_process_monitor()
show(monitor.is_alive(), roslaunch.pmon.shutdown_process_monitor(monitor), monitor.is_alive())
