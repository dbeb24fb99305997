"""The view Reconfigure in Debian's chromium, with servers of minirospy and Debian; its pure parts under node."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.interop.browser import PATIENCE, Page
from tests.interop.conftest import start, stop
from tests.interop.test_interop_dashboard import (
    address,
    browse,
    needs_chromium,
    needs_node,
    saved,
    serve,
)
from tests.interop.test_interop_foreign import FOREIGN
from tests.interop.test_interop_reconfigure import HERE, PYTHONS, dynparam, lines_until, modules
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "modules", "serve"]


def page_functions(*calls: tuple[str, str, list[object]]) -> list[Any]:
    """Return the results of functions in the page's modules."""
    done = subprocess.run(
        ["node", str(FOREIGN / "page_functions.mjs")],
        input="".join(json.dumps(call) + "\n" for call in calls),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@needs_node
def test_literals_of_python_are_read_and_not_executed() -> None:
    values: list[object] = [
        {"enum": [{"name": "Low", "value": -1, "type": "int", "description": 'it\'s "low"\n\u00fc\t\\'}]},
        [1, 2.5, True, False, None, "a", [], {}],
        {"a b": {"c": "d'e"}},
    ]
    texts = [repr(each) for each in values] + ["{u'a': (1, 2,), }", "1e3", "  'x'  "]
    bad = ["", "{", "[1", "__import__('os')", "{'a' 1}", "'a", "[1 2]", "1 2", "open", "{'a': f()}"]
    answers = page_functions(*(("reconfigure", "parseLiteral", [text]) for text in (*texts, *bad)))
    assert answers[: len(texts)] == [*values, {"a": [1, 2]}, 1000, "x"]
    assert all("error" in each for each in answers[len(texts) :]), answers[len(texts) :]


@needs_node
def test_saved_values_are_read_by_yaml_as_they_were() -> None:
    values: dict[str, object] = {
        "whole": 1.0, "small": 1e-7, "large": 1.5e300, "inf": float("inf"), "number": 3, "yes": True, "off": False,
        "text": "a b", "colon": "a: b", "number_text": "1.5", "true": "true", "empty": "", "path": "/a/b.c-d",
        "lines": "a\nb \u2028 \x7f \u00fc \U0001f422", "quotes": "'\"\\", "dash": "- a", "hash": "a #b",
        "null_text": "null", "date": "2026-01-01", "star": "*a", "tilde": "~",
    }  # fmt: skip
    types = {
        name: "double" if type(each) is float else {int: "int", bool: "bool"}.get(type(each), "str")
        for name, each in values.items()
    }
    # JSON has no infinity, so it is passed as a string that JavaScript's Number parses.
    parameters = {"map": [[name, {"type": type_}] for name, type_ in types.items()]}
    given = {"map": [[name, each] for name, each in values.items() if name != "inf"]}
    (text,) = page_functions(("reconfigure", "yamlOf", [parameters, given]))
    del values["inf"]
    found = yaml.safe_load(text)
    assert found == values
    assert {name: type(each) for name, each in found.items()} == {
        name: type(each) for name, each in values.items()
    }


@needs_node
def test_typed_values_are_converted_or_refused() -> None:
    def parameter(type_: str, *constants: object) -> dict[str, object]:
        return {"name": "p", "type": type_, "constants": list(constants)}

    low = {"name": "Low", "value": 4, "description": ""}
    good: list[tuple[object, object, object]] = [
        (parameter("int"), " 7 ", 7), (parameter("int"), -(2**31), -(2**31)), (parameter("double"), "1e-3", 0.001),
        (parameter("double"), "inf", "Infinity"), (parameter("double"), "-inf", "-Infinity"), (parameter("bool"), "Yes", True),
        (parameter("bool"), False, False), (parameter("str"), 5, "5"), (parameter("str"), " a ", " a "),
        (parameter("int", low), "low", 4), (parameter("int", low), 9, 9),
    ]  # fmt: skip
    bad = [("int", "1.5"), ("int", "x"), ("int", 2**31), ("int", ""), ("double", "1,5"), ("bool", "2")]
    answers = page_functions(
        *(("reconfigure", "converted", [each, given]) for each, given, _ in good),
        *(("reconfigure", "converted", [parameter(type_), given]) for type_, given in bad),
    )
    assert answers[: len(good)] == [expected for _, _, expected in good]
    assert all(each["error"].startswith("p: ") for each in answers[len(good) :]), answers


@pytest.fixture
def lamp(
    modules: dict[str, Path], serve: Callable[..., Served]
) -> Iterator[Callable[[str], tuple[Served, str, subprocess.Popen[str]]]]:
    """Return a function that starts a dashboard and a server of one stack, in one graph."""
    import os

    programs: list[subprocess.Popen[str]] = []

    def run(stack: str) -> tuple[Served, str, subprocess.Popen[str]]:
        served = serve()
        uri = os.environ["ROS_MASTER_URI"]
        programs.append(
            start(
                [PYTHONS[stack], str(HERE / "reconfigure_peer.py"), "serve", str(modules[stack])], uri, stack
            )
        )
        lines_until(programs[-1], "ready")
        return served, uri, programs[-1]

    yield run
    for program in programs:
        stop(program)


ROW = "[data-parameter='{}'] "


def wait_value(page: Page, name: str, value: str) -> None:
    find = json.dumps(ROW.format(name) + "input[type=text]")
    page.wait(f"return document.querySelector({find})?.value === {json.dumps(value)}")


def enter(page: Page, name: str, text: str) -> None:
    """Type a value, and move the focus to another element."""
    page.type(ROW.format(name) + "input[type=text]", text)
    page.wait("document.activeElement.blur(); return true")


@needs_chromium
@pytest.mark.parametrize("stack", ["ours", "rospy"])
def test_parameters_are_changed_and_corrected_by_the_server(
    stack: str, lamp: Callable[[str], Any], browse: Callable[..., Page]
) -> None:
    served, uri, program = lamp(stack)
    page = browse(address(served, "reconfigure"))
    # A note that no error follows vanishes after a time that a stall may exceed: such timers of the page never fire.
    page.evaluate(
        "((start) => { window.setTimeout = (call, ms, ...rest) => ms === 6000 ? 0 : start(call, ms, ...rest); })(setTimeout)"
    )
    # The only server is opened. Its name is also on the left, where the first click keeps it open.
    page.wait_text("button.server[aria-pressed=true]", "/lamp")
    page.click("button.server", "/lamp")
    page.wait("return location.hash.includes('node=')")
    page.wait_text("button.server[aria-pressed=true]", "/lamp")
    page.click("button.server", "/lamp")
    page.wait_text("button.server[aria-pressed=false]", "/lamp")
    page.click("button.server", "/lamp")
    wait_value(page, "angle", "100")
    assert "How bright it is" in page.wait_text(ROW.format("brightness"), "How")
    page.wait(
        f"return !document.querySelector({json.dumps(ROW.format('brightness') + 'input[type=range]')}).disabled"
    )

    # Limits, slider and field are on one line.
    control = json.dumps(ROW.format("power") + ".control")
    tops, bottoms = page.evaluate(
        "(boxes => [boxes.map(e => e.top), boxes.map(e => e.bottom)])"
        f"([...document.querySelector({control}).children].map(e => e.getBoundingClientRect()))"
    )
    assert len(tops) == 4
    assert max(tops) < min(bottoms)

    enter(page, "brightness", "0.25")
    lines_until(program, "callback 1")
    enter(page, "power", "1000")
    wait_value(page, "power", "60")
    page.wait_text(".note", "The server has set power: 60 instead of 1000")
    enter(page, "power", "lots")
    page.wait_text(".note.error", 'power: "lots" is not a number')
    page.choose(ROW.format("mode") + "select", "2")
    # The callback also corrects the brightness.
    wait_value(page, "brightness", "0.75")
    page.click(ROW.format("is_on") + "input")
    lines_until(program, "callback 16")
    enter(page, "label", "<b>bright</b>")
    lines_until(program, "callback 0")

    # Move the slider with keys.
    page.evaluate(f"document.querySelector({json.dumps(ROW.format('power') + 'input[type=range]')}).focus()")
    for kind in ("rawKeyDown", "keyUp"):
        page.call(
            "Input.dispatchKeyEvent", type=kind, key="ArrowLeft", code="ArrowLeft", windowsVirtualKeyCode=37
        )
    wait_value(page, "power", "59")

    # A change by another client is shown.
    assert dynparam("ours", uri, "set", "/lamp", "power", "7")[1] == 0
    wait_value(page, "power", "7")
    found = eval(dynparam("ours", uri, "get", "/lamp")[0])
    assert (found["label"], found["is_on"], found["mode"]) == ("<b>bright</b>", False, 2)


@needs_chromium
def test_groups_are_tabs_boxes_and_folds(lamp: Callable[[str], Any], browse: Callable[..., Page]) -> None:
    served, uri, program = lamp("ours")
    page = browse(address(served, "reconfigure?node=/lamp"))
    page.wait_text("[role=tab]", "Color_Choice")
    page.choose(ROW.format("color") + "select", "1")
    lines_until(program, "callback 64")
    # The inner group is folded, as determined by the server's state.
    fold = "[data-group=inner] button.fold"
    page.wait(f"return document.querySelector({json.dumps(fold)})?.ariaExpanded === 'false'")
    assert not page.evaluate(
        f"document.querySelector({json.dumps(ROW.format('hue'))}).getClientRects().length"
    )
    page.click(fold)
    page.wait(f"return document.querySelector({json.dumps(ROW.format('hue'))}).getClientRects().length")
    page.wait_text(ROW.format("noise"), "Whether it hums")

    def inner() -> object:
        found = eval(dynparam("ours", uri, "get", "/lamp")[0])
        return found["groups"]["groups"]["Color_Choice"]["groups"]["inner"]["state"]

    while not inner():  # the request has not arrived yet
        pass


@needs_chromium
@pytest.mark.parametrize("stack", ["ours", "rospy"])
def test_values_are_saved_and_loaded_by_the_page_and_by_dynparam(
    stack: str, lamp: Callable[[str], Any], browse: Callable[..., Page], tmp_path: Path
) -> None:
    served, uri, _ = lamp(stack)
    page = browse(address(served, "reconfigure?node=/lamp"))
    wait_value(page, "power", "0")
    file = tmp_path / "lamp.yaml"
    text = saved(page, tmp_path, file.name, "Save")
    assert yaml.safe_load(text)["label"] == "from the parameter server"
    assert dynparam("ours", uri, "set", "/lamp", "{'power': 9, 'label': other}")[1] == 0
    wait_value(page, "power", "9")
    # Debian's dynparam loads the file that the page saved.
    assert dynparam("rospy", uri, "load", "/lamp", str(file)) == ("", 0)
    wait_value(page, "power", "0")
    wait_value(page, "label", "from the parameter server")

    # The page loads a file that Debian's dynparam (or rqt_reconfigure) saved.
    assert dynparam("ours", uri, "set", "/lamp", "{'power': 11, 'label': \"it's\"}")[1] == 0
    assert dynparam("rospy", uri, "dump", "/lamp", str(file))[1] == 0
    assert "python/object" in file.read_text(encoding="utf-8")
    assert dynparam("ours", uri, "set", "/lamp", "power", "1")[1] == 0
    wait_value(page, "power", "1")
    load(page, file)
    wait_value(page, "power", "11")
    wait_value(page, "label", "it's")

    file.write_text("power: 12\nwattage: 3\n")
    load(page, file)
    wait_value(page, "power", "12")
    enter(page, "power", "13")
    page.wait_text(".note.error", "The server refuses power")
    file.write_text("wattage: 3\n")
    load(page, file)
    page.wait_text(".note.error", "none of its names is a parameter of /lamp")
    file.write_text("{")
    load(page, file)
    page.wait_text(".note.error", "lamp.yaml: not YAML")
    page.click("button", "Defaults")
    wait_value(page, "power", "20")


def load(page: Page, file: Path) -> None:
    """Choose a file, as in the browser's dialog."""
    document = page.call("DOM.getDocument")["root"]["nodeId"]
    found = page.call("DOM.querySelector", nodeId=document, selector="input[type=file]")["nodeId"]
    page.call("DOM.setFileInputFiles", files=[str(file)], nodeId=found)


@needs_chromium
def test_reader_sees_values_and_a_server_that_leaves_is_marked(
    lamp: Callable[[str], Any], browse: Callable[..., Page], serve: Callable[..., Served]
) -> None:
    from minirospy.web.access import Access

    _, _, program = lamp("ours")
    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    page = browse(address(served, "reconfigure?node=/lamp&token=read-token-00"))
    wait_value(page, "angle", "100")
    page.wait_text(".note", "read-only")
    assert page.evaluate(
        "[...document.querySelectorAll('.config input, .config select')].every(each => each.disabled)"
    )
    stop(program)
    page.wait_text(".note.error", "This server has left.")
