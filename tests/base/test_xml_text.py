"""Each XML reader rejects texts that expand to gigabytes, and accepts those that real ROS accepts."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from minirospy.base.errors import LaunchError, ManifestError, UrdfError
from minirospy.base.xml_text import XmlError, XmlSyntaxError, check_xml, parse_xml
from minirospy.core.urdf.read import parse_robot
from minirospy.ros.catkin.commands.test_results import read_counts
from minirospy.ros.roslaunch.launcher.document import parse_document
from minirospy.ros.roslib.roslib import manifest as old_manifest
from minirospy.ros.rosunit.runner import junit
from minirospy.ros.urdfdom_py.urdf_parser_py.urdf import URDF
from minirospy.workspace.manifest import parse_manifest

LAUGHS = (
    '<!DOCTYPE {0} [<!ENTITY a0 "aaaaaaaaaa">'
    + "".join(f'<!ENTITY a{n} "' + f"&a{n - 1};" * 6 + '">' for n in range(1, 9))
    + "]>"
)
"""Each ``&a8;`` in it expands to 17 MB, which expat accepts within its own limit, 100 times the text plus 8 MiB."""

READERS: dict[str, tuple[str, Callable[[str], object], type[Exception]]] = {
    "robot description": ("robot", parse_robot, UrdfError),
    "launch file": ("launch", lambda text: parse_document(text.encode(), "x.launch"), LaunchError),
    "package.xml": ("package", lambda text: parse_manifest(text, Path("package.xml")), ManifestError),
    "manifest.xml": ("package", old_manifest.parse, old_manifest.ManifestException),
    "urdf_parser_py": ("robot", URDF.from_xml_string, ElementTree.ParseError),
    "shared reader": ("a", parse_xml, XmlError),
    "check for libraries": ("a", check_xml, XmlError),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(
    ("text", "why"),
    [
        (LAUGHS + "<{0}>&a8;</{0}>", "entity &a0; is declared, and entities are not supported"),
        ('<!DOCTYPE {0} [<!ENTITY % a "b">]><{0}/>', "entity %a; is declared"),
        ('<!DOCTYPE {0} [<!ENTITY a SYSTEM "/etc/passwd">]><{0}>&a;</{0}>', "entity &a; is declared"),
        ('<!DOCTYPE {0} [<!ATTLIST {0} x CDATA "1">]><{0}/>', "default is declared for the attribute 'x'"),
        ("<{0}>" + "<a>" * 200 + "</a>" * 200 + "</{0}>", "nested deeper than 100 levels"),
    ],
    ids=["laughs", "parameter entity", "external entity", "default of an attribute", "deep"],
)
def test_expanding_entities_are_refused_with_the_reason(reader: str, text: str, why: str) -> None:
    root, parse, error = READERS[reader]
    with pytest.raises(error, match=why):
        parse(text.format(root))


@pytest.mark.parametrize(
    "doctype",
    [
        "<!DOCTYPE a>",
        '<!DOCTYPE a SYSTEM "http://127.0.0.1:1/a.dtd">',
        '<!DOCTYPE a PUBLIC "-//W3C//DTD XHTML 1.0//EN" "a.dtd">',
        "<!DOCTYPE a [<!ELEMENT a ANY><!ATTLIST a x CDATA #IMPLIED>]>",
    ],
)
def test_harmless_document_types_are_accepted(doctype: str) -> None:
    text = doctype + "<a x='1'>b &lt; &#99;<c/>d</a>"
    check_xml(text)
    root = parse_xml(text)
    assert (root.tag, root.attributes, root.text) == ("a", {"x": "1"}, "b < cd")


def test_text_in_many_pieces_is_joined() -> None:
    root = parse_xml("<a>" + "<b/>&#97;\n" * 50_000 + "</a>")
    assert root.text == "a\n" * 50_000
    assert len(root.children) == 50_000
    assert root.children[-1].line == 50_000


def test_too_many_tags_are_refused() -> None:
    with pytest.raises(XmlError, match="more than 1000000 tags"):
        check_xml("<a>" + "<b/>" * 1_000_000 + "</a>")


def test_invalid_xml_is_a_syntax_error_with_its_line() -> None:
    with pytest.raises(XmlSyntaxError, match=r"line 2: mismatched tag"):
        parse_xml("<a>\n</b>")


def test_test_results_that_unfold_are_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "results.xml"
    file.write_text(LAUGHS.format("testsuite") + "<testsuite>&a8;</testsuite>")
    with pytest.raises(ValueError, match="line 1: the entity &a0; is declared"):
        read_counts(file)
    assert junit.read(file, "x").num_tests == 0
    assert "WARN: cannot read test result file" in capsys.readouterr().out


@pytest.mark.parametrize("included", [False, True])
def test_xacro_refuses_expanding_entities(tmp_path: Path, included: bool) -> None:
    pytest.importorskip("xacro")
    bad, main = tmp_path / "bad.xacro", tmp_path / "main.xacro"
    bad.write_text(LAUGHS.format("robot") + "<robot>&a8;</robot>")
    main.write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r"><xacro:include filename="bad.xacro"/></robot>'
    )
    program = "import minirospy.ros.xacro.commands.xacro as x; raise SystemExit(x.main())"
    done = subprocess.run(
        [sys.executable, "-c", program, main if included else bad],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2, done
    assert "the entity &a0; is declared" in done.stderr
    assert "Traceback" not in done.stderr
    assert not done.stdout


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("<l><!-- a -- b --></l>", "a comment contains no --"),
        ("<l>\n<!-- a\n  -- b -->\n</l>", "a comment contains no --"),
        ("<l><!-- a ---></l>", "a comment contains no --"),
        ("<l a='1 & 2'/>", "& is written &amp;"),
        ("<l>1 &amp; 2 & 3</l>", "& is written &amp;"),
        ("<l a='a<b'/>", "< in a value is written &lt;"),
        ('<l b="&lt;" a="a<b"/>', "< in a value is written &lt;"),
        ("<l a='x b='1'/>", "the value of a has no closing quote"),
        ("<l a='_p:=' b='1 & 2'/>", "& is written &amp;"),
        ("<l a=\u201cx\u201d/>", "a value is written in straight quotes, \" or '"),
        ("<l a=x b='1 & 2'/>", 'a value is written in quotes: a="x"'),
        ("<l/><l/>", "a file has one outermost tag"),
        ("<l/>text", "a file has one outermost tag"),
    ],
)
def test_usual_mistake_is_named(text: str, advice: str) -> None:
    with pytest.raises(XmlSyntaxError) as error:
        parse_xml(text)
    assert error.value.why.endswith(f"): {advice}")


@pytest.mark.parametrize(
    "text",
    ["<l a='1'b='2'/>", "<l a='1' a='2' b='c=“x”'/>", "<l>\x01</l>", "<l><!-- a --><b a='--x'/>\x01</l>"],
)
def test_other_mistakes_get_no_advice(text: str) -> None:
    with pytest.raises(XmlSyntaxError) as error:
        parse_xml(text)
    assert error.value.why.endswith(")")
