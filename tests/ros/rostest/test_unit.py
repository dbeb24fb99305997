"""rosunit.unitrun and the XML that it writes, in this process."""

from __future__ import annotations

import unittest
from pathlib import Path
from xml.etree import ElementTree

import pytest
import rostest
import rosunit
from rosunit import junitxml


class Cases(unittest.TestCase):
    __test__ = False  # not for pytest

    def test_a(self) -> None:
        print("out & <b> \x1b[1m é ]]>")

    def test_b(self) -> None:
        raise AssertionError("b < a & c")

    @unittest.expectedFailure
    def test_c(self) -> None:
        pass

    def test_d(self) -> None:
        for number in range(3):
            with self.subTest(number=number):
                assert number == 1

    @unittest.skip("not today")
    def test_e(self) -> None:
        pass


class Broken(unittest.TestCase):
    __test__ = False  # not for pytest

    @classmethod
    def setUpClass(cls) -> None:
        raise RuntimeError("no class")

    def test_never(self) -> None:
        pass


class Good(unittest.TestCase):
    __test__ = False  # not for pytest

    def test_it(self) -> None:
        pass


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("ROS_TEST_RESULTS_DIR", str(tmp_path))
    return tmp_path


def test_the_file(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loader = unittest.defaultTestLoader
    suite = unittest.TestSuite([loader.loadTestsFromTestCase(case) for case in (Cases, Broken)])
    result = rosunit.create_xml_runner("p", "t").run(suite)
    file = results / "p" / "rosunit-t.xml"
    root = ElementTree.parse(file).getroot()
    assert {key: root.get(key) for key in ("tests", "errors", "failures", "name")} == {
        "tests": "5",
        "errors": "1",
        "failures": "4",
        "name": "unittest.suite.TestSuite",
    }
    found = {case.get("name"): [child.tag for child in case] for case in root.iter("testcase")}
    assert found == {
        "test_a": [],
        "test_b": ["failure"],
        "test_c": ["failure"],
        "test_d": ["failure", "failure"],
        "test_e": ["skipped"],
        "setUpClass": ["error"],
    }
    assert root.findtext("system-out") == "<![CDATA[\nout & <b> &#x001B;[1m é ]]>\n\n]]>"
    printed = capsys.readouterr().out
    assert "[Testcase: test_b] ... FAILURE!\nFAILURE: b < a & c\n  File" in printed
    assert "(number=0): " in printed

    read = junitxml.read(str(file), "p/t")
    assert (read.num_tests, read.num_errors, read.num_failures) == (5, 1, 4)
    assert [case.name for case in read.test_case_results][:2] == ["p.rosunit-t/test_a", "p.rosunit-t/test_b"]
    assert read.test_case_results[1].failures[0].text.startswith("b < a & c\n")
    assert junitxml.read_all().num_tests == junitxml.read_all(["p"]).num_tests == 5
    assert junitxml.read_all(["q"]).num_tests == 0
    rosunit.print_runner_summary(result, read)
    assert "\x1b[1;31m * RESULT: FAIL\x1b[0m" in capsys.readouterr().out


def test_the_end(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert rosunit.unitrun("p", "good", Good, sysargs=[]) is None
    out = capsys.readouterr().out
    assert (
        "SUMMARY:\n\x1b[32m * RESULT: SUCCESS\x1b[0m\n * TESTS: 1\n * ERRORS: 0 []\n * FAILURES: 0 []\n"
        in out
    )
    with pytest.raises(SystemExit) as ended:
        rosunit.unitrun("p", "bad", Cases, sysargs=[])
    assert ended.value.code == 1
    assert " * RESULT: FAIL\n" in capsys.readouterr().out
    other = results / "other" / "o.xml"
    rosunit.unitrun("p", "good", f"{__name__}.Good", sysargs=[f"--gtest_output=xml:{other}"])
    assert other.is_file()
    rosunit.unitrun("p", "text", Good, sysargs=["--text"])
    assert not (results / "p" / "rosunit-text.xml").exists()
    with pytest.warns(DeprecationWarning, match="rosunit.unitrun"):
        rostest.unitrun("p", "good", Good, sysargs=[])


def test_names() -> None:
    assert rosunit.rostest_name_from_path("/a/b", "/a/b/test/x.test") == "test_x"
    assert rosunit.rostest_name_from_path("/a/b", "/a/b/c/x.y.test") == "c_x.y"
    assert rosunit.rostest_name_from_path("/a/b", "/a/x.test") == "_a_x"
    place = {"ROS_TEST_RESULTS_DIR": "/r"}
    assert rosunit.xml_results_file("p", "t", env=place) == "/r/p/rosunit-t.xml"
    assert rosunit.xml_results_file("p", "t", True, place) == "/r/p/rostest-t.xml"


def test_files_that_do_not_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert junitxml.read(tmp_path / "no.xml", "x").num_tests == 0
    file = tmp_path / "x.xml"
    for text in ("<testsuite", "<foo/>", '<testsuite tests="a"/>'):
        file.write_text(text)
        assert junitxml.read(file, "x").num_tests == 0
    out = capsys.readouterr().out
    assert out.count("WARN: cannot read test result file") == 4
    assert "test file does not exist" in out


def test_a_result_in_the_place_of_one() -> None:
    failed = ElementTree.fromstring(junitxml.test_failure_junit_xml("t", "why <x>", "said"))
    assert (failed.get("name"), failed.get("failures")) == ("t", "1")
    assert failed[0][0].get("message") == "why <x>"
    assert failed.findtext("system-out") == "<![CDATA[\nsaid\n]]>"
    assert ElementTree.fromstring(junitxml.test_success_junit_xml("t")).get("failures") == "0"
