"""Plot in Debian's chromium: derivatives, averages, and one series over another; the computations under node."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Callable
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped, Vector3
from rospy import Time

from minirospy.web.dashboard.files import FOLDER
from tests.interop.browser import PATIENCE, Page
from tests.interop.page_modules import run_script
from tests.interop.test_interop_aio import until
from tests.interop.test_interop_dashboard import (
    address,
    browse,
    needs_chromium,
    needs_node,
    publisher,
    serve,
)
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "serve"]

JS = (FOLDER / "js").as_uri()


def evaluated(expression: str) -> Any:
    """Return the result of an expression of derived.js and samples.js under node; NaN becomes null."""
    script = (
        f"import {{ Samples }} from '{JS}/samples.js'; import {{ derivedOf, pairs, rangeOf }} from '{JS}/derived.js';"
        "const of = (times, values) => { const made = new Samples(); made.append(times, values); return made; };"
        f"console.log(JSON.stringify({expression}));"
    )
    done = subprocess.run(
        ["node", "--input-type=module", "-e", script],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@needs_node
def test_derivative_is_the_slope_from_point_to_point_in_any_parts() -> None:
    times, values = [0, 1, 1.5, 1.5, 3.5], [1, 3, 2, 7, 6]
    whole = evaluated(f"[...derivedOf('derivative').append({times}, {values})]")
    assert whole == [None, 2, -2, None, 2]
    parts = evaluated(
        "(d => [...d.append([0, 1], [1, 3]), ...d.append([1.5], [2]), ...d.append([1.5, 3.5], [7, 6])])(derivedOf('derivative'))"
    )
    assert parts == whole


@needs_node
def test_derivative_uses_header_stamps_if_present() -> None:
    assert evaluated(
        "[...derivedOf('derivative').append([0, 5, 5, 5.1], [0, 1, 2, 4], [10, 10.5, 11, 12])]"
    ) == [
        None,
        2,
        2,
        2,
    ]
    # If a bag is played again, its stamps go back.
    assert evaluated("[...derivedOf('derivative').append([0, 1, 2, 3], [0, 1, 5, 7], [8, 9, 1, 2])]") == [
        None,
        1,
        None,
        2,
    ]
    # The first points have no value. They are kept with the other points, also when the buffer grows and the oldest
    # are dropped.
    points = evaluated(
        "(made => { made.append([1, 2], [0, 0]); made.append(new Float64Array(2000).fill(3), new Float64Array(2000),"
        " new Float64Array(2000).fill(7)); made.append([4], [0]); const all = [...made.stamps.subarray(0, made.count)];"
        " made.drop(2001); return [all, [...made.stamps.subarray(0, made.count)]]; })(of([0], [0]))"
    )
    assert points == [[0, 1, 2, *[7] * 2000, 4], [7, 7, 4]]


@needs_node
def test_stamp_of_a_message_is_that_of_its_header() -> None:
    body = """return [{ header: { stamp: { secs: 2, nsecs: 5e8 } } }, { header: { stamp: { secs: 0, nsecs: 0 } } }, {},
      { header: "a" }, { header: { stamp: 4 } }].map(stampOf);"""
    assert run_script("stampOf", "js/paths.js", body) == [2.5, 0, 0, 0, 0]


@needs_chromium
def test_derivative_of_messages_that_come_in_batches_has_no_spikes(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    talker = publisher(served, "/where", PointStamped, queue_size=None)
    page = browse(address(served, "plot?path=/where/point/x&show=derivative%20/where/point/x"))

    async def batch(first: int) -> None:
        for number in range(first, first + 20):
            message = PointStamped()
            message.header.stamp = Time(100, number * 10_000_000)
            message.point.x = 0.5 * number
            await talker.publish(message)

    served.run(until(lambda: talker.num_connections == 1))
    for first in (0, 20):
        served.run(batch(first))
        page.wait_text(".series .count", str(first + 20))
    page.wait_text(".series .num", "50")
    # Change the kind and back: all points are recomputed.
    for kind in ("", "derivative"):
        page.choose(".series select", kind)
    page.wait_text(".series .num", "50")
    texts = page.evaluate(
        "new Promise(resolve => { URL.createObjectURL = blob => { blob.text().then(resolve); return ''; };"
        "[...document.querySelectorAll('button')].find(e => e.textContent === 'CSV').click(); })"
    )
    slopes = [float(line.split(",")[1] or "nan") for line in texts.splitlines()[1:]]
    assert len(slopes) > 2
    assert slopes[1:] == pytest.approx([50] * (len(slopes) - 1)), texts


@needs_node
def test_average_is_that_of_the_last_seconds() -> None:
    found = evaluated("[...derivedOf('average1').append([0, 0.5, 1, 1.5, 9], [2, 4, NaN, 8, 1])]")
    assert found == [2, 3, 3, 6, 1]
    # Rounding errors do not accumulate over many points.
    long = evaluated(
        "(d => { const n = 50000; const t = Float64Array.from({length: n}, (_, i) => i / 100);"
        "const v = t.map((x) => 1e9 + Math.sin(x)); return d.append(t, v)[n - 1]; })(derivedOf('average1'))"
    )
    last = [1e9 + math.sin(i / 100) for i in range(49_899, 50_000)]
    assert long == pytest.approx(sum(last) / len(last), abs=1e-4)
    assert evaluated("derivedOf('') ?? derivedOf('other') ?? 'none'") == "none"


@needs_node
def test_series_over_another_takes_its_newest_value_of_the_moment() -> None:
    assert evaluated("pairs(of([0, 1, 2], [10, 11, 12]), of([0, 0.5, 2, 3], [1, 2, 3, 4]), 0, 3, 100)") == [
        [10, 10, 12, 12],
        [1, 2, 3, 4],
    ]
    assert evaluated("pairs(of([1], [5]), of([0, 1], [1, 2]), 0, 3, 100)") == [[5], [2]]
    xs, ys = evaluated(
        "(n => { const t = Array.from({length: n}, (_, i) => i); return pairs(of(t, t), of(t, t), 0, n, 100); })(1000)"
    )
    assert len(xs) == 100
    assert (xs[-1], ys[-1]) == (999, 999)
    assert evaluated("[rangeOf([[0, 10], [5]]), rangeOf([[]]), rangeOf([[2]])]") == [
        [-0.5, 10.5],
        [0, 1],
        [1.8, 2.2],
    ]


def selected(path: str) -> dict[str, float]:
    """Return the values by label for a path in a message with markers, or the error's text."""
    body = f"""
      const markers = [["goal", 1, 0.5], ["goal", 2, 1.5], ["base", 2, 2.5]].map(([ns, id, x], index) => (
        {{ ns, id, on: index > 0, stamp: {{ secs: index, nsecs: 0 }}, pose: {{ x }} }}));
      const found = {{}};
      try {{
        select({{ markers }}, parseSteps({path!r}), (label, number) => {{ found[label] = number; }});
      }} catch (error) {{ return {{ [error.message]: 0 }}; }}
      return found;"""
    answer: dict[str, float] = run_script("parseSteps, select", "js/paths.js", body)
    return answer


@needs_node
def test_filters_of_a_path_choose_elements() -> None:
    assert selected("/markers[:]{id==2}/pose/x") == {"/markers[:]{id==2}/pose/x": 2.5}
    both = '/markers[:]{ns=="goal"}{id >= 2}/pose/x'
    assert selected(both) == {both: 1.5}
    assert list(selected("/markers[:]{ns=='base'}.pose.x").values()) == [2.5]
    assert list(selected("/markers[0]{on==false}/id").values()) == [1]
    assert list(selected("/markers[1]{pose.x>1}{pose/x<2}{stamp==1}/id").values()) == [2]
    assert list(selected("/markers[2:]{ns!=goal}/id").values()) == [2]
    assert selected("/markers[:]{missing==1}/id") == selected("/markers[:]{ns<5}/id") == {}
    assert list(selected("/markers[:]{id=2}/id")) == [
        '"{id=2}/id" is not a field, nor an index, nor a filter as {id==1}'
    ]


@needs_node
def test_path_is_compared_with_the_type_of_its_topic() -> None:
    body = r"""
      const { parseDefinition } = await import(%s);
      const definition = parseDefinition("p/T", "time stamp\nstring name\nfloat64[] list\nP[] points\nE empty\nuint8[3] bytes\n"
        + "=".repeat(80) + "\nMSG: p/P\nint32 x\n" + "=".repeat(80) + "\nMSG: p/E\n");
      const good = ["", "/stamp", "/stamp/secs", "/list", "/list[0]", "/list[1:]", "/points[:]{x>1}/x",
        "/points[0]", "/bytes[-1]"];
      const bad = ["/other", "/name", "/stamp/other", "/stamp[0]", "/list/x", "/list[0][0]", "/points",
        "/points/x", "/points[0]/y", "/empty"];
      return [good, bad].map(paths => paths.map(path => canLead(definition, parseSteps(path))));"""
    good, bad = run_script("canLead, parseSteps", "js/paths.js", body % json.dumps(f"{JS}/ros1.js"))
    assert good == [True] * 9
    assert bad == [False] * 10


@needs_chromium
def test_path_that_is_wrong_is_refused_before_a_message_comes(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    publisher(served, "/path", Vector3)
    page = browse(address(served, "plot?path=/path/x"))
    page.wait_text(".series-missing .muted", "waiting for /path/x")
    syntax = '" is not a field, nor an index, nor a filter as {id==1}'
    for path, why in {
        "/topic/rubbish[": f'"[{syntax}',
        "/path/x[0": f'"[0{syntax}',
        "/late/": f'"/{syntax}',
        "/path/rubbish": "no number there; there is /path/x, /path/y, /path/z",
    }.items():
        page.type("form input", path)
        page.click("form button", "Plot")
        page.wait_text(".series-missing .error", f"{path}: {why}")
    # A valid path that does not exist yet is pending.
    page.type("form input", "/late[0:5]{a==1}.b/c")
    page.click("form button", "Plot")
    page.wait_text(".series-missing .muted", "waiting for /late[0:5]{a==1}.b/c")
    assert page.evaluate("document.querySelectorAll('.series-missing .error').length") == 4


@needs_node
def test_topic_of_a_filtered_path_is_found() -> None:
    body = "return [topicOf('/a{on==true}/x', ['/a', '/a/b']), topicOf('/a/b[:]{id==1}/x', ['/a', '/a/b'])];"
    assert run_script("topicOf", "js/paths.js", body) == ["/a", "/a/b"]


@needs_chromium
def test_field_is_dragged_from_the_topics_to_a_plot(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/path", Vector3, latch=True, queue_size=None).publish(8.0, 5.0, 0.0))
    page = browse(address(served, "layout?tree=row(topics?open=%252Fpath,plot)"), width=1400)
    page.wait_text("a.plot[title='Plot /path/y']", "plot")
    page.wait_text(".pane .chart", "or drag the field here")
    page.evaluate("""
      (() => {
        const dataTransfer = new DataTransfer();
        const send = (element, kind) =>
          element.dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }));
        send(document.querySelector("a.plot[title='Plot /path/y']").closest("[draggable=true]"), "dragstart");
        const place = document.querySelector(".chart");
        if (send(place, "dragover")) throw new Error("the plot takes nothing");
        send(place, "drop");
      })()""")
    page.wait_text(".series[data-label='/path/y'] .num", "5")


@needs_chromium
def test_series_is_shown_as_its_derivative_and_average(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    moving = publisher(served, "/path", Vector3, latch=True, queue_size=None)
    served.run(moving.publish(8.0, 5.0, 0.0))
    page = browse(address(served, "plot?path=/path/x&path=/path/y&show=average10+/path/y"))
    page.wait_text(".series[data-label='/path/x']", "1 points")
    page.wait(
        "return document.querySelector(\"select[aria-label='How /path/y is shown']\").value === 'average10'"
    )

    served.run(moving.publish(4.0, 7.0, 0.0))
    page.wait_text(".series[data-label='/path/y']", "2 points")
    page.wait_text(".series[data-label='/path/y'] .num", "6")
    page.choose("select[aria-label='How /path/x is shown']", "derivative")
    page.wait("return Number(document.querySelector(\".series[data-label='/path/x'] .num\").textContent) < 0")
    assert "show=derivative" in page.evaluate("location.hash")
    page.choose("select[aria-label='How /path/x is shown']", "")
    page.wait_text(".series[data-label='/path/x'] .num", "4")
    page.click("button", "Clear")
    page.wait_text(".series[data-label='/path/x']", "0 points")


@needs_chromium
def test_series_is_drawn_over_another(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    moving = publisher(served, "/path", Vector3, latch=True, queue_size=None)
    served.run(moving.publish(0.0, 0.0, 0.0))
    page = browse(address(served, "plot?path=/path/x&path=/path/y&window=all"))
    page.wait_text(".series[data-label='/path/y']", "1 points")

    async def circle() -> None:
        for number in range(1, 200):
            angle = number / 100 * math.pi
            await moving.publish(math.cos(angle), math.sin(angle), 0.0)

    served.run(circle())
    page.wait_text(".series[data-label='/path/y']", "200 points")
    page.choose("select[aria-label='The x axis']", "/path/x")
    assert "x=%2Fpath%2Fx" in page.evaluate("location.hash")
    # The circle extends to the left and right of its middle, and above and below it.
    drawn = (
        "(c => { const g = c.getContext('2d'), w = c.width, h = c.height; const has = (x, y, a, b) => "
        "[...g.getImageData(x * w, y * h, a * w, b * h).data].some((v, i, d) => i % 4 === 0 && d[i + 3] && "
        "Math.abs(d[i] - 0xe4) + Math.abs(d[i + 1] - 0x57) + Math.abs(d[i + 2] - 0x2e) < 60);"
        "return has(0.05, 0.3, 0.2, 0.3) && has(0.8, 0.3, 0.2, 0.3) && has(0.4, 0, 0.3, 0.25) && has(0.4, 0.7, 0.3, 0.2)"
        " && !has(0.45, 0.25, 0.02, 0.02); })(document.querySelector('.chart canvas'))"
    )
    page.wait(f"return {drawn}")
    page.choose("select[aria-label='The x axis']", "")
    page.wait(f"return !({drawn})")
    page.reload()
    page.wait("return document.querySelector('.series')")


HEIGHT_OF = """(() => { const c = document.querySelector('.chart canvas'), wanted = %s, rows = [];
  const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  const o = document.querySelector('.u-over').getBoundingClientRect(), at = c.getBoundingClientRect();
  for (let y = Math.round(o.top - at.top); y < o.bottom - at.top; y++)
    for (let x = Math.round(o.left - at.left) + 2; x < o.right - at.left; x++)
      if (wanted.every((v, i) => Math.abs(v - d[4 * (y * c.width + x) + i]) < 40)) rows.push((o.bottom - at.top - y) / o.height);
  return rows.length ? rows.reduce((a, b) => a + b) / rows.length : null; })()"""
"""The average height of the points of a color: 0 at the lower edge of the chart, 1 at the upper one."""
COLORS = {"x": [0x2F, 0x7E, 0xD8], "y": [0xE4, 0x57, 0x2E], "z": [0x2A, 0x9D, 0x5C]}


def middle(page: Page, number: int) -> tuple[float, float]:
    """Return the position of a y axis's labels; ``number`` counts the axes in use from 0."""
    x, y = page.evaluate(
        "(r => [r.x + r.width / 2, r.y + r.height / 2])"
        f"(document.querySelectorAll('.u-axis.scaled')[{number}].getBoundingClientRect())"
    )
    return x, y


def press_key(page: Page, key: str) -> None:
    for kind in ("rawKeyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=kind, key=key)


@needs_chromium
def test_series_have_axes_of_their_own_that_are_kept_in_the_address(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    moving = publisher(served, "/path", Vector3, latch=True, queue_size=None)

    async def publish() -> None:
        for number in range(50):
            await moving.publish(number / 50, 1000.0 + number, -5.0)

    page = browse(address(served, "plot?path=/path/x&path=/path/y&path=/path/z&window=all"))
    page.wait_text("#state", "connected")
    served.run(moving.wait_for_subscribers(1))
    served.run(publish())
    page.wait_text(".series[data-label='/path/z'] .num", "-5")
    page.wait("return document.querySelectorAll('.u-axis.scaled').length === 1")
    for field, axis in (("y", "2"), ("z", "5")):
        page.choose(f"select[aria-label='Axis of /path/{field}']", axis)
    page.wait("return document.querySelectorAll('.u-axis.scaled').length === 3")
    page.click("button", "Y axes")
    page.type("input[aria-label='axis 2, right: label, unit']", "mm")
    page.type("input[aria-label='axis 5, left: from']", "-10")
    page.type("input[aria-label='axis 5, left: to']", "0")
    page.evaluate("document.activeElement.blur()")
    page.wait("return location.hash.includes('range=5+-10+0') && location.hash.includes('label=2+mm')")
    page.wait(f"return Math.abs({HEIGHT_OF % COLORS['z']} - 0.5) < 0.05")

    # The same link shows the same plot in another page, also before a message has arrived.
    page.reload()
    assert "range=5+-10+0" in page.evaluate("location.hash")
    assert "axis=2+%2Fpath%2Fy" in page.evaluate("location.hash")
    page.wait("return document.querySelectorAll('.u-axis.scaled').length === 3")
    page.wait(f"return Math.abs({HEIGHT_OF % COLORS['z']} - 0.5) < 0.05")
    page.click("button", "Y axes")
    shown = "document.querySelector(\"[aria-label='%s']\").value"
    assert page.evaluate(shown % "axis 2, right: label, unit") == "mm"
    assert page.evaluate(shown % "Axis of /path/y") == "2"
    page.click("button", "Auto range")
    page.wait("return !location.hash.includes('range=')")


@needs_chromium
def test_axis_is_zoomed_and_panned_alone_by_the_wheel_and_by_dragging(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    moving = publisher(served, "/path", Vector3, latch=True, queue_size=None)

    async def publish() -> None:
        for number in range(50):
            await moving.publish(0.0, 10.0 + number % 2, 0.0)

    words = "plot?path=/path/x&path=/path/y&axis=2+/path/y&range=1+-1+1&range=2+0+21&window=all"
    page = browse(address(served, words))
    page.wait_text("#state", "connected")
    served.run(moving.wait_for_subscribers(1))
    served.run(publish())
    page.wait(f"return Math.abs({HEIGHT_OF % COLORS['y']} - 0.5) < 0.05")
    x, y = middle(page, 1)
    page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-400)
    page.wait("return /range=2.[1-9]/.test(location.hash)")
    assert "range=1+-1+1" in page.evaluate("location.hash")
    for kind, down in (("mouseMoved", 0), ("mousePressed", 0), ("mouseMoved", 60), ("mouseReleased", 60)):
        page.call(
            "Input.dispatchMouseEvent", type=kind, x=x, y=y + down, button="left", buttons=1, clickCount=1
        )
    # The axis follows the drag downwards, while the other axis stays.
    page.wait(f"return {HEIGHT_OF % COLORS['y']} < 0.4")
    page.wait(f"return Math.abs({HEIGHT_OF % COLORS['x']} - 0.5) < 0.05")
    for count in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=count)
    page.wait("return !location.hash.includes('range=2') && location.hash.includes('range=1')")
    page.wait(f"return Math.abs({HEIGHT_OF % COLORS['y']} - 0.5) < 0.1")


@needs_chromium
def test_chart_is_panned_and_zoomed_by_keys_and_fingers(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/path", Vector3, latch=True, queue_size=None).publish(1.0, 2.0, 3.0))
    page = browse(address(served, "plot?path=/path/x"))
    page.wait_text(".series[data-label='/path/x']", "1 points")
    follow = "[...document.querySelectorAll('button')].find(e => e.textContent === 'Follow')"
    shown = f"{follow}.checkVisibility({{visibilityProperty: true}})"
    assert not page.evaluate(shown)
    for key in ("-", "ArrowLeft"):
        page.evaluate("document.querySelector('.chart').focus()")
        press_key(page, key)
        page.wait(f"return {shown}")
        press_key(page, "Escape")
        page.wait(f"return !{shown}")
    # One finger pans, two fingers zoom.
    x, y = page.evaluate(
        "(r => [r.x + r.width / 2, r.y + 50])(document.querySelector('.u-over').getBoundingClientRect())"
    )
    for start, end in (([(x, y)], [(x - 90, y)]), ([(x - 20, y), (x + 20, y)], [(x - 120, y), (x + 120, y)])):
        for kind, points in (("touchStart", start), ("touchMove", end), ("touchEnd", [])):
            at = [{"x": each, "y": down, "id": number} for number, (each, down) in enumerate(points)]
            page.call("Input.dispatchTouchEvent", type=kind, touchPoints=at)
        page.wait(f"return {shown}")
        page.click("button", "Follow")
        page.wait(f"return !{shown}")


@needs_chromium
def test_buttons_of_the_plot_keep_their_places_when_follow_comes_and_goes(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/path", Vector3, latch=True, queue_size=None).publish(1.0, 2.0, 3.0))
    page = browse(address(served, "plot?path=/path/x&range=1+0+2"))
    page.wait_text(".series[data-label='/path/x']", "1 points")
    place = "[...document.querySelectorAll('button')].find(e => e.textContent === 'Clear').getBoundingClientRect().x"
    before = page.evaluate(place)
    page.evaluate("document.querySelector('.chart').focus()")
    press_key(page, "-")
    page.wait("return !document.querySelector('.keeps-place').classList.contains('unused')")
    assert page.evaluate(place) == before
    page.click("button", "Auto range")
    page.click("button", "Follow")
    page.wait("return document.querySelectorAll('.keeps-place.unused').length === 2")
    assert page.evaluate(place) == before


@needs_chromium
def test_path_that_leads_to_no_number_is_reported_in_german(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/path", Vector3, latch=True, queue_size=None).publish(1.0, 2.0, 3.0))
    page = browse(address(served, "topics"))
    page.evaluate("localStorage.setItem('language', 'de')")
    page.open(address(served, "plot?path=/path/nope&path=/path["))
    page.reload()
    page.wait_text(".series-missing", "dort ist keine Zahl; es gibt /path/x, /path/y, /path/z")
    page.wait_text("main", "„[“ ist kein Feld, kein Index und kein Filter wie {id==1}")
