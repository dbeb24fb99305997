"""roslaunch.xmlloader.XmlLoader with a configuration of the program's own: its methods are called in the order of the tags."""

import os

import roslaunch.config
import roslaunch.core
import roslaunch.xmlloader
from referee import show

FILE = """<launch>
  <arg name="a" default="5"/>
  <machine name="m1" address="localhost" env-loader="/opt/env.sh"/>
  <machine name="m2" address="localhost" default="true" user="u" password="p" ssh-port="23" timeout="3"/>
  <param name="p" value="$(arg a)"/>
  <param name="b" type="bool" value="true"/>
  <param name="~private" value="7"/>
  <rosparam>
x: 1
y: {z: 2, w: [1, 2]}
  </rosparam>
  <rosparam param="sub">{q: 3}</rosparam>
  <group ns="g" clear_params="true">
    <remap from="x" to="y"/>
    <env name="E" value="V"/>
    <param name="gp" value="1.5"/>
    <param name="none" value="0" if="false"/>
    <node pkg="pkg" type="type" name="n1" args="-x $(arg a)" respawn="true" respawn_delay="3" output="screen" cwd="node"
          launch-prefix="gdb" machine="m1" ns="in" clear_params="true">
      <param name="np" value="3"/>
      <param name="r" value="of param"/>
      <rosparam>{r: of rosparam, private: of rosparam}</rosparam>
      <remap from="c" to="d"/>
      <env name="F" value="W"/>
      <rosparam command="delete" param="old"/>
    </node>
    <test pkg="pkg" type="ttype" test-name="t1" name="tn" time-limit="5" retry="2" args="--q"/>
  </group>
  <test pkg="pkg" type="ttype" test-name="t2"><param name="tp" value="1"/></test>
  <node pkg="pkg" type="type" name="n2"/>
  <include file="include.launch" ns="i" clear_params="true"><arg name="z" value="q"/></include>
  <rosparam command="delete" param="gone"/>
  <rosparam command="dump" file="dump.yaml" ns="kept"/>
  <bogus/>
  <node pkg="pkg" type="type" name="n3" bogus="1"/>
  <param name="text" textfile="text.txt"/>
  <param name="binary" binfile="text.txt"/>
  <param name="last" command="echo hi"/>
</launch>
"""
os.chdir(os.environ["ROS_HOME"])
for name, text in (
    ("own.launch", FILE),
    ("include.launch", '<launch><arg name="z"/><param name="p" value="$(arg z)"/><node pkg="i" type="t" name="n"/></launch>'),
    ("text.txt", "some text"),
):  # fmt: skip
    with open(name, "w") as file:
        file.write(text)
NODE = [
    *(
        "args",
        "cwd",
        "env_args",
        "filename",
        "launch_prefix",
        "machine",
        "machine_name",
        "name",
        "namespace",
        "output",
    ),
    *("package", "process_name", "remap_args", "required", "respawn", "respawn_delay", "type"),
]
FIELDS = {
    "Machine": ["address", "assignable", "env_loader", "name", "password", "ssh_port", "timeout", "user"],
    "Param": ["key", "value"],
    "Node": NODE,
    "Test": [*NODE, "retry", "test_name", "time_limit"],
    "RosbinExecutable": ["command", "args", "phase"],
}


def described(value):
    """Return an argument with the fields of its class."""
    fields = FIELDS.get(type(value).__name__)
    return [type(value).__name__, *(f"{f}={getattr(value, f)!r}" for f in fields)] if fields else repr(value)


class Configuration:
    """Shows each call; the method ``fails`` raises an error."""

    def __init__(self, fails=""):
        self.fails = fails

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)

        def method(*args, **options):
            show(name, *map(described, args), options)
            if name == self.fails:
                raise KeyError("mine")

        return method


loader = roslaunch.xmlloader.XmlLoader()
for verbose in (True, False):
    loader.load("own.launch", Configuration(), verbose=verbose, argv=["a:=6"])
show("# a string")
loader.load_string('<launch><node pkg="p" type="t" name="n" core="1"/><param name="a" value="1"/></launch>', Configuration(),
                   core=True)  # fmt: skip
show("# names that are taken twice")
loader.load_string('<launch><node pkg="p" type="t" name="n"/><node pkg="p" type="t" name="n"/></launch>', Configuration(),
                   verbose=False)  # fmt: skip
show("# an error of the configuration")
try:
    loader.load("own.launch", Configuration("add_node"), verbose=False)
except KeyError as error:
    show(error)

show("# roslaunch's own")
config = roslaunch.config.ROSLaunchConfig()
loader.load("own.launch", config)
show(config.config_errors, config.roslaunch_files, config.clear_params, config.resolved_node_names)
show(config.executables, [each.phase for each in config.executables], [each.name for each in config.nodes])
del config.params["/binary"]
show(config.summary())

for text in (
    '<node pkg="p" type="t" name="n"/><node pkg="p" type="t" name="n"/>',
    '<param name="a" value="b"/><param name="a/b" value="c"/><bogus/>',
    '<machine name="a" address="b"/><machine name="a" address="c"/>',
):
    config = roslaunch.config.ROSLaunchConfig()
    try:
        loader.load_string(f"<launch>{text}</launch>", config, verbose=False)
    except roslaunch.core.RLException as error:
        show("machine" if "achine" in str(error) else error)
    show(config.config_errors, len(config.nodes), sorted(config.params))
config.add_node(roslaunch.core.Node("p", "t", "n"), core=True)
config.add_machine(roslaunch.core.Machine("m", "localhost"))
config.add_executable(roslaunch.core.Executable("command", ["word"], roslaunch.core.PHASE_RUN))
show(config.executables, len(config.nodes_core))
show(roslaunch.config.ROSLaunchConfig().summary())
show(roslaunch.config.ROSLaunchConfig().summary(True))
