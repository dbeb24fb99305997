# ruff: noqa: E501, BLE001, SIM115, UP030, UP032, B023
"""Launching from a program: roslaunch.scriptapi, roslaunch.parent, listeners and processes."""

import os
import sys
import threading
import time

import rosgraph
import roslaunch

ROOT = os.path.join(os.environ["ROS_HOME"], "launch")
os.environ["ROS_PACKAGE_PATH"] = ROOT + os.pathsep + os.environ.get("ROS_PACKAGE_PATH", "/usr/share")
os.makedirs(os.path.join(ROOT, "robot"))
PACKAGE = "<package format='2'><name>robot</name><version>1.0.0</version><description>d</description><maintainer email='a@b.c'>m</maintainer><license>x</license></package>"
WAIT = "#!/usr/bin/env python3\nimport sys, time\nopen(sys.argv[1], 'w').write(' '.join(a for a in sys.argv[2:] if not a.startswith('__log')))\ntime.sleep(60)\n"
END = "#!/usr/bin/env python3\nimport sys\nsys.exit(int(sys.argv[1]))\n"
LAUNCH = '<launch><arg name="n" default="a"/><param name="p" value="$(arg n)"/><node name="$(arg n)" pkg="robot" type="wait.py" args="{0}"/></launch>'
MARK = os.path.join(ROOT, "mark")
for name, text in {
    "package.xml": PACKAGE,
    "wait.py": WAIT,
    "end.py": END,
    "a.launch": LAUNCH.format(MARK),
}.items():
    path = os.path.join(ROOT, "robot", name)
    with open(path, "w") as file:
        file.write(text)
    os.chmod(path, 0o755)


def show(*values):
    print(*(str(value).replace(ROOT + os.sep, "") for value in values))


def outcome(label, call):
    try:
        show(label, "gives", call())
    except Exception as error:
        show(label, "raises", type(error).__name__, "|", error)


# Discard roslaunch's own output.
lines, out = [], sys.stdout
sys.stdout = sys.stderr = open(os.devnull, "w")


def tell(*values):
    lines.append(values)


def until(condition):
    end = time.time() + 30
    while not condition() and time.time() < end:
        time.sleep(0.02)
    return bool(condition())


def mark():
    until(lambda: os.path.isfile(MARK) and os.path.getsize(MARK))
    with open(MARK) as file:
        text = file.read()
    os.unlink(MARK)
    return text


class Listener(roslaunch.pmon.ProcessListener):
    def __init__(self):
        self.died = threading.Event()
        self.what = None

    def process_died(self, process_name, exit_code):
        self.what = process_name, exit_code
        self.died.set()


master = rosgraph.Master("/case")
uuid = roslaunch.rlutil.get_or_generate_uuid(None, True)
tell(
    "the master's run id",
    uuid == master.getParam("/run_id"),
    roslaunch.rlutil.get_or_generate_uuid("given", False),
)
roslaunch.configure_logging(uuid)

# --- scriptapi
launch = roslaunch.scriptapi.ROSLaunch()
try:
    launch.launch(roslaunch.core.Node("robot", "wait.py"))
except roslaunch.RLException as error:
    tell("before start", type(error).__name__)
launch.start()
node = roslaunch.core.Node(
    "robot", "wait.py", name="one", namespace="deep", args=MARK + " x", remap_args=[("a", "b")]
)
process = launch.launch(node)
tell("launched", process.name, process.is_alive(), process.exit_code, mark(), process.get_info()["alive"])
process.stop()
tell("stopped", process.is_alive(), until(lambda: process.exit_code is not None))
try:
    launch.launch(roslaunch.core.Node("robot", "no_such.py", name="two"))
except roslaunch.RLException:
    tell("no such program: RLException")
ended = launch.launch(roslaunch.core.Node("robot", "end.py", name="three", args="3"))
tell("ended", until(lambda: not ended.is_alive()), ended.exit_code)
launch.stop()
tell("after stop", process.is_alive())

# --- parent
listener = Listener()
file = os.path.join(ROOT, "robot", "a.launch")
parent = roslaunch.parent.ROSLaunchParent(uuid, [(file, ["n:=b"])], process_listeners=[listener])
parent.start()
tell("parent", mark(), parent.pm.get_active_names(), master.getParam("/p"))
tell("spins", parent.spin_once(), parent.pm.has_process("b-4"), parent.pm.has_process("c-1"))
tell(
    "killed",
    parent.pm.kill_process("b-4") in (True, None),
    listener.died.wait(30),
    listener.what and listener.what[0],
)
parent.shutdown()
text = '<launch><node name="t" pkg="robot" type="wait.py" args="{0}"/></launch>'.format(MARK)
parent = roslaunch.parent.ROSLaunchParent(uuid, [], roslaunch_strs=[text])
parent.start()
tell("a text", mark())
parent.shutdown()
for label, kind in (
    ("no file", ["/no/such.launch"]),
    ("no launch file", [os.path.join(ROOT, "robot", "package.xml")]),
):
    try:
        roslaunch.parent.ROSLaunchParent(uuid, kind).start()
    except roslaunch.RLException:
        tell(label, "RLException")
    except Exception as error:
        tell(label, type(error).__name__)

sys.stdout, sys.stderr = out, sys.__stderr__
for line in lines:
    show(*line)
for words in (["robot", "a.launch", "x:=1"], [file], [file, file], ["robot", "nope.launch"], ["/no/such"]):
    try:
        show(
            words, [os.path.relpath(each, ROOT) for each in roslaunch.rlutil.resolve_launch_arguments(words)]
        )
    except roslaunch.RLException:
        show(words, "RLException")
for wrong in (("", "t"), ("p", ""), ("p", "t", "a/b")):
    outcome(f"Node{wrong}", lambda: roslaunch.core.Node(*wrong))
outcome("output", lambda: roslaunch.core.Node("p", "t", output="x"))
outcome("cwd", lambda: roslaunch.core.Node("p", "t", cwd="x"))
node = roslaunch.core.Node("p", "t", "n", "a/b")
show(
    node.package,
    node.type,
    node.name,
    node.namespace,
    node.args,
    node.respawn,
    node.remap_args,
    node.env_args,
    node.output,
)
show(roslaunch.core.Param("k", 1).key, roslaunch.core.Param("k", 1) == roslaunch.core.Param("k", 1))
show(sorted(roslaunch.arg_dump.get_args([file]).items()))
show(
    roslaunch.node_args.get_node_list(
        roslaunch.config.load_config_default([file], None, assign_machines=False)
    )[-1:]
)
