# ruff: noqa: E501, SIM115, BLE001
"""Launching from a program: the functions of roslaunch's modules, and their results."""

import os
import sys
import threading

import rosgraph
import roslaunch
import roslaunch.loader
import roslaunch.remote
import roslaunch.roslaunch_logs
from referee import eventually, show

ROOT = os.path.join(os.environ["ROS_HOME"], "launch")
os.environ["ROS_PACKAGE_PATH"] = ROOT + os.pathsep + os.environ.get("ROS_PACKAGE_PATH", "/usr/share")
PACKAGE = "<package format='2'><name>{0}</name><version>1.0.0</version><description>d</description><maintainer email='a@b.com'>m</maintainer><license>x</license>{1}</package>"
WAIT = "#!/usr/bin/env python3\nimport signal, time\nsignal.signal(signal.SIGINT, lambda *_: exit(0))\nopen('{0}', 'a').write('x')\ntime.sleep(60)\n"
END = "#!/usr/bin/env python3\nimport sys\nsys.exit(int(sys.argv[1]))\n"
MARK = os.path.join(ROOT, "mark")
FILES = {
    "robot/package.xml": PACKAGE.format("robot", "<exec_depend>declared</exec_depend>"),
    "robot/wait.py": WAIT.format(MARK),
    "robot/end.py": END,
    "robot/a.launch": '<launch><arg name="n" default="a"/><param name="p" value="$(arg n)"/><node name="$(arg n)" pkg="robot" type="wait.py"/></launch>',
    "robot/ends.launch": '<launch><node name="w" pkg="robot" type="wait.py"/><node name="e" pkg="robot" type="end.py" args="3" required="true"/></launch>',
    "robot/deps.launch": '<launch><include file="$(find other)/b.launch"/><include file="$(find robot)/a.launch" if="false"/>'
    '<node name="x" pkg="declared" type="t"/><node name="y" pkg="robot" type="wait.py"/></launch>',
    "other/package.xml": PACKAGE.format("other", ""),
    "other/b.launch": '<launch><node name="z" pkg="robot" type="end.py" args="0"/></launch>',
    "declared/package.xml": PACKAGE.format("declared", ""),
}
for name, text in FILES.items():
    path = os.path.join(ROOT, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(text)
    os.chmod(path, 0o755)


def launch_file(name):
    return os.path.join(ROOT, "robot", name + ".launch")


def raises(call):
    try:
        call()
    except Exception as error:
        return type(error).__name__
    return "nothing"


# Discard roslaunch's own output.
lines, out = [], sys.stdout
sys.stdout = sys.stderr = open(os.devnull, "w")


def tell(*values):
    lines.append(values)


def waits(count):
    """Wait until `count` more programs are running."""
    seen = eventually(lambda: os.path.isfile(MARK) and os.path.getsize(MARK) == count)
    os.unlink(MARK)
    return seen


class Listener(roslaunch.pmon.ProcessListener):
    def __init__(self):
        self.died = threading.Event()
        self.codes = set()

    def process_died(self, process_name, exit_code):
        self.codes.add((process_name.rpartition("-")[0], exit_code))
        self.died.set()


handlers = []
rosgraph.Master("/case").setParam("/run_id", "run")
tell("run id", roslaunch.rlutil.get_or_generate_uuid(None, False), roslaunch.roslaunch_logs.get_run_id())

# --- a parent, from its making to its end
kept = roslaunch.pmon._init_signal_handlers
roslaunch.pmon._init_signal_handlers = lambda: handlers.append("asked")
listener = Listener()
parent = roslaunch.parent.ROSLaunchParent("run", [(launch_file("a"), ["n:=b"])], process_listeners=[listener])
tell(
    "made",
    parent.pm,
    parent.runner,
    parent.server,
    parent.config,
    parent.remote_runner,
    parent.run_id,
    parent.port,
)
tell("spin too early", raises(parent.spin))
parent.start()
tell("the program's own handler of signals", bool(handlers))
roslaunch.pmon._init_signal_handlers = kept
tell(
    "runs",
    waits(1),
    parent.pm.is_alive(),
    parent.pm.done,
    len(parent.pm.dead_list),
    parent.spin_once() in (None, True),
)
name = parent.pm.get_active_names()[0]
first = int(name.rpartition("-")[2])
process = parent.pm.get_process(name)
tell(
    "the process",
    process is parent.pm.procs[0],
    process.name == name,
    process.package,
    process.respawn,
    process.respawn_delay,
    process.required,
)
tell(
    process.exit_code,
    process.spawn_count,
    process.started,
    process.stopped,
    process.cwd,
    process.run_id,
    process.pid > 1,
    process.popen.pid == process.pid,
)
tell(
    os.path.relpath(process.log_dir, os.environ["ROS_HOME"]),
    process.env["ROS_MASTER_URI"] == os.environ["ROS_MASTER_URI"],
    sorted(process.get_info()),
)
tell(
    "names",
    [
        [(n.rpartition("-")[0], count) for n, count in some]
        for some in parent.pm.get_process_names_with_spawn_count()
    ],
)
tell(
    "is running",
    parent.runner.is_node_running(parent.config.nodes[0]),
    bool(parent.runner.is_node_running(roslaunch.core.Node("robot", "x", "x"))),
)
more, is_launched = parent.runner.launch_node(roslaunch.core.Node("robot", "end.py", "e", args="4"))
tell(
    "one more",
    is_launched,
    int(more.name.rpartition("-")[2]) - first,
    listener.died.wait(60),
    eventually(lambda: parent.pm.dead_list),
    listener.codes,
)
tell("dead", [(each.name == more.name, each.exit_code) for each in parent.pm.dead_list])
more, is_launched = parent.runner.launch_node(roslaunch.core.Node("robot", "no_such.py", "f"))
tell("no such program", more, is_launched)
tell("kills", parent.pm.kill_process("nobody"), raises(lambda: parent.pm.kill_process(3)))
parent.shutdown()
tell("ended", parent.pm.done, parent.pm.is_alive(), process.is_alive(), parent.pm.get_active_names())
parent.shutdown()
tell("again", raises(parent.start))

# --- a required node ends; the numbers go on
listener = Listener()
parent = roslaunch.parent.ROSLaunchParent("run", [launch_file("ends")], process_listeners=[listener])
parent.start()
parent.spin()
tell("a required node", parent.pm.done, ("e", 3) in listener.codes)
if os.path.exists(MARK):
    os.unlink(MARK)
parent = roslaunch.parent.ROSLaunchParent(
    "run", [], roslaunch_strs=['<launch><param name="q" value="1"/></launch>']
)
parent.start()
parent.spin()
tell("nothing to run", parent.pm.done, rosgraph.Master("/case").getParam("/q"))

# --- a configuration that the program makes
config = roslaunch.config.ROSLaunchConfig()
config.add_node(roslaunch.core.Node("robot", "wait.py", "own", namespace="deep"))
config.add_node(roslaunch.core.Node("robot", "wait.py"))
config.add_param(roslaunch.core.Param("/own/p", 3))
tell(
    "names",
    config.resolved_node_names,
    len(config.nodes),
    raises(lambda: config.add_node(roslaunch.core.Node("robot", "x", "own", "deep"))),
)
config.assign_machines()
tell(
    "machines",
    list(config.machines),
    [node.machine.address for node in config.nodes],
    config.has_remote_nodes(),
    config.executables,
    config.nodes_core,
)
tell(
    "master",
    config.master.uri.rstrip("/") == os.environ["ROS_MASTER_URI"].rstrip("/"),
    config.master.is_running(),
    config.master.type,
)
tell("summary", "/deep/\n    own (robot/wait.py)" in config.summary())
parent = roslaunch.parent.ROSLaunchParent("run", [launch_file("a")])
parent.config = config
parent.start()
tell(
    "its own",
    waits(2),
    sorted(n.rpartition("-")[0].split("_py_")[0] for n in parent.pm.get_active_names()),
    rosgraph.Master("/case").getParam("/own/p"),
)
tell("a name was given", config.nodes[1].name.startswith("wait_py_"))
parent.shutdown()


class Own(roslaunch.parent.ROSLaunchParent):
    def _load_config(self):
        self.config = roslaunch.config.load_config_default(
            [], self.port, roslaunch_strs=['<launch><node name="s" pkg="robot" type="wait.py"/></launch>']
        )


parent = Own("run", [])
parent.start()
tell("a class of the program's", waits(1), [n.rpartition("-")[0] for n in parent.pm.get_active_names()])
parent.shutdown()
config = roslaunch.ROSLaunchConfig()
config.add_node(roslaunch.core.Node("robot", "wait.py", "r"))
config.add_node(roslaunch.core.Node("robot", "no_such.py", "n"))
config.assign_machines()
runner = roslaunch.launch.ROSLaunchRunner("run", config, is_rostest=True)
runner.add_process_listener(listener)
launched, failed = runner.launch()
tell(
    "a runner",
    [text.rpartition("-")[0] for text in launched],
    failed,
    waits(1),
    runner.is_node_running(config.nodes[0]),
    runner.spin_once(),
)
runner.stop()
tell("stopped", runner.pm)

# --- nodes one by one
launch = roslaunch.scriptapi.ROSLaunch()
tell("too early", raises(lambda: launch.launch(roslaunch.core.Node("robot", "wait.py"))), launch.started)
launch.start()
node = roslaunch.core.Node("robot", "wait.py")
process = launch.launch(node)
tell(
    "without a name",
    node.name.startswith("wait_py_"),
    process.name.startswith(node.name),
    "__name:=" + node.name in process.args,
    waits(1),
)
tell(
    "no node",
    raises(lambda: launch.launch("x")),
    raises(lambda: launch.launch(roslaunch.core.Node("robot", "no_such.py", "n"))),
)
process.stop()
tell("stopped", process.is_alive(), process.stopped)
process = launch.launch(roslaunch.core.Node("robot", "wait.py", "w"))
tell("another", process.is_alive(), waits(1))
launch.stop()
tell("all stopped", process.is_alive(), launch.started, raises(launch.start))

# --- a process to be started by hand
loaded = roslaunch.config.load_config_default([launch_file("a")], 11399)
process = roslaunch.nodeprocess.create_node_process("run", loaded.nodes[0], os.environ["ROS_MASTER_URI"])
tell(
    "loaded",
    loaded.master.uri.split(":")[-1],
    loaded.nodes[0].machine.name,
    sorted(set(loaded.params) - {"/rosdistro", "/rosversion"}),
)
tell(
    "made",
    process.started,
    process.stopped,
    process.is_alive(),
    process.name.startswith("a-"),
    process.args[-1],
)
tell("started", process.start(), process.started, process.is_alive(), waits(1))
process.stop()
tell("stopped", process.stopped, process.is_alive())
needs = roslaunch.depends.roslaunch_deps([launch_file("deps")])
sys.stdout, sys.stderr = out, sys.__stderr__
for line in lines:
    show(*line)

# --- what runs nothing
base, files, missing = needs
show(
    base,
    {
        os.path.relpath(file, ROOT): (
            what.nodes,
            [os.path.relpath(i, ROOT) for i in what.includes],
            sorted(what.pkgs),
        )
        for file, what in sorted(files.items())
    },
)
show({package: sorted(names) for package, names in missing.items() if names})
show(roslaunch.node_args.create_local_process_args(loaded.nodes[0], loaded.nodes[0].machine)[-1])
environment = roslaunch.core.setup_env(
    roslaunch.core.Node("robot", "wait.py", "n", "/q/r", env_args=[("A", "b")]),
    roslaunch.core.local_machine(),
    "http://x:1",
)
show([environment[key] for key in ("ROS_NAMESPACE", "ROS_MASTER_URI", "A")])
for value in (("1", "auto"), ("a.b", "auto"), ("yes", "bool"), ("[1]", "yaml"), ("2.5", "double")):
    try:
        show("convert", value, repr(roslaunch.loader.convert_value(*value)))
    except ValueError as error:
        show("convert", value, error)
machine = roslaunch.core.local_machine()
show(
    repr(machine.name),
    machine.address,
    machine.env_loader,
    machine.user,
    machine.ssh_port,
    machine.timeout,
    machine.assignable,
)
show(roslaunch.core.Machine("m", "1.2.3.4"))
show(
    [
        roslaunch.core.is_machine_local(roslaunch.core.Machine("m", address))
        for address in ("localhost", "127.0.0.1", "1.2.3.4")
    ]
)
test = roslaunch.core.Test("t", "p", "x", "n", "/q", None, "a", time_limit=3, retry=2)
show(
    test.test_name,
    test.package,
    test.type,
    test.name,
    test.namespace,
    test.args,
    test.time_limit,
    test.output,
    test.retry,
    roslaunch.core.TEST_TIME_LIMIT_DEFAULT,
)
show(
    roslaunch.config.namespaces_of("/a/b/c"),
    roslaunch.core.get_master_uri_env() == os.environ["ROS_MASTER_URI"],
)
for words in (
    ["robot", "a.launch", "x:=1"],
    ("robot", "a.launch"),
    [],
    ["robot"],
    ["robot", "no.launch"],
    ["no_such", "a.launch"],
):
    try:
        show(
            words, [os.path.relpath(each, ROOT) for each in roslaunch.rlutil.resolve_launch_arguments(words)]
        )
    except roslaunch.RLException as error:
        show(words, "RLException", str(error).split(":")[0].split(" (")[0])
heard = []
roslaunch.core.add_printlog_handler(heard.append)
roslaunch.core.add_printerrlog_handler(lambda text: heard.append("error: " + text))
sys.stdout = sys.stderr = open(os.devnull, "w")
roslaunch.core.printlog("a line")
roslaunch.core.printerrlog("a fault")
roslaunch.core.clear_printlog_handlers()
roslaunch.core.printlog("not heard")
sys.stdout, sys.stderr = out, sys.__stderr__
show(heard)
show(
    roslaunch.rlutil.check_roslaunch(launch_file("a")),
    roslaunch.Process is roslaunch.pmon.Process,
    roslaunch.roslaunch_core is roslaunch.core,
)
show(
    issubclass(roslaunch.XmlParseException, roslaunch.RLException),
    issubclass(roslaunch.Test, roslaunch.Node),
    roslaunch.nodeprocess.DEFAULT_TIMEOUT_SIGINT,
)

# Attributes that a file does not set.
with open(os.path.join(ROOT, "unset.launch"), "w") as file:
    file.write(
        '<launch><group ns="g" clear_params="true"><node name="a" pkg="robot" type="t" clear_params="true"/></group>'
        '<node name="b" pkg="robot" type="t" output="log" cwd="ROS_HOME"/></launch>'
    )
unset = roslaunch.config.load_config_default([os.path.join(ROOT, "unset.launch")], None, verbose=False)
for node in unset.nodes:
    show(node.name, node.output, node.cwd, node.launch_prefix, node.machine_name, node.args)
show(unset.clear_params)

# Machines, masters and parameters, compared and added twice.
Machine, Master, Param = roslaunch.core.Machine, roslaunch.core.Master, roslaunch.core.Param
one = Machine("m", "a")
show(one.config_key(), Machine("m", "a", "/e", 22, "u", "p", False, [], 3).config_key())
for other in (
    Machine("m", "a"),
    Machine("n", "a"),
    Machine("m", "b"),
    Machine("m", "a", assignable=False),
    Machine("m", "a", timeout=5),
    Machine("m", "a", user="u"),
    3,
):
    show(one == other, one != other, one.config_equals(other))
show(Master() == Master(), Master("x") == Master(), Master(auto=1) == Master(auto=0), Master() == 3)
show(Master(uri="http://a:1") == Master(uri="http://a:1/"))
for uri in ("http://h:12/", "http://h/", "http://h", "bad", "http://[::1]:5"):
    for ask in (Master.get_host, Master.get_port):
        try:
            show(uri, ask(Master(uri=uri)))
        except ValueError as error:
            show(uri, error)
show([Param(key, 1).key for key in ("a//b", "//", "a/", "/a/b/", "/", "", "~a")])
show(roslaunch.core.local_machine() is roslaunch.core.local_machine())
for address in ("no.such.host.invalid", "", "1.2.3.4"):
    try:
        show(roslaunch.core.is_machine_local(Machine("m", address)))
    except roslaunch.RLException as error:
        show(error)
config = roslaunch.ROSLaunchConfig()
show(config.add_machine(one, verbose=False), config.add_machine(Machine("m", "a"), verbose=False))
for machine in (Machine("m", "b"), Machine("", "b")):
    try:
        config.add_machine(machine, verbose=False)
    except roslaunch.RLException as error:
        show(error)
for key in ("/a", "/a/b", "/a/b/c", "/d/e", "/d", "rel"):
    config.add_param(Param(key, 1), verbose=False)
show(config.config_errors, sorted(config.params))
config.add_test(roslaunch.core.Test("t", "p", "x", "n"), verbose=False)
config.add_test(roslaunch.core.Test("t", "p", "x", "n"), verbose=False)
config.add_node(roslaunch.core.Node("p", "x", "n"), verbose=False)
show(config.resolved_node_names, len(config.tests))
show(roslaunch.substitution_args.convert_value("1", "auto"))

# A file's content as a parameter value.
with open(os.path.join(ROOT, "content"), "wb") as file:
    file.write(b"\x00a")
with open(os.path.join(ROOT, "binary.launch"), "w") as file:
    file.write(f'<launch><param name="b" binfile="{ROOT}/content"/></launch>')
binary = roslaunch.config.load_config_default([os.path.join(ROOT, "binary.launch")], None, verbose=False)
show(type(binary.params["/b"].value).__name__, binary.params["/b"].value.data)
sys.stdout = sys.stderr = open(os.devnull, "w")
parent = roslaunch.parent.ROSLaunchParent("run", [os.path.join(ROOT, "binary.launch")])
parent.start()
parent.shutdown()
sys.stdout, sys.stderr = out, sys.__stderr__
show(rosgraph.Master("/case").getParam("/b").data)

# Arguments of launch files, in command-line form.
with open(os.path.join(ROOT, "args.launch"), "w") as file:
    file.write('<launch><arg name="a" default="1"/><param name="p" value="$(arg a)"/></launch>')
for argv in (
    [],
    ["a:=2"],
    ["a:="],
    ["a:= "],
    ["a:= x y "],
    [" a :=3"],
    ["a:=2", "a:=4"],
    ["_a:=5"],
    ["a"],
    [":=6"],
    ["b:=7"],
):
    given = roslaunch.config.load_config_default(
        [(os.path.join(ROOT, "args.launch"), argv)], None, verbose=False
    )
    show(argv, repr(given.params["/p"].value))
