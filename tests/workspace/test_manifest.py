"""workspace/manifest: package.xml in formats 1, 2 and 3."""

from __future__ import annotations

import re
from pathlib import Path
from xml.sax.saxutils import escape

import pytest

from minirospy.workspace.manifest import (
    Dependency,
    Kind,
    Manifest,
    ManifestError,
    Person,
    Url,
    evaluate_condition,
    parse_manifest,
    read_manifest,
)

HEAD = (
    "<name>robot</name><version>1.2.3</version><description>Moves.</description>"
    '<maintainer email="a@b.org">Ann</maintainer><license>BSD</license>'
)
MSGS = Path(__file__).parents[2] / "msgs"


def parse(body: str = "", format: str = ' format="2"', **variables: str) -> Manifest:
    return parse_manifest(f"<package{format}>{HEAD}\n{body}</package>", Path("package.xml"), variables)


def test_all_that_is_said_about_a_package() -> None:
    manifest = parse(
        """<description/>
        <author>Bob</author><author email="c@d.org">Cid</author><license>MIT</license>
        <url>http://w</url><url type="repository">http://r</url>
        <export><build_type>cmake</build_type><rviz plugin="${prefix}/p.xml"/></export>"""
    )
    assert (manifest.format, manifest.name, manifest.version) == (2, "robot", "1.2.3")
    assert manifest.maintainers == (Person("Ann", "a@b.org"),)
    assert manifest.authors == (Person("Bob", ""), Person("Cid", "c@d.org"))
    assert manifest.licenses == ("BSD", "MIT")
    assert manifest.urls == (Url("http://w", "website"), Url("http://r", "repository"))
    assert manifest.build_type == "cmake"
    assert manifest.exports[1].attributes == {"plugin": "${prefix}/p.xml"}
    assert not manifest.is_metapackage


def test_the_text_of_inner_tags_belongs_to_the_description() -> None:
    text = f"<package>{HEAD.replace('Moves.', 'It <b>moves</b>' + chr(10) + '  fast.')}</package>"
    assert parse_manifest(text, Path("p")).description == "It moves fast."


def test_kinds_of_dependencies_of_format_2() -> None:
    tags = [*(kind.value for kind in Kind), "depend"]
    manifest = parse("".join(f"\n<{tag}>{tag[:-7] or 'all'}</{tag}>" for tag in tags))
    both = {Kind.BUILD, Kind.BUILD_EXPORT, Kind.EXEC}
    for kind in Kind:
        assert manifest.depends(kind) == (kind.value[:-7], *(["all"] if kind in both else [])), kind
    assert manifest.depends() == tuple(tag[:-7] or "all" for tag in tags)
    assert manifest.problems == ()


def test_run_depend_of_format_1_is_for_building_on_it_and_for_running() -> None:
    manifest = parse("<run_depend>a</run_depend><build_depend>b</build_depend>", format="")
    assert manifest.format == 1
    assert manifest.depends(Kind.BUILD_EXPORT) == manifest.depends(Kind.EXEC) == ("a",)
    assert manifest.depends(Kind.BUILD) == ("b",)
    assert manifest.problems == ()


def test_versions_and_lines() -> None:
    manifest = parse('\n<depend version_gte="1.0" version_lt="2.0">a</depend>')
    both = frozenset({Kind.BUILD, Kind.BUILD_EXPORT, Kind.EXEC})
    assert manifest.dependencies == (Dependency("a", both, "depend", 3),)
    assert manifest.problems == ()


@pytest.mark.parametrize(
    ("variables", "left"),
    [({}, ("one", "noetic")), ({"ROS_VERSION": "2", "ROS_DISTRO": "humble"}, ("two",))],
)
def test_conditions_of_format_3(variables: dict[str, str], left: tuple[str, ...]) -> None:
    manifest = parse(
        """<depend condition="$ROS_VERSION == 1">one</depend>
        <depend condition="$ROS_VERSION == 2">two</depend>
        <exec_depend condition="$ROS_DISTRO == 'noetic' and $ROS_PYTHON_VERSION == 3">noetic</exec_depend>
        <export><build_type condition="$ROS_VERSION == 2">ament_cmake</build_type></export>""",
        ' format="3"',
        **variables,
    )
    assert manifest.depends(Kind.EXEC) == left
    assert manifest.build_type == ("ament_cmake" if variables else "catkin")
    assert manifest.problems == ()


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("$ROS_VERSION == 1", True),
        ("$ROS_VERSION==1", True),
        ("$UNKNOWN == ''", True),
        ("$ROS_VERSION > 0 or $Y != z and $Z == q", True),
        ("($ROS_VERSION == 2 or $ROS_VERSION == 1) and 2 == 1", False),
        ("$ROS_VERSION == 2 or 1 == 1 and 1 == 2", False),
        ("'a b' == \"a b\"", True),
        ("'$ROS_VERSION' == '1'", False),
        ("((1 <= 1))", True),
    ],
)
def test_conditions(condition: str, holds: bool) -> None:
    assert evaluate_condition(condition, {"ROS_VERSION": "1"}) is holds


@pytest.mark.parametrize(
    "condition",
    [
        "",
        " ",
        "$X",
        "1 == 1 == 1",
        "a.b == a.b",
        "$X = 1",
        "not 1 == 1",
        "1 == 1 AND 2 == 2",
        "(1 == 1",
        "1<2and 2<3",
    ],
)
def test_an_invalid_condition_is_an_error(condition: str) -> None:
    with pytest.raises(ValueError, match=r"is expected|is missing"):
        evaluate_condition(condition, {})
    with pytest.raises(ManifestError, match=r"package\.xml:2: condition '.*' of <depend>: "):
        parse(f'<depend condition="{condition.replace("<", "&lt;")}">a</depend>', ' format="3"')


def test_exports_of_a_metapackage() -> None:
    assert parse("<export><metapackage/></export>").is_metapackage
    assert not parse("<export><deprecated/></export>").is_metapackage


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("<package><name>x</nam></package>", "p.xml:1: not XML: mismatched tag"),
        ("<package>\n\n<name>x", "p.xml:3: not XML: no element found"),
        ("", "p.xml:1: not XML: no element found"),
        ("<launch/>", "p.xml:1: the root tag is <launch> instead of <package>"),
        ("<package><version>1.0.0</version></package>", "p.xml:1: the package has no <name>"),
        ("<?xml version='1.0' encoding='no-such'?><package/>", "p.xml:1: not XML: unknown encoding"),
    ],
)
def test_an_invalid_manifest_is_an_error(text: str, why: str) -> None:
    with pytest.raises(ManifestError, match=re.escape(why)):
        parse_manifest(text.encode(), Path("p.xml"))


@pytest.mark.parametrize(
    ("format", "body", "why"),
    [
        ("", "<depend>a</depend>", "package.xml:2: format 1 has no tag <depend>: format 1 has <build_depend>"),
        (' format="2"', "<run_depend>a</run_depend>", "package.xml:2: format 2 has no tag <run_depend>: formats 2 and 3"),
        (' format="2"', "\n<foo/>", "package.xml:3: format 2 has no tag <foo>"),
        (' format="2"', '<depend condition="1 == 1">a</depend>', "has no attribute 'condition': conditions need"),
        (' format="4"', "", "package.xml:1: package format '4' is unknown"),
        (' format="2"', "<name>b</name>", "package.xml:2: a second <name>: the first is in line 1"),
        (' format="2"', "<maintainer>Bob</maintainer>", "package.xml:2: maintainer 'Bob' has no email"),
        (' format="2"', '<maintainer email="bob@localhost">Bob</maintainer>', 'Invalid email "bob@localhost" for person "Bob"'),
        (' format="2"', '\n<author email="at home">Ann</author>', 'package.xml:3: Invalid email "at home" for person "Ann"'),
    ],
)  # fmt: skip
def test_problems_that_catkin_refuses_are_recorded(format: str, body: str, why: str) -> None:
    manifest = parse(body, format)
    assert manifest.name == "robot"
    assert why in f"package.xml:{manifest.problems[0].line}: {manifest.problems[0].text}"


@pytest.mark.parametrize("email", ["a@b.de", "a.b-c_d%e+f@g-h.ij.kl", "1@2.de"])
def test_addresses_that_catkin_accepts_are_no_problem(email: str) -> None:
    manifest = parse(f'<author email="{email}">Ann</author><author>Bob</author>', ' format="2"')
    assert manifest.problems == ()


@pytest.mark.parametrize(
    "email", ["a@b", "a@b.d", "a b@c.de", "ä@b.de", "a..b@c.de", "a@b_c.de", "a@b.de ", "<a@b.de>"]
)
def test_addresses_that_catkin_refuses_are_recorded(email: str) -> None:
    manifest = parse(f'<author email="{escape(email)}">Ann</author>', ' format="2"')
    assert [problem.text.partition(" (")[0] for problem in manifest.problems] == [
        f'Invalid email "{email}" for person "Ann"'
    ]


def test_a_name_is_all_that_must_be_there() -> None:
    manifest = parse_manifest("<package><name>x</name></package>", Path("p"))
    assert [problem.text for problem in manifest.problems] == [
        f"the package has no <{tag}>" for tag in ("description", "license", "maintainer", "version")
    ]


def test_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match="No such file"):
        read_manifest(tmp_path / "package.xml")
    (tmp_path / "package.xml").write_bytes(
        f"<?xml version='1.0' encoding='latin-1'?><package>{HEAD.replace('Ann', 'Änn')}</package>".encode(
            "latin-1"
        )
    )
    manifest = read_manifest(tmp_path)
    assert manifest.path == tmp_path / "package.xml"
    assert manifest.maintainers[0].name == "Änn"


def test_our_own_manifests_are_as_catkin_wants_them() -> None:
    paths = sorted(MSGS.glob("*/package.xml"))
    assert paths
    for path in paths:
        assert read_manifest(path).problems == (), path


def test_condition_of_many_brackets_is_refused() -> None:
    with pytest.raises(ValueError, match="brackets are nested deeper than 50 levels"):
        evaluate_condition("(" * 20_000 + "1 == 1" + ")" * 20_000, {})
    assert evaluate_condition(" or ".join(["(1 == 1)"] * 1_000), {})
