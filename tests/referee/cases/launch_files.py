# ruff: noqa: E501, BLE001
"""Launch files: the resulting nodes, parameters and machines, through roslaunch's Python API."""

import os

import roslaunch.config
import roslaunch.substitution_args
import roslaunch.xmlloader
from referee import show

ROOT = os.path.join(os.environ["ROS_HOME"], "launch")
os.environ["CASE"] = "value"
os.environ["ROS_PACKAGE_PATH"] = ROOT + os.pathsep + os.environ.get("ROS_PACKAGE_PATH", "/usr/share")

PACKAGE = "<package format='2'><name>{0}</name><version>1.0.0</version><description>d</description><maintainer email='a@b.c'>m</maintainer><license>x</license></package>"
FILES = {
    "robot/package.xml": PACKAGE.format("robot"),
    "robot/value.yaml": "gains: {p: 1.5, i: 0, d: -2}\nframes: [base, odom]\nname: 'a: b'\nangle: deg(90)\n",
    "robot/text.txt": "some text\n",
    "robot/number.txt": "5",
    "robot/arg.launch": '<launch><arg name="k" default="d"/><param name="p" value="$(arg k)"/></launch>',
    "robot/required.launch": '<launch><arg name="k"/><param name="p" value="$(arg k)"/></launch>',
    "robot/fixed.launch": '<launch><arg name="k" value="fixed"/><param name="p" value="$(arg k)"/></launch>',
    "robot/uses.launch": '<launch><param name="u" value="$(arg k)"/></launch>',
    "robot/hands_on.launch": '<launch><include file="$(find robot)/arg.launch" pass_all_args="true"/></launch>',
    "robot/keeps.launch": '<launch><include file="$(find robot)/arg.launch"/></launch>',
    "robot/inner.launch": '<launch><param name="~own" value="1"/><node name="in" pkg="robot" type="t"/><remap from="r" to="s"/>'
    '<env name="I" value="1"/></launch>',
    "robot/here.launch": '<launch><include file="$(dirname)/arg.launch"/><param name="d" value="$(dirname)"/></launch>',
}
for depth in range(5):
    below = f'<include file="$(find robot)/deep{depth + 1}.launch" ns="d{depth}"><arg name="n" value="$(arg n)x"/></include>'
    FILES[f"robot/deep{depth}.launch"] = (
        f'<launch><arg name="n" default="a"/><param name="n" value="$(arg n)"/><remap from="f{depth}" to="t{depth}"/>'
        f'<node name="n{depth}" pkg="robot" type="t" args="$(arg n)"/>{below if depth < 4 else ""}</launch>'
    )
for name, text in FILES.items():
    path = os.path.join(ROOT, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(text)

N = '<node name="x" pkg="robot" type="t"'
ARGS = '<arg name="a" default="5"/><arg name="s" default="txt"/><arg name="b" default="true"/><arg name="f" default="1.5"/>'


def include(name, body="", **attributes):
    words = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f'<include file="$(find robot)/{name}.launch" {words}>{body}</include>'


VALUES = [
    "5", " 5 ", "", "1e5", "0x10", "1.", ".5", "-7", "nan", "1_000", "1_0.5", "TRUE", "false", "yes", " a b ", "1.2.3", "1.5e3", "+5", "007",
    "ünï", "a&#10;b", "--5",
    "$(env CASE)", "$(env NOPE)", "$(env)", "$(optenv CASE x)", "$(optenv NOPE)", "$(optenv NOPE a  b)", "$(optenv)", "$(find robot)/x",
    "$(find no_such_package)", "$(find)", "$(find robot x)", "$(anon)", "$(anon a b)", "$(arg)", "$(arg a b)", "$(arg nope)", "$(arg a)$(arg s)",
    "$(dirname)", "$(arg $(arg s))", "$(what x)", "$()", "$( )", "$(arg a", "$(arg a))", "$ (arg a)",
    "$(eval a + 1)", "$(eval arg('a') + 1)", "$(eval s + 'x')", "$(eval not b)", "$(eval f * 2)", "$(eval 7 / 2)", "$(eval 2 ** 3)",
    "$(eval env('CASE'))", "$(eval optenv('NOPE', 'd'))", "$(eval optenv('NOPE', 5) + 1)",
    "$(eval find('robot'))", "$(eval anon('q') == anon('q'))", "$(eval dirname())",
    "$(eval [1, 2][1])", "$(eval true and False)", "$(eval pi)", "$(eval sin(0))", "$(eval int(f))", "$(eval [i for i in range(3)])",
    "$(eval '%d-%s' % (a, s))", "$(eval s.upper())", "$(eval __import__('os'))", "$(eval '_' + '_')", "$(eval 1 if b else 2)",
    "$(eval nope)", "$(eval 1 +)", "$(eval e)", "x $(eval a)", "$(eval a) x", "$(eval)", "$(eval None)", "$(eval a in [5])",
    "$(eval 1 &lt; a &lt; 9)", "$(eval s[0:2])", "$(eval len(s))", "$(eval max(1, a))",
]  # fmt: skip
TYPES = [
    ("1", "str"), ("1", "String"), ("1", "int"), ("1.5", "int"), ("x", "int"), ("1", "double"), ("1", "bool"), ("False", "bool"), ("yes", "bool"),
    ("[1, a, {b: c}]", "yaml"), ("{a: 1, b: {c: 2}}", "yaml"), ("[1", "yaml"), ("1", "what"), (" a ", "str"), ("2", ""),
]  # fmt: skip
BODIES = [
    '<param name="p" textfile="$(find robot)/text.txt"/>', '<param name="p" textfile="$(find robot)/number.txt"/>',
    '<param name="p" textfile="/no/such"/>', '<param name="p" binfile="$(find robot)/number.txt"/>', '<param name="p" command="echo 5"/>',
    '<param name="p" command="echo $CASE; echo 6"/>', '<param name="p" command="false"/>', '<param name="p" command="no_such_command"/>',
    '<param name="p"/>', '<param name="p" value="1" command="true"/>', '<param value="1"/>', '<param name="/p/" value="1"/>',
    '<param name="a//b" value="1"/>', '<param name="p" value="1"/><param name="p" value="2"/>', '<param name="p" value="1" foo="3"/>', "<foo/>",
    f'<param name="~p" value="1"/>{N}/>', f'{N}/><param name="~p" value="1"/>', f'{N} ns="a"><param name="p" value="1"/></node>',
    f'{N}><param name="~q" value="2"/><param name="/r" value="3"/><param name="a/b" value="4"/><rosparam param="/abs">1</rosparam></node>',
    f'<group ns="g"><param name="~p" value="1"/>{N} ns="a"/></group><param name="q" value="1"/>',
    '<group ns="/g"><group ns="h"><param name="p" value="1"/></group><group ns="/k"><param name="p" value="1"/></group></group>',
    '<node pkg="robot" type="t" name="~a"/>', '<node pkg="robot" type="t" name="~a" ns="b"/>',
    '<test pkg="robot" type="t" test-name="~a"/>', '<test pkg="robot" type="t" test-name="a" name="~b"/>',
    '<group ns=""/>', '<group ns="~a"><param name="p" value="1"/></group>', '<group clear_params="true"/>', '<group clear_params="true" ns="a/b"/>',
    f'{N} clear_params="true" ns="a"/>', include("arg", clear_params="true"), include("arg", clear_params="true", ns="q"),
    '<arg name="a" value="1"/><arg name="a" value="2"/>', '<arg name="a" value="1" default="2"/>', '<arg default="2"/>', '<arg name="a"/>',
    '<arg name="a" default="1" if="0"/><arg name="a" default="3" unless="0"/><param name="p" value="$(arg a)"/>',
    '<group><arg name="a" default="1"/></group><param name="p" value="$(arg a)"/>',
    '<group><arg name="a" value="8"/></group><group><arg name="a" value="9"/><param name="p" value="$(arg a)"/></group>',
    '<arg name="a" value="1"/><group><arg name="a" value="8"/></group>', '<arg name="a" value=" 1 "/><param name="p" value="[$(arg a)]"/>',
    include("arg"), include("arg", ns="s"), include("arg", '<arg name="k" value="v"/>'), include("arg", '<arg name="k" default="v"/>'),
    include("arg", '<arg name="zz" value="v"/>'), include("arg", '<arg name="k"/>'), include("arg", '<arg name="k" value="1"/><arg name="k" value="2"/>'),
    include("fixed", '<arg name="k" value="v"/>'), include("required"), '<arg name="k" value="outer"/>' + include("required"), include("nope"),
    *('<arg name="k" value="outer"/>' + include(name, pass_all_args="true") for name in ("required", "fixed", "uses", "hands_on", "keeps", "arg")),
    '<arg name="k" value="outer"/>' + include("required", '<arg name="k" value="in"/>', pass_all_args="true"),
    include("arg", '<arg name="zz" value="1"/>', pass_all_args="true"), include("inner") + f"{N}/>", include("here"), include("deep0"),
    '<rosparam file="$(find robot)/value.yaml"/>', '<rosparam command="load" file="$(find robot)/value.yaml" ns="z" param="q"/>',
    '<rosparam file="/no.yaml"/>', "<rosparam>a: 1\nb: [1,2]\nc: {d: 1}</rosparam>", "<rosparam>[1]</rosparam>", '<rosparam param="l">[1, x]</rosparam>',
    '<rosparam param="l"/>', "<rosparam/>", "<rosparam>a: $(env CASE)</rosparam>", '<rosparam subst_value="true">a: $(env CASE)</rosparam>',
    '<rosparam subst_value="maybe">a: 1</rosparam>', '<rosparam param="e" subst_value="True">$(eval 1+1)</rosparam>', '<rosparam command="what"/>',
    '<rosparam command="delete" file="x" param="y"/>', "<rosparam>a: rad(2*pi)\nb: !degrees 10</rosparam>", "<rosparam>{1: 2}</rosparam>",
    '<group ns="g"><rosparam>{/abs: 3, rel: {x: 1}}</rosparam></group>', "<rosparam>a: {}\nb: []</rosparam>", "<rosparam>a: [1\n</rosparam>",
    "<rosparam>a: {b: 1}</rosparam><rosparam>a: {c: 2}</rosparam><param name='a/b' value='7'/>", '<rosparam param="a">!!str 5</rosparam>',
    f'{N}><rosparam>{{a: 1}}</rosparam><rosparam param="b">2</rosparam><rosparam ns="c">{{d: 3}}</rosparam></node>',
    f'{N} args="--a 1  b \'c d\' $(env CASE)" launch-prefix="nice -n 5" respawn="true" respawn_delay="1.5" output="screen" cwd="node"/>',
    f'{N} required="true"/>', f'{N} required="1"/>', f'{N} respawn="yes"/>', f'{N} respawn=""/>', f'{N} respawn="TRUE"/>', f'{N} output="file"/>',
    f'{N} cwd="there"/>', f'{N} respawn_delay="x"/>', f'{N} ns="~a"/>', f'{N} ns=""/>', f'{N} ns="/abs/b/"/>', f'{N} foo="1"/>',
    f'{N} if="false"/>', f'{N} unless="1"/>', f'{N} if="foo"/>', f'{N} if="1" unless="0"/>', f'{N} if=" True "/>', f'{N} if="2"/>',
    '<node pkg="robot" type="t"/>', '<node name="a/b" pkg="robot" type="t"/>', '<node name="1b" pkg="robot" type="t"/>', '<node name="x" type="t"/>',
    '<node name="x" pkg="robot" type=""/>', f"{N}/>{N}/>", f'{N}/><group ns="g">{N}/></group>',
    f'<remap from="a" to="b"/>{N}><remap from="~c" to="/d"/></node><group><remap from="e" to="f"/></group><remap from="g" to="h"/>',
    f'<remap from="a" to="b"/><remap from="a" to="c"/>{N}/>', '<remap from="a"/>', '<remap from="" to="b"/>', '<remap from="a b" to="c"/>',
    f'<env name="E" value="1 2"/>{N}><env name="F" value="$(env CASE)"/></node>', '<env name="" value="1"/>', '<env name="a"/>',
    '<env name="Q" value="3"/><param name="x" value="$(optenv Q none)"/>', '<machine name="m"/>', '<machine address="a"/>',
    f'<machine name="m" address="10.0.0.1" env-loader="/e.sh" user="u" timeout="3" ssh-port="23"/>{N} machine="m"/>',
    '<machine name="m" address="a" timeout="x"/>', '<machine name="m" address="a" timeout="0"/>', '<machine name="m" address="a" ros-root="x"/>',
    '<machine name="m" address="a" default="x"/>', '<machine name="m" address="a"><env name="A" value="b"/></machine>',
    '<machine name="m" address="a"/><machine name="m" address="b"/>', '<machine name="m" address="a" env-loader="/e"/><machine name="m" address="a" env-loader="/e"/>',
    f'{N}/><machine name="m" address="a" env-loader="/e" default="true"/><node name="y" pkg="robot" type="t"/>', f'{N} machine=""/>',
    f'<group><machine name="m" address="a" env-loader="/e" default="true"/></group>{N}/>', f'{N} cwd="ros_home"/>', f'{N} cwd="Node"/>',
    include("arg", ns=""), include("arg", '<arg name="k" default="i"/>', pass_all_args="true"), '<rosparam ns="/">[1]</rosparam>',
    '<arg name="k" value="outer"/>' + include("arg", '<arg name="k" default="i"/>', pass_all_args="true"),
    '<arg name="k" value="outer"/>' + include("arg", '<arg name="k"/>', pass_all_args="true"), include("arg", '<arg name="k" value="1" default="2"/>'),
    include("arg", '<arg name="k" default="i"/><arg name="k" value="v"/>', pass_all_args="true"), include("arg", '<arg name="k" default="i"/>'),
    '<test test-name="t1" pkg="robot" type="t" time-limit="5" retry="2" args="a"/>', '<test test-name="t3" pkg="robot" type="t" time-limit="" retry=""/>',
    '<test test-name="t4" pkg="robot" type="t" retry="1.5"/>', '<machine name="m" address="a" ssh-port="22.5"/>',
    '<test test-name="t2" pkg="robot" type="t" cwd="node" launch-prefix="nice -n 1" ns="q"/>', '<master auto="start"/>',
    "".join(f'<group ns="robot{i}"><node name="n{i % 7}" pkg="robot" type="t" args="{i}"/><param name="i" value="{i}"/></group>' for i in range(200)),
]  # fmt: skip
TEXTS = [
    "<launch>", "<lunch/>", "", "<launch><node", '<?xml version="1.0" encoding="ISO-8859-1"?><launch/>',
    '<?xml version="1.0"?><!DOCTYPE launch><launch><param name="p" value="&lt;a&#98;"/></launch>',
    '<!DOCTYPE launch SYSTEM "no.dtd" [<!ELEMENT launch ANY>]><launch><param name="p" value="a"/></launch>',
    '<launch deprecated="old"><!-- c --><![CDATA[ x ]]>text</launch>',
]  # fmt: skip


def tell(label, files):
    show("#", label if len(label) < 400 else label[:400] + "...")
    try:
        config = roslaunch.config.ROSLaunchConfig()
        for file, argv in files:
            roslaunch.xmlloader.XmlLoader().load(file, config, argv=argv, verbose=False)
    except Exception:
        show("refused")
        return
    for node in (*config.nodes, *config.tests):
        words = [
            node.name, node.namespace, node.package, node.type, node.args, node.output or "log", node.respawn, node.respawn_delay,
            node.required, node.cwd or "ROS_HOME", node.launch_prefix, node.machine_name, node.remap_args, node.env_args,
        ]  # fmt: skip
        extra = [node.test_name, node.time_limit, node.retry] if node in config.tests else []
        show("node", *map(repr, words), *extra)
    for name in sorted(set(config.params) - {"/rosdistro", "/rosversion"}):
        show("param", name, repr(getattr(config.params[name].value, "data", config.params[name].value)))
    for name, machine in sorted(config.machines.items()):
        if name:
            show(
                "machine",
                name,
                machine.address,
                machine.env_loader,
                machine.user,
                machine.ssh_port,
                machine.timeout,
            )
    if config.clear_params:
        show("clear", sorted(name.rstrip("/") for name in config.clear_params))


def case(label, text, *argv):
    path = os.path.join(ROOT, "case.launch")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    tell(label, [(path, list(argv))])


for value in VALUES:
    case(value, f'<launch>{ARGS}<param name="p" value="{value}"/></launch>')
for value, kind in TYPES:
    case(f"{value} as {kind}", f'<launch><param name="p" value="{value}" type="{kind}"/></launch>')
for body in BODIES:
    case(body, f"<launch>{body}</launch>")
for text in TEXTS:
    case(text, text)
GIVEN = '<launch><arg name="a" default="1"/><param name="p" value="$(arg a)"/>{}</launch>'
case("an arg that is given", GIVEN.format(""), "a:=x y")
case("an arg that is given, and passed on", GIVEN.format(include("hands_on", pass_all_args="true")), "k:=3")
case("an arg that is given, and fixed", '<launch><arg name="a" value="1"/></launch>', "a:=2")
case("an arg that is given, and not declared", '<launch><param name="p" value="$(arg b)"/></launch>', "b:=3")
files = [(os.path.join(ROOT, "robot", name + ".launch"), []) for name in ("arg", "here")]
tell("two files", files)
show(sorted(roslaunch.config.load_config_default([files[0][0]], None).params["/p"].value))
for text in (
    "$(env CASE)",
    "$(find robot)",
    "$(arg a)",
    "$(env NOPE)",
    "$(eval 1 + 1)",
    "$(optenv NOPE d)",
    "$(dirname)",
):
    for context in (None, {"arg": {"a": "1"}}):
        try:
            show(text, context and "arg", roslaunch.substitution_args.resolve_args(text, context))
        except roslaunch.substitution_args.ArgException as error:
            show(text, "ArgException", error)
        except roslaunch.substitution_args.SubstitutionException:
            show(text, "SubstitutionException")
