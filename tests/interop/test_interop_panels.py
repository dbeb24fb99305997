"""Small panels on the dashboard: their text form and messages under node; reading, moving and pressing them in chromium."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any
from urllib.parse import quote, urlencode

import pytest
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, Float64, String

from tests.interop.browser import PATIENCE, Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import HOSTILE, address, browse, needs_chromium, publisher
from tests.web.dashboard.conftest import Served, serve
from tests.web.dashboard.test_drive_endpoint import listen

__all__ = ["browse", "serve"]

WIDGETS = "js/widgets.js"
TWIST = (
    "Vector3 linear\nVector3 angular\n"
    + "=" * 80
    + "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
)


@needs_node
def test_panels_are_text_that_leaves_out_what_is_usual() -> None:
    body = """
      const texts = [
        "kind=gauge&path=%2Fa%2Fb&min=0&max=5&unit=", "kind=button&path=%2Freset&label=Go&service=1",
        "kind=lamp&path=%2Fx&color=red&onclick=evil"];
      return [texts.map(text => panelText(parsePanel(text))), parsePanel("kind=rocket&path=/a"), parsePanel("kind=value&path=a")];
    """
    assert run_script("panelText, parsePanel", WIDGETS, body) == [
        [
            "kind=gauge&path=%2Fa%2Fb&max=5",
            "kind=button&path=%2Freset&label=Go&service=1",
            "kind=lamp&path=%2Fx&color=red",
        ],
        None,
        None,
    ]


@needs_node
def test_value_of_a_path_is_found_in_any_message() -> None:
    body = """
      const message = { header: { seq: 3 }, name: ["a", "b"], data: { x: 1.5, on: true } };
      return [["header"], ["name", -1], ["data", "on"], ["data"], ["nothing"], ["name", "x"]]
        .map(steps => valueAt(message, steps) ?? null)
        .concat([isSame(true, "1"), isSame(false, "true"), isSame("go", "go"), isSame(2, "2.0")]);
    """
    assert run_script("isSame, valueAt", WIDGETS, body) == [
        3, "b", True, {"x": 1.5, "on": True}, None, None, True, False, True, True,
    ]  # fmt: skip


@needs_node
def test_message_has_one_field_set() -> None:
    body = f"""
      const {{ parseDefinition }} = await import({json.dumps(ros1())});
      const twist = parseDefinition("geometry_msgs/Twist", {json.dumps(TWIST)});
      const of = (text) => parseDefinition("p/T", text);
      const attempt = (make) => {{ try {{ return make(); }} catch (error) {{ return error.message; }} }};
      return [
        messageWith(twist, ["angular", "z"], "0.5"), messageWith(of("bool data"), [], "true"),
        messageWith(of("int8 data"), ["data"], "2.6"),
        String(messageWith(of("int64 data"), [], "7").data), messageWith(of("string data"), [], "go"),
        messageWith(of(""), [], ""),
        attempt(() => messageWith(twist, [], "1")), attempt(() => messageWith(twist, ["linear"], "1")),
        attempt(() => messageWith(twist, ["x"], "1")),
        attempt(() => messageWith(of("float64 data"), [], "fast")), attempt(() => messageWith(of("float64[] data"), [], "1")),
      ];
    """
    assert run_script("messageWith", WIDGETS, body) == [
        {"angular": {"z": 0.5}}, {"data": True}, {"data": 3}, "7", {"data": "go"}, {},
        "name a field: linear, angular", 'name a field of "linear": x, y, z', 'there is no field "x": there is linear, angular',
        '"fast" is not a number', '"data" is an array: a panel sets one value',
    ]  # fmt: skip


def ros1() -> str:
    from minirospy.web.dashboard.files import FOLDER

    return (FOLDER / "js" / "ros1.js").as_uri()


# --- the page


def panels(*specs: dict[str, str]) -> str:
    return "panels?" + "&".join("p=" + quote(urlencode(spec), safe="") for spec in specs)


def widget(path: str) -> str:
    return f".widget[data-path='{path}']"


@needs_chromium
def test_value_lamp_and_gauge_show_fields(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    served.run(publisher(served, "/text", String, latch=True).publish(HOSTILE))
    button = publisher(served, "/button_state", Bool, latch=True)
    served.run(button.publish(False))
    moving = publisher(served, "/cmd_vel", Twist, latch=True)
    page = browse(
        address(
            served,
            panels(
                {"kind": "value", "path": "/text"},
                {"kind": "lamp", "path": "/button_state/data", "color": "red", "label": "Button"},
                {"kind": "gauge", "path": "/cmd_vel/linear/x", "max": "2", "unit": "m/s"},
                {"kind": "value", "path": "/cmd_vel/linear/x", "unit": "m/s"},
            ),
        )
    )
    page.wait_text(f"{widget('/text')} .big", HOSTILE[:40])
    page.wait(f'return document.querySelector("{widget("/button_state/data")} .bulb[aria-label=off]")')
    served.run(button.publish(True))
    page.wait(f'return document.querySelector("{widget("/button_state/data")} .bulb.lit.red")')
    twist = Twist()
    twist.linear.x = 1.5
    served.run(moving.publish(twist))
    page.wait_text(".meter .reading", "1.5 m/s")
    page.wait_text(".big", "1.5 m/s")
    assert page.evaluate("document.querySelector('.meter').getAttribute('aria-valuenow')") == "1.5"
    assert page.evaluate("document.querySelectorAll('main img').length") == 0


@needs_chromium
def test_switch_slider_and_button_set_fields(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    lamp, speed, horn = (
        listen(served, "/lamp", Bool),
        listen(served, "/cmd_vel"),
        listen(served, "/horn", Float64),
    )
    publisher(served, "/cmd_vel", Twist)
    page = browse(
        address(
            served,
            panels(
                {"kind": "switch", "path": "/lamp/data", "type": "std_msgs/Bool"},
                {"kind": "slider", "path": "/cmd_vel/angular/z", "min": "-1", "max": "1", "step": "0.25"},
                {
                    "kind": "button",
                    "path": "/horn",
                    "type": "std_msgs/Float64",
                    "on": "440",
                    "release": "0",
                    "label": "Horn",
                },
            ),
        )
    )
    page.wait_text("#state", "connected")
    page.click("button.toggle")
    page.wait("return document.querySelector('button.toggle').getAttribute('aria-checked') === 'true'")
    page.click("button.toggle")
    lamp(lambda message: not message.data)
    page.click("button.toggle")
    lamp(lambda message: message.data)
    slide = (
        "const e = document.querySelector('input[type=range]'); if (e.disabled) return false; e.value = %s;"
        "e.dispatchEvent(new Event('input', {bubbles: true})); return true"
    )
    for value in ("0.25", "-0.5", "1"):
        page.wait(slide % value)
        page.wait(f"return document.querySelector('.sliding .num').textContent.startsWith('{value}')")
    speed(lambda twist: twist.angular.z == 1 and twist.linear.x == 0)
    page.press("button.push-button", "Horn")
    horn(lambda message: message.data == 440)
    page.release("button.push-button", "Horn")
    horn(lambda message: message.data == 0)


@needs_chromium
def test_button_and_switch_call_services(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse

    served = serve()
    node = served.node("machine")
    calls: list[Any] = []

    def set_power(request: Any) -> Any:
        calls.append(request.data)
        return SetBoolResponse(success=True, message="power " + ("on" if request.data else "off"))

    async def offer() -> None:
        await node.serve("/home", Trigger, lambda _: TriggerResponse(success=True, message="at home"))
        await node.serve("/power", SetBool, set_power)

    served.run(offer())
    page = browse(
        address(
            served,
            panels(
                {"kind": "button", "path": "/home", "service": "1"},
                {"kind": "switch", "path": "/power", "service": "1"},
            ),
        )
    )
    page.click("button.push-button", "/home")
    page.wait_text(f"{widget('/home')} .note", "at home")
    for text in ("power on", "power off"):
        page.click("button.toggle")
        page.wait_text(f"{widget('/power')} .note", text)
    assert calls == [True, False]


@needs_chromium
def test_panels_are_made_by_the_form_and_kept_in_the_link(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    served.run(publisher(served, "/battery", Float64, latch=True).publish(11.5))
    page = browse(address(served, "panels"))
    page.wait_text("#state", "connected")
    page.click("button[type=submit]", "Add")
    page.wait_text(".error", "Type a topic and a field")
    page.choose("select[aria-label='Kind of panel']", "gauge")
    page.type("input[aria-label='Field of a topic, or service']", "/battery/data")
    page.type("input[aria-label=Label]", "Battery")
    page.type("input[name=max]", "24")
    page.click("button[type=submit]", "Add")
    page.wait_text(".meter .reading", "11.5")
    page.choose("select[aria-label='Kind of panel']", "value")
    page.type("input[aria-label='Field of a topic, or service']", "/battery/nothing")
    page.click("button[type=submit]", "Add")
    page.wait_text(f"{widget('/battery/nothing')} .note", "/battery has no such field")
    # Change, move and remove a panel.
    page.click(f"{widget('/battery/nothing')} button[title='Change this panel']")
    page.type("input[aria-label='Field of a topic, or service']", "/battery")
    page.click("button[type=submit]", "Change")
    page.wait_text(f"{widget('/battery')} .big", "11.5")
    page.click(f"{widget('/battery')} button[title='Move to the left']")
    page.wait("return document.querySelector('.widget').dataset.path === '/battery'")
    page.click(f"{widget('/battery')} button[title='Remove this panel']")
    page.click("button", "Edit")
    page.wait("return !location.hash.includes('edit=')")
    link = page.evaluate("location.href")
    other = browse(link)
    other.wait_text(".meter .reading", "11.5")
    other.wait_text(".widget h3", "Battery")
    assert other.evaluate("document.querySelectorAll('.widget').length") == 1
    assert other.evaluate("document.querySelectorAll('.widget-tools button').length") == 0


@needs_chromium
@pytest.mark.parametrize("kind", ["button", "switch"])
def test_reader_sets_nothing(serve: Callable[..., Served], browse: Callable[..., Page], kind: str) -> None:
    from minirospy.web.access import Access

    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    publisher(served, "/lamp", Bool)
    page = browse(address(served, panels({"kind": kind, "path": "/lamp"}) + "&token=read-token-00"))
    page.wait_text("#state", "read-only")
    page.click(".widget button")
    page.wait_text(".widget .note", "This token is read-only.")


@needs_chromium
def test_button_sets_a_topic_that_is_only_subscribed(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    node = served.node("robot")

    async def subscribe() -> Any:
        return await node.subscribe("/cmd_vel", Twist)

    heard = served.run(subscribe())
    page = browse(
        address(served, panels({"kind": "button", "path": "/cmd_vel/angular/z", "label": "Turn", "on": "2"}))
    )
    page.click("button.push-button:not([disabled])", "Turn")
    assert served.run(heard.next(PATIENCE)).angular.z == 2.0


@needs_chromium
def test_switch_pressed_twice_does_not_show_its_earlier_value(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    lamp = listen(served, "/lamp", Bool)
    served.run(publisher(served, "/lamp", Bool, latch=True).publish(True))
    switch = {"kind": "switch", "path": "/lamp/data", "type": "std_msgs/Bool"}
    page = browse(address(served, panels(switch, {"kind": "lamp", "path": "/lamp/data"})))
    page.wait_text("#state", "connected")
    page.wait(
        "return document.querySelector('.bulb.lit') && document.querySelector('.toggle[aria-checked=true]')"
    )
    page.evaluate(
        """(() => {
            // The switch expects its earlier values within a second: let that second last, however slow the machine is.
            const later = window.setTimeout;
            window.setTimeout = (run, ms, ...words) => later(run, ms === 1000 ? 3_600_000 : ms, ...words);
            const toggle = document.querySelector("button.toggle"), bulb = document.querySelector(".bulb");
            const note = () => window.shown.push(toggle.getAttribute("aria-checked"));
            window.shown = [];
            new MutationObserver(note).observe(toggle, { attributes: true });
            for (let count = 0; count < 3; count++) { toggle.click(); note(); }
            const look = () => { window.isBack = !bulb.classList.contains("lit"); };
            new MutationObserver(look).observe(bulb, { attributes: true });
        })()"""
    )
    lamp(lambda message: not message.data)
    page.wait("return window.isBack")
    assert "true" not in page.evaluate("window.shown.slice(3).join()")
