"""Layouts of the dashboard: their text form under node, and panes in chromium, operated as by a user."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist, Vector3

from minirospy.base.errors import MasterUnreachableError, RpcError
from minirospy.board.board import Board
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.web.dashboard.views import LAYOUTS, VIEWS
from tests.interop.browser import PATIENCE, Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import (
    address,
    browse,
    is_zero,
    listener,
    logger,
    needs_chromium,
    press,
    publisher,
    saved,
)
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

LAYOUT = "js/layout.js"


# --- the text of a layout


@needs_node
@pytest.mark.parametrize(
    ("text", "tidy"),
    [
        ("", ""),
        ("plot", "plot"),
        ("row(plot?path=%2Fa%2Fb,board)", "row(plot?path=%2Fa%2Fb,board)"),
        ("row(2:board,2:plot)", "row(board,plot)"),
        ("row(3:board,1:column(plot,console))", "row(75:board,25:column(plot,console))"),
        # A row with one element is that element; a row within a row is flattened.
        ("row(column(plot))", "plot"),
        ("row(1:board,1:row(plot,console))", "row(50:board,25:plot,25:console)"),
    ],
)
def test_layout_text_is_read_and_written(text: str, tidy: str) -> None:
    assert run_script("Layout", LAYOUT, f"return Layout.parse({json.dumps(text)}).toString()") == tidy


@needs_node
@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("row(", '"" is not a view of a layout'),
        ("row(plot", 'a ")" is missing in the layout'),
        ("plot)", '")" is not expected in a layout'),
        ("pile(plot)", '"pile(" in a layout is neither row( nor column('),
        ("<img src=x>", '"<img src=x>" is not a view of a layout'),
        (f"row({','.join(['plot'] * 25)})", "a layout has 24 views at most"),
        ("row(" * 9000, "the layout is too long"),
    ],
)
def test_layout_text_that_is_wrong_is_refused_with_the_reason(text: str, why: str) -> None:
    body = f"try {{ Layout.parse({json.dumps(text)}); return ''; }} catch (error) {{ return error.message; }}"
    assert run_script("Layout", LAYOUT, body) == why


@needs_node
def test_panes_are_added_moved_resized_and_removed() -> None:
    body = """
      const layout = Layout.parse("row(board,plot)");
      const seen = () => layout.toString();
      const steps = [];
      const [board, plot] = layout.panes();
      const console_ = layout.add("console", "", "bottom", plot); steps.push(seen());
      layout.add("graph", "", "right", null); steps.push(seen());
      layout.move(console_, "left", board); steps.push(seen());
      layout.move(console_, "center", plot); steps.push(seen());
      layout.move(board, "top", null); steps.push(seen());
      layout.resize(layout.root, 0, 0.25); steps.push(seen());
      layout.resize(layout.root, 0, 7); steps.push(seen());
      for (const pane of layout.panes().slice(1)) layout.remove(pane); steps.push(seen());
      layout.move(board, "left", null); steps.push(seen());
      layout.remove(board); steps.push(seen());
      return steps;
    """
    assert run_script("Layout", LAYOUT, body) == [
        "row(board,column(plot,console))",
        "row(25:board,25:column(plot,console),50:graph)",
        "row(13:console,13:board,25:plot,50:graph)",
        "row(13:plot,13:board,25:console,50:graph)",
        "column(board,row(14:plot,29:console,57:graph))",
        "column(25:board,75:row(14:plot,29:console,57:graph))",
        "column(95:board,5:row(14:plot,29:console,57:graph))",
        "board",
        "board",
        "",
    ]


@needs_node
def test_side_of_a_pane_is_the_nearest_edge() -> None:
    body = (
        "return [sideAt(0.1, 0.5), sideAt(0.9, 0.5), sideAt(0.5, 0.1), sideAt(0.4, 0.95), sideAt(0.5, 0.5)]"
    )
    assert run_script("sideAt", LAYOUT, body) == ["left", "right", "top", "bottom", "center"]


@needs_node
def test_presets_have_views_of_the_page() -> None:
    presets = run_script("PRESETS", "js/presets.js", "return PRESETS")
    assert tuple(presets) == LAYOUTS
    for name, (_, _, text) in presets.items():
        if text is None:
            continue
        body = f"return Layout.parse({json.dumps(text)}).panes().map(pane => pane.view)"
        assert set(run_script("Layout", LAYOUT, body)) <= set(VIEWS), name


@needs_node
def test_classroom_is_made_of_boards_and_robots() -> None:
    topics = [
        "/rosout",
        "/red/cmd_vel",
        "/red/odom",
        "/blue/button_state",
        "/green/scan",
        "/deep/er/cmd_vel",
        "/tf",
    ]
    body = f"return classroom({{ boards: ['a', 'b c'], topics: {json.dumps(topics)} }})"
    assert run_script("classroom", "js/presets.js", body) == (
        "column(class,row(board?board=a,board?board=b+c),"
        "row(plot?path=%2Fblue%2Fbutton_state&window=30,topics?filter=%2Fgreen%2F),row(teleop?topic=%2Fred%2Fcmd_vel),console)"
    )
    assert (
        run_script("classroom", "js/presets.js", "return classroom({ boards: [], topics: [] })")
        == "column(class,row(board,console))"
    )


CLASS = {
    "/minirospy_class/ben/student": "Ben",
    "/minirospy_class/ben/exercises/move_light/passed": False,
    "/minirospy_class/ben/exercises/move_light/ever": False,
    "/minirospy_class/ben/exercises/move_light/number": 6,
    "/minirospy_class/ben/exercises/move_light/failures": ["The LED lights: it stays dark"],
    "/minirospy_class/anna/student": "<b>Anna</b>",
    "/minirospy_class/anna/exercises/count/passed": False,
    "/minirospy_class/anna/exercises/count/ever": True,
    "/minirospy_class/anna/exercises/count/number": 2,
    "/minirospy_class/anna/now/leds": "000001",
    "/minirospy_class/anna/now/buttons": "00",
    "/minirospy_class/anna/now/nodes": ["/my_led", "/my_button"],
    "/minirospy_class/anna/now/beat": 1,
    "/minirospy_class/hostile/now/leds": "<img>",
    "/minirospy_class/hostile/exercises/__proto__/passed": True,
    "/minirospy_class/hostile/student": 5,
    "/minirospy_class/bad name/student": "x",
    "/robot/name": "Rosie",
}
"""What students' computers set at the class's master, and what a hostile node may set."""


@needs_node
def test_class_is_read_from_parameters() -> None:
    body = f"""
      const {{ exercises, students }} = classTable(new Map(Object.entries({json.dumps(CLASS)})));
      return [exercises, students.map((s) => [s.name, Object.fromEntries(s.results), s.leds, s.nodes.length])];
    """
    exercises, students = run_script("classTable", "js/classroom.js", body)
    assert exercises == ["count", "move_light", "__proto__"]
    dark = {"passed": False, "ever": False, "time": 0, "failures": ["The LED lights: it stays dark"]}
    assert students[:2] == [
        ["<b>Anna</b>", {"count": {"passed": False, "ever": True, "time": 0, "failures": []}}, "000001", 2],
        ["Ben", {"move_light": dark}, "", 0],
    ]
    assert [name for name, *_ in students] == ["<b>Anna</b>", "Ben", "hostile"]


@needs_node
def test_addresses_keep_settings_that_are_not_empty() -> None:
    body = """
      const { view, words } = addressOf("#/plot?path=/a?b&path=%2Fc");
      return [view, words.getAll("path"),
        fragmentOf("plot", { path: ["/a", "/b"], window: "", paused: true, off: false }), fragmentOf("topics", {})];
    """
    assert run_script("addressOf, fragmentOf", "js/address.js", body) == [
        "plot",
        ["/a?b", "/c"],
        "#/plot?path=%2Fa&path=%2Fb&paused=1",
        "#/topics",
    ]


# --- the page


def opened(
    serve: Callable[..., Served], browse: Callable[..., Page], tree: str, **options: Any
) -> tuple[Served, Page]:
    served = serve()
    page = browse(address(served, f"layout?tree={tree}"), **options)
    page.wait_text("#state", "connected")
    return served, page


def tree_of(page: Page) -> str:
    """Return the layout in the URL as text."""
    return str(page.evaluate("new URLSearchParams(location.hash.split('?')[1]).get('tree')"))


def wait_tree(page: Page, tree: str) -> None:
    page.wait(f"return new URLSearchParams(location.hash.split('?')[1]).get('tree') === {json.dumps(tree)}")


def pane(view: str) -> str:
    """Return the selector of a view's pane."""
    return f".pane:has([data-view='{view}'])"


def middle(page: Page, find: str, right: float = 0.5, down: float = 0.5) -> tuple[float, float]:
    x, y = page.wait(
        f"const r = document.querySelector({json.dumps(find)}).getBoundingClientRect();"
        f"return r.width && [r.x + r.width * {right}, r.y + r.height * {down}]"
    )
    return x, y


def drag(page: Page, start: tuple[float, float], *through: tuple[float, float]) -> None:
    """Press the mouse at a point, move it through others, and release it at the last one."""
    points = [
        ("mousePressed", start),
        *(("mouseMoved", point) for point in through),
        ("mouseReleased", through[-1]),
    ]
    for kind, (x, y) in points:
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)


@needs_chromium
def test_workshop_shows_the_pressed_button_in_its_plot(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    from std_msgs.msg import Bool

    served = serve()
    button = publisher(served, "/button_state", Bool, latch=True)
    served.run(button.publish(False))
    with Board() as board:
        page = browse(address(served, "layout?preset=workshop"), width=1400, height=900)
        page.wait_text(f"{pane('plot')} .series .num", "0")
        page.wait(f'return document.querySelector("{pane("graph")} svg.graph .node")')
        edges = board.watch([11], timeout=PATIENCE)
        page.press(".push[data-pin='11']")
        assert next(edges).level == 1
        served.run(button.publish(True))
        page.wait_text(f"{pane('plot')} .series .num", "1")
        page.release(".push[data-pin='11']")
        assert next(edges).level == 0
    assert page.evaluate("document.querySelectorAll('.pane').length") == 4
    # There is only the divider between the panes.
    upper, lower = page.evaluate(
        "[...document.querySelectorAll('.box.column > .pane')].slice(0, 2).map(e => e.getBoundingClientRect().toJSON())"
    )
    assert lower["top"] - upper["bottom"] < 12
    # The URL names the preset until the layout is changed.
    assert page.evaluate("location.hash") == "#/layout?preset=workshop"


@needs_chromium
def test_pane_is_split_replaced_maximised_and_closed(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    _, page = opened(serve, browse, "row(topics,console)")
    page.click(f"{pane('console')} button[title^='Split: another view below']")
    wait_tree(page, "row(topics,column(console,console))")
    page.choose(".pane.active select.pane-view", "parameters")
    wait_tree(page, "row(topics,column(console,parameters))")
    page.click(f"{pane('parameters')} button[title=Maximise]")
    page.wait(
        f'const r = document.querySelector("{pane("parameters")}").getBoundingClientRect();'
        "const d = document.querySelector('.dock').getBoundingClientRect();"
        "return Math.abs(r.width - d.width) < 2 && Math.abs(r.height - d.height) < 2"
    )
    assert page.evaluate("document.querySelectorAll('.pane[inert]').length") == 2
    page.click(f"{pane('parameters')} button[title=Maximise]")
    page.wait("return !document.querySelector('.pane[inert]')")
    page.click(f"{pane('topics')} button[title='Close this pane']")
    wait_tree(page, "column(console,parameters)")
    for view in ("console", "parameters"):
        page.click(f"{pane(view)} button[title='Close this pane']")
    page.wait_text("button.start", "Workshop")
    page.click("button.start", "Teleop")
    page.wait_text("select.pane-view", "Teleop")


@needs_chromium
def test_pane_is_docked_by_dragging_its_head(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    _, page = opened(serve, browse, "row(topics,column(console,parameters))")
    about = f"{pane('parameters')} .pane-about"
    head = middle(page, about)
    target = middle(page, pane("topics"), 0.5, 0.9)
    page.evaluate(f'document.querySelector("{pane("parameters")}").isOld = true')
    drag(page, head, (head[0] - 20, head[1]), target)
    wait_tree(page, "row(column(topics,parameters),console)")
    # The pane was moved, not rebuilt.
    assert page.evaluate(f'document.querySelector("{pane("parameters")}").isOld')
    head = middle(page, f"{pane('console')} .pane-about")
    drag(page, head, (head[0] - 20, head[1]), middle(page, pane("topics")))
    wait_tree(page, "row(column(console,parameters),topics)")
    # Drag the pane to the edge of the whole layout.
    head = middle(page, f"{pane('topics')} .pane-about")
    left, top = middle(page, ".dock", 0.3, 0.0)
    drag(page, head, (head[0] - 20, head[1]), (left, top + 4))
    wait_tree(page, "column(50:topics,25:console,25:parameters)")
    # The key swaps the pane with the next one.
    page.evaluate(f'document.querySelector("{pane("topics")} .pane-grip").focus()')
    press(page, "rawKeyDown", "ArrowDown")
    wait_tree(page, "column(50:console,25:topics,25:parameters)")
    press(page, "rawKeyDown", "ArrowDown")
    wait_tree(page, "column(50:console,25:parameters,25:topics)")


@needs_chromium
def test_panes_are_resized_by_mouse_and_keys_and_kept(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    _, page = opened(serve, browse, "row(topics,console)")
    start = middle(page, ".divider")
    left, _ = middle(page, ".dock", 0.25)
    drag(page, start, (start[0] - 10, start[1]), (left, start[1]))
    page.wait(
        "return /row\\(2[3-7]:topics,7[3-7]:console\\)/.test(new URLSearchParams(location.hash.split('?')[1]).get('tree'))"
    )
    before = tree_of(page)
    page.evaluate("document.querySelector('.divider').focus()")
    press(page, "rawKeyDown", "ArrowRight")
    page.wait(f"return new URLSearchParams(location.hash.split('?')[1]).get('tree') !== {json.dumps(before)}")
    kept = tree_of(page)
    page.reload()
    page.wait_text("select.pane-view", "Console")
    assert tree_of(page) == kept
    page.wait(
        "const [a, b] = [...document.querySelectorAll('.pane')].map(e => e.offsetWidth); return a < b * 0.55"
    )


@needs_chromium
def test_views_work_twice_on_one_page(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    moving = publisher(served, "/odometry", Vector3, latch=True)
    served.run(moving.publish(1.0, 2.0, 3.0))
    log = logger(served)
    log((2, "/first", "hello"))
    plots = ",".join(f"plot?path=%252Fodometry%252F{axis}" for axis in "xy")
    tree = f"row(column({plots}),column(console,console?levels=8),column(graph,graph?mode=all))"
    page = browse(address(served, f"layout?tree={tree}"), width=1500, height=900)
    page.wait_text(".pane[data-pane='1'] .series .num", "1")
    page.wait_text(".pane[data-pane='2'] .series .num", "2")
    page.wait_text(".pane[data-pane='3'] .bar", "1 of 1 lines")
    log((8, "/second", "broken"))
    page.wait_text(".pane[data-pane='3'] .bar", "2 of 2 lines")
    page.wait_text(".pane[data-pane='4'] .bar", "1 of 2 lines")
    log((8, "/second", "again"))
    page.wait_text(".pane[data-pane='3'] .bar", "3 of 3 lines")
    page.wait_text(".pane[data-pane='4'] .bar", "2 of 3 lines")
    # Clearing one view clears both.
    page.click(".pane[data-pane='4'] button", "Clear")
    page.wait_text(".pane[data-pane='3'] .bar", "0 of 0 lines")
    ids = page.evaluate("[...document.querySelectorAll('[id]')].map(e => e.id)")
    assert len(ids) == len(set(ids))
    page.wait("return document.querySelectorAll(\".pane[data-pane='6'] .edge\").length >= 1")
    # Closing one pane leaves the other unchanged.
    page.click(".pane[data-pane='1'] button[title='Close this pane']")
    served.run(moving.publish(1.0, 7.0, 3.0))
    page.wait_text(".pane[data-pane='2'] .series .num", "7")


@needs_chromium
def test_link_in_a_pane_is_followed_inside_of_the_layout(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/odometry", Vector3, latch=True).publish(1.5, 2.5, 3.0))
    page = browse(address(served, "layout?tree=topics?open=%252Fodometry"), width=1400)
    page.click("a.plot[title='Plot /odometry/x']")
    page.wait_text(f"{pane('plot')} .series .num", "1.5")
    # An existing plot receives the next series.
    plotted = f"{pane('plot')} .series[data-label='/odometry/y'] .num"
    page.click("a.plot[title='Plot /odometry/y']")
    page.wait_text(plotted, "2.5")
    wait_tree(page, "row(topics?open=%2Fodometry,plot?path=%2Fodometry%2Fx&path=%2Fodometry%2Fy)")


@needs_chromium
def test_keys_drive_the_active_pane_alone(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    left, right = (listener(served, f"/{side}/cmd_vel", f"{side}_robot") for side in ("left", "right"))
    page = browse(
        address(
            served, "layout?tree=row(teleop?topic=%252Fleft%252Fcmd_vel,teleop?topic=%252Fright%252Fcmd_vel)"
        )
    )
    page.wait_text("#state", "connected")
    page.click(".pane[data-pane='2'] .pane-about")
    press(page, "rawKeyDown", "ArrowUp")
    right(lambda twist: twist.linear.x == 0.5)
    assert "stopped" in page.wait_text(".pane[data-pane='1'] p[role=status]", "")
    press(page, "keyUp", "ArrowUp")
    right(is_zero)
    page.click(".pane[data-pane='1'] .pane-about")
    press(page, "rawKeyDown", "ArrowUp")
    left(lambda twist: twist.linear.x == 0.5)
    # Closing a pane stops the robot that it drives.
    page.click(".pane[data-pane='1'] button[title='Close this pane']")
    left(is_zero)


@needs_chromium
def test_layout_is_saved_by_name_exported_imported_and_shared(
    serve: Callable[..., Served], browse: Callable[..., Page], tmp_path: Path
) -> None:
    _, page = opened(serve, browse, "row(topics,parameters?filter=robot)")
    page.type("input.layout-name", "my robot")
    page.click(".layout-bar button", "Save")
    page.wait_text(".layout-bar", "Saved in this browser.")
    exported = json.loads(saved(page, tmp_path, "my robot.json", "Export"))
    assert exported == {
        "minirospy layout": 1,
        "name": "my robot",
        "layout": "row(topics,parameters?filter=robot)",
    }
    link = page.evaluate("location.href")
    # Open the layout from the list, as on a later visit.
    page.evaluate("location.hash = '#/layout'")
    page.wait_text("button.start", "my robot")
    page.choose("select[aria-label=Layout]", "saved my robot")
    page.wait("return document.querySelector('input[type=search]')?.getClientRects().length")
    wait_tree(page, "row(topics,parameters?filter=robot)")
    page.click(".layout-bar button", "Delete")
    page.wait_text(".layout-bar", "my robot is deleted.")
    # Load a file; if it is broken, the error names it.
    broken = tmp_path / "broken.json"
    broken.write_text('{"minirospy layout": 1, "layout": "row("}', encoding="utf-8")
    for name in (broken, tmp_path / "my robot.json"):
        root = page.call("DOM.getDocument")["root"]["nodeId"]
        node = page.call("DOM.querySelector", nodeId=root, selector="input[type=file]")["nodeId"]
        page.call("DOM.setFileInputFiles", nodeId=node, files=[str(name)])
        if name is broken:
            page.wait_text(".layout-bar .error", "broken.json: ")
            page.evaluate("location.hash = '#/layout'")
            page.wait_text("button.start", "Workshop")
    page.wait_text("select.pane-view", "Parameters")
    # The link opens the same layout in another browser.
    other = browse(link)
    other.wait("return document.querySelectorAll('.pane').length === 2")
    assert (
        other.evaluate("document.querySelector('[data-view=parameters] input[type=search]').value") == "robot"
    )


@needs_chromium
def test_classroom_shows_the_boards_side_by_side(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    publisher(served, "/red/cmd_vel", Twist)
    with contextlib.ExitStack() as stack:
        boards = [stack.enter_context(Board(name)) for name in ("anna", "ben")]
        page = browse(address(served, "topics"), width=1400, height=900)
        page.wait("return document.querySelector(\".row[data-topic='/red/cmd_vel']\")")
        # The page looks for boards for three seconds: let these last, however slow the machine is.
        page.evaluate(
            "{ const later = window.setTimeout;"
            "window.setTimeout = (run, ms, ...words) => later(run, ms === 3000 ? 3_600_000 : ms, ...words);"
            "location.hash = '#/layout?preset=classroom'; }"
        )
        page.wait_text(".pane-about", "/red/cmd_vel")
        # The board fits into its pane.
        page.wait(
            "return [...document.querySelectorAll('.pane-body svg.board')].every(e =>"
            " e.getBoundingClientRect().bottom <= e.closest('.pane').getBoundingClientRect().bottom)"
        )
        for board in boards:
            board.set(7, 1)
            page.wait(
                "return [...document.querySelectorAll('.pane:has([data-view=board])')].some(e =>"
                f" e.querySelector('select[aria-label=Board]').value === '{board.name}'"
                " && e.querySelector('.lit[aria-label=\"LED GPIO 7 red on\"]'))"
            )


@contextlib.contextmanager
def beats(*students: str) -> Iterator[None]:
    """Send a new beat of these students each second: the page hides a board without one, however slow the machine is."""
    has_ended = threading.Event()

    def send() -> None:
        with contextlib.closing(MasterProxy(os.environ["ROS_MASTER_URI"], "/beats")) as master:
            for beat in itertools.count(1):
                for student in students:
                    with contextlib.suppress(MasterUnreachableError, RpcError):  # the next beat comes soon
                        master.set_param(f"/minirospy_class/{student}/now/beat", beat)
                if has_ended.wait(1):
                    return

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        has_ended.set()
        thread.join()


@needs_chromium
def test_class_on_a_phone_shows_all_exercises_and_the_names_while_it_scrolls(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    with contextlib.closing(MasterProxy(os.environ["ROS_MASTER_URI"], "/students")) as master:
        exercises = {f"exercise_{number}": {"passed": True, "ever": True} for number in range(6)}
        master.set_param("/minirospy_class/anna", {"student": "Anna", "exercises": exercises})
        page = browse(address(served, "class"), width=390, height=844)
        page.wait("return document.querySelectorAll('.class-table .class-yes').length === 6")
        # Each result is visible, and in one line.
        heights = page.evaluate(
            "[...document.querySelectorAll('.class-yes')].map(e => {"
            " const range = document.createRange(); range.selectNodeContents(e); return range.getClientRects().length; })"
        )
        assert heights == [1] * 6
        page.evaluate("document.querySelector('main .scroll').scrollLeft = 1000")
        left = "{}.getBoundingClientRect().left"
        name = left.format("document.querySelector('.class-table tbody th')")
        last = left.format("document.querySelector('.class-yes:last-child')")
        page.wait(f"return {last} < 390 && {name} >= 0")


@needs_chromium
def test_classroom_shows_the_exercises_of_each_student(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    master = MasterProxy(os.environ["ROS_MASTER_URI"], "/students")
    with contextlib.closing(master), beats("anna", "ben"):
        for name, value in CLASS.items():
            if " " not in name:
                master.set_param(name, value)
        page = browse(address(served, "layout?preset=classroom"), width=1400, height=900)
        page.wait_text(".class-table th[scope=row]", "<b>Anna</b>")
        page.wait_text(".class-table .class-yes", "passed")
        page.wait_text(".class-table .class-no", "not yet")
        page.wait_text(".class-failures li", "The LED lights: it stays dark")
        # The board of a student is shown until there has been no beat for ten seconds.
        page.wait("return document.querySelectorAll('.class-led.red').length === 1")
        # The buttons of a shared board are live. Ben's computer has sent none.
        page.wait_text(".class-table tr:has(.class-no) td .muted", "0 nodes")
        page.wait(
            "return document.querySelectorAll('.class-button').length === 2"
            " && !document.querySelector('.class-button.pressed')"
        )
        master.set_param("/minirospy_class/anna/now/buttons", "01")
        page.wait("return document.querySelector('[aria-label=\"pressed: GPIO 12\"] .class-button.pressed')")
        # The next result is shown at once, and nothing on this page acts on a student's computer.
        master.set_param("/minirospy_class/ben/exercises/move_light/ever", True)
        page.wait("return document.querySelectorAll('.class-yes').length >= 2")
        assert page.evaluate("document.querySelectorAll('[data-view=class] button').length") == 0


@needs_chromium
@pytest.mark.parametrize("text", ["<img src=x onerror=alert(1)>", "row(plot", "nothing(plot)"])
def test_layout_that_cannot_be_read_is_named_as_text(
    serve: Callable[..., Served], browse: Callable[..., Page], text: str
) -> None:
    from urllib.parse import quote

    served = serve()
    page = browse(address(served, f"layout?tree={quote(text)}"))
    page.wait_text(".layout-bar .error", "layout")
    assert page.evaluate("document.querySelectorAll('main img').length") == 0


@needs_chromium
def test_view_that_the_page_does_not_have_is_named(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    _, page = opened(serve, browse, "row(hologram,topics)")
    page.wait_text(".pane", "This page has no such view.")
    page.choose(".pane[data-pane='1'] select.pane-view", "console")
    wait_tree(page, "row(console,topics)")


@needs_chromium
def test_layout_on_a_phone_is_one_column(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    _, page = opened(serve, browse, "row(board,column(console,plot))", width=360, height=700)
    page.wait("return document.querySelectorAll('.pane').length === 3")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    tops = page.evaluate(
        "[...document.querySelectorAll('.pane')].map(e => Math.round(e.getBoundingClientRect().top))"
    )
    assert tops == sorted(tops)
    assert len(set(tops)) == 3
