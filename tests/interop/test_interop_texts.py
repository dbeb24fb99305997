"""Translations, keys, and names for screen readers: the page in Debian's chromium, operated with the keyboard only."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseWithCovariance
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool

import minirospy.web.dashboard
from minirospy.web.dashboard.views import VIEWS
from tests.interop.browser import Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher
from tests.interop.test_interop_reconfigure_page import page_functions
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

RVIZ_NAMES = {"3d", "simulation"}
"""The views with a 3D scene: the names of RViz's displays and settings, and of quantities, are not translated."""

PAGE = Path(minirospy.web.dashboard.__file__).parent / "page"

SETTINGS = {
    "plot": "?path=/button_state/data",
    "layout": "?tree=row(topics,console)",
    "topics": "?open=/button_state",
    "panels": "?edit=1&p=kind%3Dlamp%26path%3D%252Fbutton_state",
    "publish": "?topic=/button_state",
}


@needs_node
def test_language_is_the_chosen_one_else_the_first_of_the_browser_that_is_there() -> None:
    body = """
      const cases = [[null, ["fr-CH", "de-AT", "en"]], ["en", ["de"]], ["xx", []], ["de", []]];
      const found = cases.map(([wanted, offered]) => {
        chooseLanguage(wanted, offered);
        return t("Pause");
      });
      return [...found, t("Pause {none}", { count: 1 }),
        t("{count} of {all} topics", { count: 1, all: "<b>" }), t("constructor")];
    """
    assert run_script("chooseLanguage, t", "js/texts.js", body) == [
        "Anhalten", "Pause", "Pause", "Anhalten", "Pause {none}", "1 von <b> Topics", "constructor",
    ]  # fmt: skip


@pytest.mark.parametrize("module", ["form.js", "paths.js", "reconfigure.js", "ros1.js", "widgets.js"])
def test_every_error_of_a_person_has_a_german_text(module: str) -> None:
    """These errors are for invalid user input; each is thrown as a TextError or through t()."""
    text = (PAGE / "js" / module).read_text(encoding="utf-8")
    german = (PAGE / "js" / "german.js").read_text(encoding="utf-8")
    assert re.findall(r"new Error\((?!t\()", text) == []
    thrown = re.findall(r"""Error\(\s*(?:t\(\s*)?("(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')""", text)
    assert thrown
    assert [each for each in thrown if not re.search(re.escape(each) + r":\s", german)] == []


def speak_german(page: Page) -> None:
    page.evaluate("localStorage.setItem('language', 'de')")
    page.reload()
    page.wait("return document.documentElement.lang === 'de'")
    page.wait_text("#state", "verbunden")


def fill_graph(served: Served) -> None:
    """Publish messages that the views show."""
    served.run(publisher(served, "/button_state", Bool, latch=True).publish(True))
    line = Log(level=4, name="/talker", msg="Pause", file="a.py", function="f")
    served.run(publisher(served, "/rosout_agg", Log, latch=True).publish(line))


@needs_chromium
def test_views_have_no_text_without_its_german_one(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    fill_graph(served)
    page = browse(address(served, "topics"))
    page.wait_text("#state", "connected")
    speak_german(page)
    page.evaluate("import('/js/texts.js').then(module => { window.missing = module.watchMissing(); })")
    for view in sorted({*VIEWS} - RVIZ_NAMES):
        page.evaluate(f"location.hash = '#/{view}{SETTINGS.get(view, '')}'")
        page.wait(f"return document.getElementById('view').dataset.view === '{view}'")
        page.wait("return document.getElementById('view').children.length > 0")
        # Let a view's data from the graph arrive before opening the next view; the test does not depend on it.
        page.evaluate("new Promise(resolve => setTimeout(resolve, 300))")
    missing = [each for each in page.evaluate("[...window.missing]") if not each.startswith("/")]
    names = {"\u00d7", "←", "→", "✎", "?", ", .", "1 2", "/", "x", "y", "theta", "GPIO 2", "RViz"}
    data = (
        "/talker_",
        "LED GPIO",
        "std_msgs/",
        "rosgraph_msgs/",
        "geometry_msgs/",
        "minirospy",
        "W A S D",
        ".bag, ",
        ".mcap, ",
    )
    left = [each for each in missing if each not in names and not any(word in each for word in data)]
    assert left == [], json.dumps(left)


@needs_chromium
def test_errors_of_forms_and_joints_are_in_german(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    publisher(served, "/where", PoseWithCovariance)
    page = browse(address(served, "publish?topic=/where"))
    page.wait_text("#state", "connected")
    speak_german(page)
    page.type("input[name=covariance]", "[1]")
    page.click("button", "Einmal senden")
    page.wait_text(".error", "covariance: 1 statt 36 Werte")
    page.evaluate("location.hash = '#/joints'")
    page.wait_text(".empty", "Der Parameter robot_description fehlt")


@needs_chromium
def test_language_is_switched_and_kept_and_data_stay_as_they_are(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    fill_graph(served)
    page = browse(address(served, "console"))
    page.wait_text(".line .text", "Pause")
    page.wait_text(".line .word", "Warn")
    page.click("#language")
    page.wait_text("#tabs", "Konsole")
    page.wait_text("main button", "Anhalten")
    page.wait_text("main .bar", "1 von 1 Zeilen")
    page.wait_text(".line .word", "Warnung")
    # A log line is data and is not translated.
    assert page.wait_text(".line .text", "") == "Pause"
    assert page.evaluate("document.title") == "Konsole · minirospy"
    page.reload()
    page.wait_text("#state", "verbunden")
    page.click("#language")
    page.wait_text("#tabs", "Console")


def press_key(page: Page, key: str, code: int, text: str = "") -> None:
    pressed = "keyDown" if text else "rawKeyDown"
    for kind, typed in ((pressed, text), ("keyUp", "")):
        page.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, text=typed)


FOCUSED = """(() => { const e = document.activeElement;
  const name = e.id || e.dataset.view || e.getAttribute('aria-label') || e.textContent.trim();
  return [name, e.matches(':focus-visible'), getComputedStyle(e).outlineStyle]; })()"""


@needs_chromium
def test_tab_goes_through_the_page_in_the_order_that_is_seen(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "parameters"))
    page.wait_text("#state", "connected")
    page.evaluate("document.activeElement.blur()")
    seen = []
    groups = ["Look", "Drive", "System · Parameters", "Files"]
    for _ in range(len(VIEWS) + len(groups) + 10):
        press_key(page, "Tab", 9)
        name, is_visible, outline = page.evaluate(FOCUSED)
        assert is_visible, name
        assert outline != "none", name
        seen.append(name)
    # A group's menu opens when its button has the focus.
    menus = page.evaluate(
        "[...document.querySelectorAll('.views')].flatMap(group =>"
        " [group.firstChild.textContent, ...[...group.querySelectorAll('a')].map(each => each.dataset.view)])"
    )
    assert [each for each in menus if each not in VIEWS] == groups
    assert sorted(each for each in menus if each in VIEWS) == sorted(VIEWS)
    shell = ["skip", "minirospy", *menus, "find", "language", "help", "theme"]
    assert seen[: len(shell)] == shell
    assert seen[len(shell) :][0] == "Filter"
    assert seen[-1] in ("Set", "Its value", "Name of a new parameter")


@needs_chromium
def test_keys_of_the_page_show_help_and_other_views(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    press_key(page, "?", 191, "?")
    page.wait_text("dialog.help", "The view before and after this one")
    page.wait_text("dialog.help", "3D: the tools, in the order of their buttons")
    page.click("dialog.help button", "Close")
    page.wait("return !document.querySelector('dialog')")
    following = VIEWS[VIEWS.index("topics") + 1]
    press_key(page, ".", 190, ".")
    page.wait(f"return document.getElementById('view').dataset.view === '{following}'")
    press_key(page, ",", 188, ",")
    page.wait("return document.getElementById('view').dataset.view === 'topics'")
    press_key(page, "/", 191, "/")
    page.wait("return document.activeElement.type === 'search'")
    # In an input field, keys are text input.
    page.call("Input.insertText", text="a")
    press_key(page, ".", 190, ".")
    assert page.evaluate("document.activeElement.value") == "a."
    page.evaluate("document.activeElement.blur()")
    page.evaluate("document.getElementById('skip').focus()")
    press_key(page, "Enter", 13, "\r")
    page.wait("return document.activeElement.id === 'view'")


NAMELESS = """[...document.querySelectorAll(
    'a[href], button, input, select, textarea, [tabindex="0"], [role=button], [role=img],'
    + ' #view svg:not([aria-hidden]), #view canvas:not([aria-hidden])')]
  .filter(e => !e.closest('[aria-hidden], .uplot, .insets'))
  .filter(e => e.getClientRects().length)
  .filter(e => !(e.getAttribute('aria-label') || e.title || e.labels?.length || e.placeholder
    || (!/INPUT|SELECT/.test(e.tagName) && e.textContent.trim())))
  .map(e => e.outerHTML.slice(0, 150))"""


@needs_chromium
@pytest.mark.parametrize("view", VIEWS)
def test_whatever_can_be_used_has_a_name_for_screen_readers(
    serve: Callable[..., Served], browse: Callable[..., Page], view: str
) -> None:
    served = serve()
    fill_graph(served)
    page = browse(address(served, view + SETTINGS.get(view, "")))
    page.wait_text("#state", "connected")
    page.wait(f"return document.getElementById('view').dataset.view === '{view}'")
    page.evaluate("new Promise(resolve => setTimeout(resolve, 300))")
    found: Any = page.evaluate(NAMELESS)
    assert found == [], json.dumps(found)
    # The page's heading is the view's name; a form is not a list item.
    title = page.evaluate("document.title").partition(" · ")[0]
    assert page.evaluate("[...document.querySelectorAll('h1')].map(e => e.textContent)") == [title]
    assert page.evaluate("document.querySelectorAll('form[role]').length") == 0


@needs_node
def test_quoted_text_does_not_change_the_direction_around_it() -> None:
    text = 'a"\u202eb\u2067\u200f\u05d0'
    (found,) = page_functions(("dom", "quoted", [text]))
    assert found == '"a\\"\\u202eb\\u2067\\u200f\u05d0"'
    assert json.loads(found) == text


@needs_chromium
def test_views_are_in_groups_and_found_by_typing(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/button_state", Bool, latch=True).publish(True))
    page = browse(address(served, "topics"))
    page.wait_text("#state", "connected")
    page.wait_text("nav .current", "Look · Topics")
    page.wait_text(".topic", "/button_state")

    page.click("nav .views:has(a[data-view='bag']) > button", "Files")
    page.click("nav a[data-view='bag']", "Bags")
    page.wait_text("nav .current", "Files · Bags")
    page.wait(
        "return getComputedStyle(document.querySelector('a[data-view=bag]').parentElement).display === 'none'"
    )

    for kind in ("rawKeyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=kind, key="k", windowsVirtualKeyCode=75, modifiers=2)
    page.type("dialog.palette input", "butt")
    page.wait_text(".palette li[aria-selected=true]", "/button_state")
    press_key(page, "Enter", 13, "\r")
    page.wait_text("nav .current", "Look · Topics")
    assert page.evaluate("location.hash") == "#/topics?open=%2Fbutton_state"
    page.click("#find")
    page.type("dialog.palette input", "nothing like this")
    page.wait_text(".palette .none", "Nothing has this name.")
    press_key(page, "Escape", 27)
    page.wait("return !document.querySelector('dialog.palette')")
