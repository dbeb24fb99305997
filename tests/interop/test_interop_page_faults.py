"""Faults that must not affect other parts of the page: views that fail, lost connections, and late responses."""

from __future__ import annotations

import json
from collections.abc import Callable

from minirospy.introspect.values import parse_value
from minirospy.web.dashboard.files import FOLDER
from tests.interop.browser import Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.interop.test_interop_reconfigure_page import page_functions
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

FAKE_SOCKET = """
globalThis.WebSocket = class {
  static OPEN = 1;
  constructor() { this.readyState = 0; this.sent = []; globalThis.socket = this; }
  send(text) { this.sent.push(text); }
  close() { this.readyState = 3; this.onclose?.(); }
};
const link = { address: () => "", protocols: () => [] };
"""


@needs_node
def test_click_while_a_endpoint_is_not_connected_is_reported_not_lost_in_silence() -> None:
    found = run_script(
        "Endpoint",
        "js/endpoint.js",
        f"""{FAKE_SOCKET}
        const said = [];
        const endpoint = new Endpoint(link, "x", {{ error: (text) => said.push(text) }});
        endpoint.send({{ op: "start" }});
        const early = said.length;
        socket.readyState = 1;
        endpoint.send({{ op: "start" }});
        const sent = socket.sent.length;
        endpoint.close();
        endpoint.send({{ op: "start" }});
        return {{ early, sent, said }};""",
    )
    assert found["early"] == 1
    assert found["sent"] == 1
    assert found["said"] == ["Not connected: this was not done. Try again in a moment."]


@needs_node
def test_request_that_is_too_long_for_the_server_is_answered() -> None:
    found = run_script(
        "Tools",
        "js/tools.js",
        f"""{FAKE_SOCKET}
        const tools = new Tools(link);
        const why = await tools.request({{ do: "yaml", text: "x".repeat(250_000) }}).catch((error) => error.message);
        return [why, tools.answers.size, tools.waiting.length];""",
    )
    assert found == ["it is too large", 0, 0]


@needs_node
def test_rate_is_unknown_of_one_message_and_does_not_count_the_first() -> None:
    found = run_script(
        "Rate",
        "js/rates.js",
        """const latched = new Rate();
        latched.add(0, 1, 460);
        const steady = new Rate();
        for (let index = 0; index <= 10; index++) steady.add(index / 10, 1, 50);
        return [latched.at(0.6), latched.at(9), steady.at(1)];""",
    )
    assert found == [None, None, {"hz": 10, "bytes": 500}]


@needs_node
def test_values_that_a_type_does_not_hold_are_refused_with_their_fields() -> None:
    found = run_script(
        "encode, parseDefinition",
        "js/ros1.js",
        r"""const definition = parseDefinition("p/T", "uint8 small\nint64 large\nfloat32 real\nbool on\ntime stamp\nstring name\n"
          + "P[] points\n" + "=".repeat(80) + "\nMSG: p/P\nfloat64 x\n");
        const attempt = (value) => { try { return encode(definition, value).length; } catch (error) { return error.message; } };
        return [{ small: 300 }, { small: 1.5 }, { small: null }, { large: 2n ** 63n }, { real: 1e39 },
          { real: Infinity, large: -5 }, { on: "false" }, { name: 3 }, { stamp: { secs: -2, nsecs: 0 } },
          { points: [{ x: 1 }, { y: 2 }] }, { points: [[1]] }].map(attempt);""",
    )
    assert found == [
        "small: 300 does not fit into uint8", "small: 1.5 is not a whole number", "small: null is not a value",
        "large: 9223372036854775808 does not fit into int64", "real: 1e+39 does not fit into float32", 30,
        "on: neither true nor false", "name: not a text", "stamp: -2 does not fit into uint32",
        "points[1].y: there is no such field; there is x", "points[0]: not an object",
    ]  # fmt: skip


@needs_node
def test_message_with_a_field_called_length_is_encoded() -> None:
    found = run_script(
        "encode, decode, parseDefinition",
        "js/ros1.js",
        """const text = "float64 length\\nP[] parts\\n" + "=".repeat(80) + "\\nMSG: p/P\\nint32 length\\n";
        const definition = parseDefinition("p/T", text);
        return decode(definition, encode(definition, { length: 1.5, parts: [{ length: 2 }] }));""",
    )
    assert found == {"length": 1.5, "parts": [{"length": 2}]}


@needs_node
def test_parameter_is_shown_as_text_that_is_read_as_the_same_value() -> None:
    values: list[object] = [
        1e-7, [1e-7, -2.5e-9, 1e21, 3], {"gain": 1e-9, "1e5": "1e-7"}, "1e-7", 'a"1e5\\', "yes", True,
        ["a\u2028b", "\x7f\x9f\u0085", "\ufeff"],
    ]  # fmt: skip
    texts = page_functions(*(("views/parameters", "textOf", [value]) for value in values))
    assert [parse_value(text) for text in texts] == values

    doubles = [2.0, -3.0, 1e20, 1e21, 0.5, [1.0, 2.5, -1e-9]]
    types = ["float64"] * 5 + ["float64_array"]
    texts = page_functions(
        *(("views/parameters", "textOf", [*each]) for each in zip(doubles, types, strict=True))
    )
    assert [repr(parse_value(text)) for text in texts] == [repr(each) for each in doubles]


@needs_node
def test_message_with_a_field_called_length_is_not_shown_as_an_array() -> None:
    rod = {"length": 4_000_000_000, "name": "a"}
    found = page_functions(
        ("dom", "shown", [rod]),
        ("views/services", "yaml", [{"rod": rod}]),
        ("widgets", "valueAt", [{"rod": {"length": 3}}, ["rod"]]),
        ("widgets", "valueAt", [{"rod": rod}, ["rod", {"from": 0, "to": 2}]]),
    )
    assert found == ["{length: 4000000000, name: a}", 'rod:\n  length: 4000000000\n  name: "a"', 3, None]
    points = run_script(
        "select, parseSteps",
        "js/paths.js",
        f"""const points = [];
        const found = (label, number) => points.push([label, number]);
        for (const path of ["", "/length", "[0]"]) select({rod}, parseSteps(path), found);
        return points;""",
    )
    assert points == [["/length", 4_000_000_000], ["/length", 4_000_000_000]]


@needs_node
def test_errors_of_the_codec_are_in_the_language_of_the_page() -> None:
    found = run_script(
        "chooseLanguage, errorText",
        "js/texts.js",
        rf"""const {{ encode, parseDefinition }} = await import({json.dumps((FOLDER / "js/ros1.js").as_uri())});
        chooseLanguage("de");
        const definition = parseDefinition("p/T", "uint8 small\nfloat64[2] pair\ntime stamp\nbool on\nstring name\n");
        const attempt = (value) => {{ try {{ return encode(definition, value); }} catch (error) {{ return errorText(error); }} }};
        return [...[{{ small: 300 }}, {{ small: 1.5 }}, {{ small: null }}, {{ small: "a" }}, {{ pair: [1] }}, {{ pair: 1 }},
          {{ stamp: 5 }}, {{ on: "a" }}, {{ name: 3 }}, {{ other: 1 }}, [1]].map(attempt), errorText(new Error("{{name}}"))];""",
    )
    assert found == [
        "small: 300 passt nicht in uint8", "small: 1.5 ist keine ganze Zahl", "small: null ist kein Wert", "small: keine Zahl",
        "pair: 1 statt 2 Werte", "pair: keine Liste",
        "stamp: nicht {secs, nsecs}", "on: weder true noch false", "name: kein Text",
        "other: dieses Feld gibt es nicht; es gibt small, pair, stamp, on, name", "p/T: kein Objekt", "{name}",
    ]  # fmt: skip


DOCK = """(async () => {
  const [{ Dock }, { Layout }] = await Promise.all([import("/js/dock.js"), import("/js/layout.js")]);
  window.endedViews = [];
  const view = (name, fails = "") => class {
    constructor(link, words, main) { if (fails === "open") throw new Error(`${name} cannot be made`); main.append(name); }
    close() { window.endedViews.push(name); if (fails === "close") throw new Error(`${name} cannot be closed`); }
  };
  const views = { a: ["A", view("a", "close")], b: ["B", view("b")], c: ["C", view("c", "open")] };
  const place = document.createElement("div");
  place.style.height = "400px";
  document.body.append(place);
  window.reported = [];
  addEventListener("error", (event) => { window.reported.push(event.message); event.preventDefault(); });
  const dock = new Dock({}, Layout.parse("row(a,b,c)"), views, () => {});
  place.append(dock.element);
  const text = place.innerText;
  dock.close();
  return { text, closed: window.endedViews, reported: window.reported };
})()"""


@needs_chromium
def test_view_that_fails_leaves_the_other_views_of_a_layout_alone(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    found = page.evaluate(DOCK)
    assert found["closed"] == ["a", "b"]
    assert "This view failed: c cannot be made" in found["text"]
    assert [each.rpartition("Error: ")[2] for each in found["reported"]] == [
        "c cannot be made",
        "a cannot be closed",
    ]


@needs_chromium
def test_layout_that_is_left_while_it_looks_for_robots_shows_nothing_later(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    found = page.evaluate(
        """(async () => {
          const { Layouts } = await import("/js/views/layout.js");
          let made = 0;
          let listeners = 0;
          const view = class { constructor() { made += 1; } close() { made -= 1; } };
          const link = new EventTarget();
          Object.assign(link, {
            channels: new Map(), graph: { subscribed: new Map() },
            address: () => `ws://${location.host}/`, protocols: (name) => [name],
            watch(names, react) { listeners += 1; react(); return () => { listeners -= 1; }; },
          });
          const names = ["topics", "plot", "console", "board", "turtlesim", "teleop", "graph", "image", "nodes", "diagnostics"];
          const views = Object.fromEntries(names.map((name) => [name, [name, view]]));
          const place = { views, remember() {}, isActive: () => true, open() {} };
          const main = document.createElement("div");
          document.body.append(main);
          const layouts = new Layouts(link, new URLSearchParams("preset=classroom"), main, place);
          const looking = layouts.group();
          layouts.close();
          await looking;
          await new Promise((resolve) => setTimeout(resolve, 3500)); // longer than it looks
          return { made, listeners };
        })()"""
    )
    assert found == {"made": 0, "listeners": 0}


@needs_chromium
def test_console_keeps_no_lines_that_were_cut_when_stamps_go_back(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    found = page.evaluate(
        """(async () => {
          const { Console } = await import("/js/views/console.js");
          let received = null;
          const link = { services: new Map(), subscribe(entry, react) { received = react; return () => {}; } };
          const main = document.createElement("div");
          document.body.append(main);
          const view = new Console(link, new URLSearchParams(), main, { remember() {} });
          view.list.element.style.height = "200px"; // else all rows are seen, and are elements
          const line = (index, stamp) => ({ seconds: stamp, message: {
            header: { stamp: { secs: stamp, nsecs: 0 } }, level: 2, name: "/a", msg: String(index),
            file: "", line: 1, function: "" } });
          const many = (count, stamp) => Array.from({ length: count },
            (_, index) => line(index, stamp - Math.floor(index / 1000)));
          // Simulated time starts again.
          for (let round = 0; round < 3; round++) received({ lines: many(30_000, 1000 - round * 100) });
          const shown = view.shown.length;
          view.close();
          return shown;
        })()"""
    )
    assert found <= 50_000


@needs_chromium
def test_form_offers_constants_and_takes_their_names(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    found = page.evaluate(
        """(async () => {
          const [{ MessageForm }, { parseDefinition }] = await Promise.all([import("/js/form.js"), import("/js/ros1.js")]);
          const text = ["int8 STATUS_FIX=0", "int8 STATUS_GBAS=2", "uint8 ADD=5", "int8 status", "int32 action"].join("\\n");
          const form = new MessageForm(parseDefinition("p/T", text));
          const choice = form.element.querySelector("select");
          const [status, action] = form.element.querySelectorAll("input");
          const offered = [...choice.options].map((each) => each.textContent);
          const first = choice.value;
          choice.value = "2";
          choice.dispatchEvent(new Event("change"));
          action.value = "ADD";
          const chosen = form.value();
          status.value = "STATUS_FIX";
          status.dispatchEvent(new Event("input"));
          return { offered, first, chosen, named: form.value().status, shown: choice.value };
        })()"""
    )
    assert found["offered"] == ["constant …", "FIX = 0", "GBAS = 2"]
    assert found["first"] == "0"
    assert found["chosen"] == {"status": 2, "action": 5}
    assert (found["named"], found["shown"]) == (0, "0")


@needs_chromium
def test_answer_of_one_service_is_not_shown_for_another(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    found = page.evaluate(
        """(async () => {
          const [{ Services }, { parseDefinition }] = await Promise.all([import("/js/views/services.js"), import("/js/ros1.js")]);
          const services = new Map(["/slow", "/fast"].map((name) => [name, { type: "p/S", request: "" }]));
          let answer = null;
          let changed = null;
          const link = { services, state: "open", mayWrite: true, definition: parseDefinition,
            watch(names, react) { changed = react; react(); return () => {}; },
            call: () => new Promise((resolve) => { answer = resolve; }) };
          const main = document.createElement("div");
          document.body.append(main);
          const view = new Services(link, new URLSearchParams("service=/slow"), main, { remember() {} });
          const calling = view.call();
          view.choose("/fast");
          answer({ message: "at last" });
          await calling;
          const text = view.answer.textContent;
          services.delete("/fast");
          changed();
          return { text, name: view.choice.value, about: view.about.textContent, isOff: view.button.disabled };
        })()"""
    )
    assert found == {"text": "", "name": "/fast", "about": "p/S: it has left", "isOff": True}


@needs_chromium
def test_history_of_a_diagnostic_names_when_it_fell_silent_and_came_back(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    found = page.evaluate(
        """(async () => {
          const { Diagnostics } = await import("/js/views/diagnostics.js");
          let received = null;
          const link = { channels: new Map(), state: "open", watch(names, react) { react(); return () => {}; },
            subscribe(entry, react) { received = react; return () => {}; } };
          const main = document.createElement("div");
          document.body.append(main);
          const view = new Diagnostics(link, new URLSearchParams("name=/motor"), main, { remember() {} });
          const line = { message: { status: [{ name: "motor", level: 0, message: "fine", hardware_id: "", values: [] }] } };
          received({ lines: [line, line] });
          view.statuses.get("/motor").at -= 60;
          view.draw();
          view.draw();
          received({ lines: [line] });
          view.close();
          return [...view.side.querySelectorAll(".history li")].map((each) => each.textContent.replace(/^\\S+ /, ""));
        })()"""
    )
    assert found == ["OK fine", "Stale no message for 5 seconds", "OK fine"]
