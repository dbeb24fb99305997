"""ros/roslaunch/launcher/load: the contents of files, and every error with its line."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import LaunchError
from minirospy.ros.roslaunch.launcher.arg_docs import describe_args
from minirospy.ros.roslaunch.launcher.load import LaunchSource, load_files, load_sources, load_text
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, ParameterCommand
from minirospy.workspace.packages import Packages


@pytest.fixture
def packages() -> Packages:
    return Packages(Environment.read({}))


def load(packages: Packages, body: str, **args: str) -> LaunchSpec:
    return load_text(f"<launch>\n{body}\n</launch>", args, packages, {"HOME": "/home/me"})


def test_the_workshops_file(packages: Packages) -> None:
    spec = load_files([str(packages.find_resource("rpi_feros_bringup", "rpi_led.launch"))], {}, packages)
    assert [(n.name, n.package, n.type, n.output) for n in spec.nodes] == [
        ("/btn_pub", "rpi_feros", "button_publisher.py", "screen"),
        ("/led_act", "rpi_feros", "led_actuator.py", "screen"),
    ]


@pytest.mark.parametrize(
    ("attributes", "value"),
    [
        ('value="5"', 5),
        ('value="1.5"', 1.5),
        ('value="True"', True),
        ('value="text"', "text"),
        ('value="1" type="str"', "1"),
        ('value="1" type="double"', 1.0),
        ('value="1" type="bool"', True),
        ('value="[1, a]" type="yaml"', [1, "a"]),
        ('value="{a:[1]}" type="yaml"', {"a": [1]}),
        ('command="echo hi"', "hi\n"),
        ('value="$(env HOME)/x"', "/home/me/x"),
        ('value="$(optenv NOPE a b)"', "a b"),
        ('value="$(eval 1 + 2 * 3)"', 7),
        ("value=\"$(eval optenv('NOPE', 5) + 1)\"", 6),
        ("value=\"$(eval optenv('NOPE', 0) and optenv('HOME', 1))\"", 0),
    ],
)
def test_param_values(packages: Packages, attributes: str, value: object) -> None:
    assert load(packages, f'<param name="p" {attributes}/>').params == {"/p": value}


@pytest.mark.parametrize(
    ("declaration", "encoding"), [("", "Latin-1"), ('<?xml version="1.0" encoding="cp1252"?>', "cp1252")]
)
def test_a_description_that_is_not_utf_8_is_read_with_a_warning(
    packages: Packages, tmp_path: Path, declaration: str, encoding: str
) -> None:
    text = f'{declaration}<robot name="caf\xe9"/>'
    file = tmp_path / "robot.urdf"
    file.write_bytes(text.encode(encoding))
    spec = load(packages, f'<param name="robot_description" textfile="{file}"/>')
    assert spec.params == {"/robot_description": text}
    [warning] = spec.warnings
    assert (warning.line, f"is not UTF-8 text: it was read as {encoding}" in str(warning)) == (2, True)


def test_other_text_that_is_not_utf_8_is_refused(packages: Packages, tmp_path: Path) -> None:
    file = tmp_path / "text"
    file.write_bytes(b"caf\xe9")
    with pytest.raises(LaunchError, match="is not UTF-8 text"):
        load(packages, f'<param name="p" textfile="{file}"/>')


def test_args_defaults_and_overrides(packages: Packages) -> None:
    body = '<arg name="a" default="1"/><arg name="b" value="$(arg a)2"/><param name="p" value="$(arg b)"/>'
    assert load(packages, body).params == {"/p": 12}
    assert load(packages, body, a="3").params == {"/p": 32}


def test_groups_bound_what_they_say(packages: Packages) -> None:
    spec = load(
        packages,
        """
        <remap from="a" to="b"/>
        <group ns="g"><env name="E" value="1"/><remap from="c" to="d"/>
          <node name="in" pkg="p" type="t" ns="deep"><param name="q" value="1"/><remap from="e" to="f"/></node>
          <param name="r" value="2"/>
        </group>
        <node name="out" pkg="p" type="t"/>
        """,
    )
    inner, outer = spec.nodes
    assert (inner.name, inner.remaps) == ("/g/deep/in", (("a", "b"), ("c", "d"), ("e", "f")))
    assert inner.env == (("E", "1"),)
    assert (outer.name, outer.remaps, outer.env) == ("/out", (("a", "b"),), ())
    assert spec.params == {"/g/deep/in/q": 1, "/g/r": 2}


def test_private_params_go_to_the_nodes_that_follow(packages: Packages) -> None:
    spec = load(
        packages,
        '<node name="before" pkg="p" type="t"/><param name="~x" value="1"/><node name="after" pkg="p" type="t"/>',
    )
    assert spec.params == {"/after/x": 1}


def test_a_param_takes_precedence_over_a_rosparam_of_its_node(packages: Packages) -> None:
    node = '<node pkg="rpi_feros" type="n" name="n"><param name="a" value="1"/><rosparam>{a: 2, b: 3}</rosparam></node>'
    assert load(packages, f'<param name="~b" value="4"/>{node}').params == {"/n/a": 1, "/n/b": 4}


def test_rosparam_sets_leaves_and_leaves_siblings_alone(packages: Packages) -> None:
    spec = load(
        packages,
        '<param name="a/x" value="0"/><rosparam>\na: {y: [1, 2]}\n</rosparam>'
        '<rosparam param="s" subst_value="true">$(eval 2 * 2)</rosparam><rosparam command="delete" param="gone"/>',
    )
    assert spec.params == {"/a/x": 0, "/a/y": [1, 2], "/s": 4}
    assert (spec.clear, spec.commands) == ([], [ParameterCommand("/gone")])


def test_rosparam_with_ns_takes_any_value(packages: Packages) -> None:
    body = '<rosparam ns="chain">[1, 2]</rosparam><group ns="g"><rosparam ns="n">5</rosparam></group>'
    assert load(packages, body).params == {"/chain": [1, 2], "/g/n": 5}


def test_if_and_unless(packages: Packages) -> None:
    body = '<arg name="on"/><param name="a" value="1" if="$(arg on)"/><param name="b" value="1" unless="$(arg on)"/>'
    assert set(load(packages, body, on="true").params) == {"/a"}
    assert set(load(packages, body, on="0").params) == {"/b"}


def test_includes_have_args_and_namespaces_of_their_own(packages: Packages, tmp_path: Path) -> None:
    inner = tmp_path / "inner.launch"
    inner.write_text('<launch><arg name="k" default="d"/><param name="p" value="$(arg k)"/></launch>')
    outer = tmp_path / "outer.launch"
    outer.write_text(
        '<launch><arg name="k" default="o"/>'
        '<include file="$(dirname)/inner.launch" ns="one"><arg name="k" value="v"/></include>'
        '<include file="$(dirname)/inner.launch" ns="two" pass_all_args="true"/>'
        '<include file="$(dirname)/inner.launch"/></launch>'
    )
    spec = load_files([str(outer)], {}, packages)
    assert spec.params == {"/one/p": "v", "/two/p": "o", "/p": "d"}
    assert spec.files == [str(outer), str(inner)]


def test_handed_on_arg_goes_before_a_default_of_the_include(packages: Packages, tmp_path: Path) -> None:
    inner = tmp_path / "inner.launch"
    inner.write_text(
        '<launch><arg name="k" default="d"/><arg name="n" default="e"/><param name="p" value="$(arg k) $(arg n)"/></launch>'
    )
    outer = tmp_path / "outer.launch"
    outer.write_text(
        '<launch><arg name="k" default="o"/>'
        '<include file="$(dirname)/inner.launch" ns="one" pass_all_args="true">'
        '<arg name="k" default="i"/><arg name="n" default="j"/></include>'
        '<include file="$(dirname)/inner.launch" ns="two" pass_all_args="true"><arg name="k"/></include>'
        '<include file="$(dirname)/inner.launch" ns="three" pass_all_args="true"><arg name="k" default="i"/>'
        '<arg name="k" value="v"/></include>'
        '<include file="$(dirname)/inner.launch" ns="four"><arg name="k" default="i"/></include></launch>'
    )
    found = load_files([str(outer)], {}, packages).params
    assert found == {"/one/p": "o j", "/two/p": "o e", "/three/p": "v e", "/four/p": "i e"}


def test_anon_is_the_same_name_in_all_places(packages: Packages) -> None:
    spec = load(packages, '<node name="$(anon n)" pkg="p" type="t"/><param name="x" value="$(anon n)"/>')
    assert spec.nodes[0].base_name == spec.params["/x"]


def test_default_machine_is_that_of_the_nodes_that_follow(packages: Packages, tmp_path: Path) -> None:
    inner = tmp_path / "inner.launch"
    inner.write_text(
        '<launch><node name="c" pkg="p" type="t"/><machine name="k" address="10.0.0.2" default="true"/></launch>'
    )
    body = (
        '<node name="a" pkg="p" type="t"/><group><machine name="m" address="10.0.0.1" default="True"/></group>'
        '<machine name="other" address="10.0.0.3" default=""/>'
        f'<node name="b" pkg="p" type="t"/><include file="{inner}"/><node name="d" pkg="p" type="t"/>'
        '<node name="e" pkg="p" type="t" machine="m"/>'
    )
    spec = load(packages, body)
    assert {node.name: node.machine for node in spec.nodes} == {
        "/a": "",
        "/b": "m",
        "/c": "m",
        "/d": "k",
        "/e": "m",
    }
    assert spec.machine_of(spec.nodes[0]) is None


def test_the_args_of_a_file_are_described(tmp_path: Path) -> None:
    file = tmp_path / "a.launch"
    file.write_text(
        '<launch><arg name="a"/><arg name="b" default="1" doc="a number"/><arg name="c" value="2"/></launch>'
    )
    assert [(arg.name, arg.default, arg.doc) for arg in describe_args(str(file))] == [
        ("a", None, None),
        ("b", "1", "a number"),
    ]


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ('<node name="x"/>', "missing required attribute: 'pkg'"),
        ('<node nam="x" pkg="p" type="t"/>', r"missing required attribute: 'name' \(there is 'nam'\)"),
        ('<node name="a/b" pkg="p" type="t"/>', "cannot contain a namespace"),
        ('<node name="" pkg="p" type="t"/>', "empty 'name'"),
        ('<node name="x" pkg="p" type="t" ns=""/>', "empty 'ns'"),
        ('<node name="x" pkg="p" type="t" ns="~a"/>', "into a global name"),
        (
            '<node name="x" pkg="p" type="t" cwd="there"/>',
            "cwd must be one of 'ROS_HOME', 'node', not 'there'",
        ),
        ('<node name="x" pkg="p" type="t" respawn_delay="x"/>', "invalid float value for respawn_delay"),
        ('<node name="x" pkg="p" type="t" output="file"/>', "output must be one of 'log', 'screen'"),
        ('<node name="x" pkg="p" type="t" respawn="yes"/>', "invalid bool value for respawn"),
        ('<node name="x" pkg="p" type="t" respawn="true" required="true"/>', "cannot both be set"),
        ('<node name="x" pkg="p" type="t"/>\n\n<node name="x" pkg="p" type="t"/>', "multiple nodes named"),
        ('<param name="p"/>', "one and only one of value"),
        ('<param name="p" value="x" type="int"/>', "invalid literal"),
        ('<param name="p" value="x" type="what"/>', "Unknown type 'what'"),
        ('<param name="p" textfile="/no/such"/>', "file does not exist"),
        ('<param name="p" command="sh -c \'exit 3\'"/>', r"returned with code \[3\]"),
        ('<param name="p" value="$(arg no)"/>', "arg 'no' is not defined"),
        ('<param name="p" value="$(env NO_SUCH)"/>', "'NO_SUCH' is not set"),
        ('<param name="p" value="$(find no_such)"/>', r"package \[no_such\] not found"),
        ('<param name="p" value="$(what x)"/>', "Unknown substitution command"),
        ('<param name="p" value="$(eval 1 +)"/>', "cannot be evaluated"),
        ('<param name="p" value="$(eval ().__class__)"/>', "double underscore"),
        ('<param name="p" value="$(eval nope)"/>', "name 'nope' is not defined"),
        ('<param name="p" value="$(eval arg(1))"/>', "arg '1' is not defined"),
        ('<param name="p" value="x $(eval 1)"/>', "must stand alone"),
        ('<param name="p" value="$(optenv A $(arg b))"/>', "cannot hold another"),
        ('<param name="p" value="$(find)"/>', "takes one package"),
        ('<param name="p" value="$( )"/>', "Unknown substitution command"),
        ('<param name="p" command="no_such_command"/>', "no such command"),
        ('<param name="p" value="99999999999"/>', "32 bits"),
        ('<param name="p" value="" type="yaml"/>', "null is not a value"),
        ('<param name="p" binfile="/no/such"/>', "file does not exist"),
        ('<arg name="a"/><param name="p" value="$(arg a)"/>', "requires the 'a' arg to be set: add a:=VALUE"),
        (
            '<arg name="a"/><param name="p" value="$(eval a)"/>',
            "requires the 'a' arg to be set: add a:=VALUE",
        ),
        ('<arg name="a" default="1" value="2"/>', "one and only one of value/default"),
        ('<arg name="a" value="1"/><arg name="a" value="2"/>', "already been declared"),
        ("<rosparam>[1</rosparam>", "line 2, column 1"),
        ("<rosparam>{1: 2}</rosparam>", "the key 1 is not a text"),
        ('<rosparam command="delete"/>', "needs a param or ns"),
        ('<rosparam command="dump"/>', "needs a file"),
        ("<rosparam>[1]</rosparam>", "'param' attribute must be set for non-dictionary values"),
        ('<rosparam command="what"/>', "command must be one of 'load', 'dump', 'delete'"),
        ('<include file="/no/such.launch"/>', r"cannot include \[/no/such.launch\]"),
        ('<group if="1" unless="1"/>', "both 'if' and 'unless'"),
        ('<group clear_params="true"/>', "'ns' attribute must be set in order to use"),
        ('<remap from="a b" to="c"/>', "not a valid ROS name"),
        ('<env name="" value="1"/>', "empty 'name'"),
        ('<include file="x" ns=""/>', "<include> tag has an empty 'ns' attribute"),
        ('<test test-name="x" pkg="p" type="t" retry="1.5"/>', "'retry' must be a number"),
        ('<rosparam ns="/">[1]</rosparam>', "Cannot load non-dictionary types into global namespace '/'"),
        ('<machine name="m"/>', "missing required attribute: 'address'"),
        ('<machine name="m" address="a" timeout="0"/>', "positive number"),
        (
            '<machine name="m" address="a" default="x"/>',
            "default must be one of 'false', 'true', 'never', not 'x'",
        ),
        ('<machine name="m" address="a" ros-root="/x"/>', "use env-loader"),
        ('<machine name="m" address="a"><env name="a" value="b"/></machine>', "use env-loader"),
        ('<param name="p" value="1" type="float"/>', "Unknown type 'float'"),
        ('<machine name="m" address="a"/><machine name="m" address="b"/>', "declared otherwise"),
    ],
)
def test_errors_name_the_line(packages: Packages, body: str, says: str) -> None:
    with pytest.raises(LaunchError, match=says) as raised:
        load(packages, body)
    assert raised.value.file == "<stdin>"
    assert raised.value.line == (4 if "multiple" in says else 2)


def test_other_tags_in_a_machine_are_warnings(packages: Packages) -> None:
    spec = load(packages, '<machine name="m" address="a"><foo/><param name="p" value="1"/></machine>')
    assert list(spec.machines) == ["m"]
    assert [str(each) for each in spec.warnings] == [
        "<stdin>:2: unrecognized 'foo' tag in <machine> tag",
        "<stdin>:2: unrecognized 'param' tag in <machine> tag",
    ]


@pytest.mark.parametrize(
    ("errors", "reason"),
    [
        ("warning\nerror: no macro\nwhen processing file: x\n", ": error: no macro"),
        (
            "XML parsing error: mismatched tag\n\nCheck that:\n - it is XML\n",
            ": XML parsing error: mismatched tag",
        ),
        ("Traceback (most recent call last):\nValueError: no\n", ": ValueError: no"),
        ("first\n\x1b[31mthe reason\x1b[0m\n\n", ": the reason"),
        ("", ""),
    ],
)
def test_command_that_fails_is_named_with_its_reason(
    packages: Packages, tmp_path: Path, capfd: pytest.CaptureFixture[str], errors: str, reason: str
) -> None:
    program = tmp_path / "fails.py"
    program.write_text(f"import sys\nsys.stderr.write({errors!r})\nsys.exit(2)\n", encoding="utf-8")
    command = f"{Path(sys.executable).as_posix()} {program.as_posix()}"
    with pytest.raises(LaunchError) as raised:
        load(packages, f'<param name="p" command="{command}"/>')
    assert str(raised.value) == f"<stdin>:2: command [{command}] returned with code [2]{reason}"
    assert capfd.readouterr().err.replace("\r\n", "\n") == errors


def test_errors_of_a_command_that_succeeds_are_passed_on(
    packages: Packages, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "warns.py"
    program.write_text("import sys\nprint(5)\nsys.stderr.write('w' * 200_000)\n", encoding="utf-8")
    command = f"{Path(sys.executable).as_posix()} {program.as_posix()}"
    load(packages, f'<param name="p" command="{command}"/>')
    assert capfd.readouterr().err == "w" * 200_000


@pytest.mark.parametrize(
    ("file", "near"),
    [
        ("launch/bringp.launch", "bringup.launch"),
        ("launch/bringup.lauch", "bringup.launch"),
        ("bringup.launch", "{package}/launch/bringup.launch"),
        ("lanch/bringup.launch", "{package}/launch/bringup.launch"),
        ("launch/arm_right.launch", "arm_right.launch.xml"),
        ("launch/arm_left.launch", ""),
        ("launch/x.launch", ""),
        ("launch", ""),
    ],
)
def test_an_include_that_is_not_there_has_the_nearest_names(
    packages: Packages, tmp_path: Path, file: str, near: str
) -> None:
    (tmp_path / "launch").mkdir()
    (tmp_path / "package.xml").touch()
    for name in ("bringup.launch", "camera.launch", "arm_right.launch.xml", "notes.txt"):
        (tmp_path / "launch" / name).touch()
    with pytest.raises(LaunchError) as raised:
        load(packages, f'<include file="{tmp_path / file}"/>')

    assert str(raised.value).startswith(f"<stdin>:2: cannot include [{tmp_path / file}]: ")
    hint = str(raised.value).partition("; ")[2]
    assert hint == (near and f"did you mean {near.format(package=tmp_path)}?")


def test_unused_args_of_an_include_are_refused(packages: Packages, tmp_path: Path) -> None:
    inner = tmp_path / "inner.launch"
    inner.write_text("<launch/>")
    with pytest.raises(LaunchError, match=r"unused args \[k\]"):
        load(packages, f'<include file="{inner}"><arg name="k" value="1"/></include>')


def test_a_file_that_includes_itself_ends(packages: Packages, tmp_path: Path) -> None:
    file = tmp_path / "self.launch"
    file.write_text('<launch><include file="$(dirname)/self.launch"/></launch>')
    with pytest.raises(LaunchError, match="does a file include itself"):
        load_files([str(file)], {}, packages)


@pytest.mark.parametrize(
    ("text", "says"),
    [("<launch>\n<node", "Invalid roslaunch XML syntax"), ("<lunch/>", "no root <launch> tag, but <lunch>"),
     ("", "no element found"),
     ('<?xml version="1.0" encoding="no-such"?><launch/>', "unknown encoding")],
)  # fmt: skip
def test_what_is_not_a_launch_file(packages: Packages, text: str, says: str) -> None:
    with pytest.raises(LaunchError, match=says):
        load_text(text, {}, packages)


EXPLODING = {
    "tags": "<group>" * 100_000 + "</group>" * 100_000,
    "entities": '<param name="a" value="&j;"/>',
    "a parameter of brackets": f"<rosparam>a: {'[' * 100_000}</rosparam>",
    "a parameter of aliases": "<rosparam>a0: &amp;a0 [x]\n"
    + "\n".join(f"a{n}: &amp;a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12))
    + "</rosparam>",
    "a value of brackets": f'<param name="a" type="yaml" value="{"[" * 100_000}"/>',
}
LAUGHS = "".join(f'<!ENTITY {b} "{f"&{a};" * 20}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True))


@pytest.mark.parametrize("body", EXPLODING.values(), ids=list(EXPLODING))
def test_file_that_explodes_is_refused_in_one_line(packages: Packages, body: str) -> None:
    head = f'<!DOCTYPE launch [<!ENTITY a "x">{LAUGHS}]>' if "&j;" in body else ""
    with pytest.raises(LaunchError) as raised:
        load_text(f"{head}<launch>{body}</launch>", {}, packages, {"HOME": "/home/me"})
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 300


def test_files_that_include_the_next_one_twice_are_refused(
    packages: Packages, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Without a limit, there would be 2^40 includes. Ten thousand, the limit of users, take seconds.
    monkeypatch.setattr("minirospy.ros.roslaunch.launcher.load.MAX_INCLUDES", 300)
    for number in range(40):
        include = f'<include file="$(dirname)/f{number + 1}.launch"/>'
        (tmp_path / f"f{number}.launch").write_text(f"<launch>{include * 2}</launch>")
    (tmp_path / "f40.launch").write_text("<launch/>")
    with pytest.raises(LaunchError, match=r"f\d+\.launch:1: more than 300 files are included: do files"):
        load_files([str(tmp_path / "f0.launch")], {}, packages)

    problems: list[LaunchError] = []
    load_sources([LaunchSource(str(tmp_path / "f0.launch"), None, {})], packages, problems=problems)
    assert len(problems) == 1


def test_args_that_double_are_refused(packages: Packages) -> None:
    args = "".join(f'<arg name="a{n + 1}" value="$(arg a{n})$(arg a{n})"/>' for n in range(60))
    with pytest.raises(LaunchError, match="give more than 67108864 characters: does an arg hold another one"):
        load(packages, '<arg name="a0" value="0123456789"/>' + args)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("$(" + "a" * 60_000, None),
        ("$(a" * 60_000, "a substitution cannot hold another"),
        ("$(" + "a" * 60_000 + "(", "a substitution cannot hold another"),
        ("$(find " + "a" * 60_000 + ")", "aaa] not found"),
        ("$(" + "a " * 60_000 + ")", "Unknown substitution command"),
    ],
    ids=["open", "nested", "bracket", "package", "words"],
)
def test_long_substitutions_take_no_time(packages: Packages, text: str, why: str | None) -> None:
    # Without the fix, the first one took 20 s, because each character was tried as the end of two parts.
    if why is None:
        assert load(packages, f'<param name="p" value="{text}"/>').params == {"/p": text}
        return
    with pytest.raises(LaunchError, match=why):
        load(packages, f'<param name="p" value="{text}"/>')


def test_substitution_of_several_lines_is_refused_in_one_line(packages: Packages) -> None:
    with pytest.raises(LaunchError, match="cannot hold another") as raised:
        load(packages, '<rosparam subst_value="true">a: $(arg(b)\nc: d</rosparam>')
    assert "\n" not in str(raised.value)


@pytest.mark.skipif(sys.platform == "win32", reason="there is no yes")
@pytest.mark.parametrize("command", ["yes", "sh -c 'yes &amp; yes'"])
def test_command_without_end_is_stopped(packages: Packages, command: str) -> None:
    with pytest.raises(LaunchError, match="has written more than 67108864 bytes, and was stopped"):
        load(packages, f'<param name="p" command="{command}"/>')


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no file without end")
@pytest.mark.parametrize(
    "tag",
    [
        '<param name="p" textfile="/dev/zero"/>',
        '<param name="p" binfile="/dev/zero"/>',
        '<rosparam file="/dev/zero"/>',
        '<include file="/dev/zero"/>',
    ],
)
def test_file_without_end_is_refused(packages: Packages, tag: str) -> None:
    with pytest.raises(LaunchError, match=r"\[/dev/zero\]: it has more than \d+ bytes"):
        load(packages, tag)


def test_yaml_with_a_control_character_is_one_line(packages: Packages) -> None:
    with pytest.raises(LaunchError) as raised:
        load(packages, '<param name="p" type="yaml" value="a: &#127;"/>')
    assert "\n" not in str(raised.value)
