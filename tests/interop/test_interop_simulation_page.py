"""The simulation's window in Debian's chromium, with a real gzserver."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable

import pytest
from gazebo_msgs.srv import GetModelState, GetPhysicsProperties, GetWorldProperties, SpawnModel
from geometry_msgs.msg import Pose

from minirospy.web.access import Access
from tests.interop.browser import Page
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.interop.test_interop_dashboard_3d import colors, levels, mouse, wait_color
from tests.ros.robot_state_publisher.conftest import Start, start
from tests.waiting import wait_until
from tests.web.dashboard.conftest import TOKEN, Served, serve

pytest.importorskip("mujoco", reason="mujoco-core is not installed: pip install minirospy[sim]")

__all__ = ["browse", "serve", "start"]

Serve = Callable[..., Served]
Browse = Callable[..., Page]
MILL = """<robot name="mill">
  <link name="world"/>
  <joint name="foot" type="fixed"><parent link="world"/><child link="tower"/></joint>
  <link name="tower">
    <inertial><mass value="9"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>
  </link>
  <joint name="shaft" type="continuous">
    <axis xyz="0 0 1"/><origin xyz="0 0 1.1"/><parent link="tower"/><child link="sail"/>
  </joint>
  <link name="sail">
    <inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><geometry><box size="1 0.1 0.1"/></geometry></visual>
  </link>
</robot>"""
SELECTED = ".sim-side section:nth-of-type(2)"
INSERT = ".sim-side section:nth-of-type(3)"


class World:
    """A gzserver and a page that shows it."""

    def __init__(self, serve: Serve, browse: Browse, start: Start, *words: str) -> None:
        self.served = serve()
        self.node = self.served.node("test")
        self.process = start("gazebo_ros", "gzserver", *words, "__name:=gazebo")
        self.page = browse(address(self.served, "simulation"))
        self.page.wait_text(".sim-model", "ground_plane")

    def call(self, name: str, kind: type, *values: object) -> object:
        return self.served.run(self.node.call(f"/gazebo/{name}", kind, *values))

    def spawn(self, name: str, urdf: str, z: float = 0.0) -> None:
        pose = Pose()
        pose.position.z, pose.orientation.w = z, 1.0
        answer = self.call("spawn_urdf_model", SpawnModel, name, urdf, "", pose, "world")
        assert answer.success, answer.status_message  # type: ignore[attr-defined]
        self.page.wait_text(".sim-model", name)

    def place(self, name: str) -> tuple[float, float, float]:
        position = self.call("get_model_state", GetModelState, name, "").pose.position  # type: ignore[attr-defined]
        return position.x, position.y, position.z

    def time(self) -> float:
        return self.call("get_world_properties", GetWorldProperties).sim_time  # type: ignore[attr-defined, no-any-return]

    def insert(self, **fields: str) -> None:
        """Insert what the section shows, after these fields were set."""
        for name, value in fields.items():
            self.page.type(f"{INSERT} input[aria-label='{name.replace('_', ' ')}']", value)
        self.page.click(f"{INSERT} button", "Insert")


@needs_chromium
def test_window_waits_for_a_simulation_steps_resets_and_sets_its_speed(
    serve: Serve, browse: Browse, start: Start
) -> None:
    served = serve()
    page = browse(address(served, "simulation"))
    page.wait_text(".empty", "No simulation runs. Start one: roslaunch gazebo_ros empty_world.launch")
    start("gazebo_ros", "gzserver", "-u", "__name:=gazebo")
    page.wait_text(".sim-model", "ground_plane")
    page.wait_text(".sim-bar", "paused")
    page.type("input[aria-label=Steps]", "250")
    page.click(".sim-bar button", "Step")
    page.wait_text(".sim-time", "00:00:00.250")
    for text, problem in (("", "is not a number"), ("1.5", "not a whole number"), ("0", "not from 1 to")):
        page.type("input[aria-label=Steps]", text)
        page.click(".sim-bar button", "Step")
        page.wait_text("p.error", problem)
    page.click(".sim-play")
    page.wait("return !document.querySelector('.sim-time').textContent.startsWith('00:00:00.')")
    page.wait("return document.querySelector('p.error').textContent === ''")
    page.choose("select[aria-label=Speed]", "0.5")
    node = served.node("test")
    wait_until(
        lambda: (
            served.run(node.call("/gazebo/get_physics_properties", GetPhysicsProperties)).max_update_rate
            == 500
        )
    )
    page.click(".sim-play")
    page.wait_text(".sim-bar", "paused")
    page.click(".sim-bar button", "Reset time")
    page.wait_text(".sim-time", "00:00:00.000")


@needs_chromium
def test_models_are_inserted_set_and_deleted(serve: Serve, browse: Browse, start: Start) -> None:
    world = World(serve, browse, start, "-u")
    page = world.page
    world.insert(size_x="1", size_y="1", size_z="1", x="0", y="0", z="2")
    page.wait_text(f"{SELECTED} h3", "box_0")
    assert world.place("box_0") == (0, 0, 2)
    # The next name is proposed; a name that exists is refused in one line.
    page.wait(f"return document.querySelector(\"{INSERT} input[aria-label=Name]\").value === 'box_1'")
    for fields, problem in (
        ({"Name": "box_0"}, 'There is a model "box_0" already'),
        ({"Name": "a b"}, '"a b" cannot be a name'),
        ({"Name": ""}, "The model needs a name"),
        ({"Name": "box_1", "x": "NaN"}, 'x: "NaN" is not a number'),
        ({"x": "", "y": "1"}, 'x: "" is not a number'),
        ({"x": "1", "size_x": "0"}, "size x: 0 is not above 0"),
    ):
        world.insert(**fields)
        page.wait_text("p.error", problem)
    page.choose("select[aria-label=Shape]", "sphere")
    world.insert(radius="0.5", x="3", y="0", z="4")
    page.wait_text(f"{SELECTED} h3", "sphere_0")
    page.choose("select[aria-label=Shape]", "model")
    page.type("input[aria-label=Model]", "no_such_model")
    world.insert(Name="nothing")
    page.wait_text("p.error", "no_such_model")
    page.type("input[aria-label=Model]", "table")
    world.insert(Name="desk", z="0")
    page.wait_text(f"{SELECTED} h3", "desk")
    page.wait("return document.querySelector('p.error').textContent === ''")

    # A pose by numbers.
    page.click(".sim-model .name", "sphere_0")
    page.wait(f"return document.querySelector('{SELECTED} input[aria-label=z]').value === '4.000'")
    page.type(f"{SELECTED} input[aria-label=x]", "-2,5")
    page.click(f"{SELECTED} button", "Set pose")
    wait_until(lambda: world.place("sphere_0") == (-2.5, 0, 4))
    # Once the answer has arrived, the fields follow the model again, so what is typed before that may be replaced.
    page.wait(f"return document.querySelector('{SELECTED} input[aria-label=x]').value === '-2.500'")
    page.type(f"{SELECTED} input[aria-label=yaw]", "inf")
    page.click(f"{SELECTED} button", "Set pose")
    page.wait_text("p.error", 'yaw: "inf" is not a number')
    page.click(f"{SELECTED} button", "Delete")
    page.wait(
        "return ![...document.querySelectorAll('.sim-model')].some(e => e.textContent.includes('sphere'))"
    )
    page.wait(f"return document.querySelector('{SELECTED}').hidden")
    page.click("[data-model=desk] .sim-delete")
    page.wait("return document.querySelectorAll('.sim-model').length === 2")


def point_at(page: Page, model: str) -> None:
    """Move the mouse over the picture's middle until the page shows this model's name there."""

    def is_shown() -> bool:
        mouse(page, "mouseMoved", 0, -10)
        return bool(page.evaluate(f"document.querySelector('.status').textContent.includes('{model} · ')"))

    wait_until(is_shown)


def has_magenta(page: Page) -> bool:
    return any(red > 120 and green < red / 3 and blue > red / 2 for red, green, blue in colors(page))


@needs_chromium
def test_deleted_reset_and_respawned_models_leave_nothing_behind(
    serve: Serve, browse: Browse, start: Start
) -> None:
    world = World(serve, browse, start)
    page = world.page
    for _ in range(2):
        page.evaluate("document.querySelector('.sim-side input[type=color]').value = '#ff00ff'")
        world.insert(Name="ghost", x="0", y="0", z="1")
        page.wait_text(f"{SELECTED} h3", "ghost")
        page.click(".sim-model .name", "ghost")  # deselected, it has its own color
        wait_until(lambda: has_magenta(page))
        page.click(".sim-bar button", "Reset time")
        wait_until(lambda: has_magenta(page))
        page.click("[data-model=ghost] .sim-delete")
        wait_until(lambda: not has_magenta(page))
        # The name is free once the model has left the list.
        page.wait("return !document.querySelector('[data-model=ghost]')")
    page.click(".sim-bar button", "Reset world")
    page.wait("return document.querySelectorAll('.sim-model').length === 1")
    assert not has_magenta(page)


@needs_chromium
def test_models_are_pushed_dragged_and_have_contacts(serve: Serve, browse: Browse, start: Start) -> None:
    world = World(serve, browse, start)
    page = world.page
    world.insert(size_x="0.5", size_y="0.5", size_z="0.5", x="0", y="0", z="0.25")
    page.wait_text(f"{SELECTED} h3", "box_0")
    page.click(".sim-bar button", "Contacts")
    wait_color(page, (255, 64, 38), 30)

    page.choose("select[aria-label=Direction]", "-y")
    page.type("input[aria-label=N]", "400")
    page.click(f"{SELECTED} button", "Push")
    wait_until(lambda: world.place("box_0")[1] < -0.005)
    page.type("input[aria-label=N]", "-")
    page.click(f"{SELECTED} button", "Push")
    page.wait_text("p.error", 'N: "-" is not a number')
    page.click(".sim-bar button", "Reset world")
    wait_until(lambda: world.place("box_0")[1] == pytest.approx(0, abs=1e-3))

    # The box is in the middle of the picture. Dragged to the right of the view, it moves over the ground.
    page.click(".tools button", "Drag")
    page.type("input[aria-label=N]", "400")
    x, y, _ = world.place("box_0")
    point_at(page, "box_0")
    mouse(page, "mousePressed", 0, -10, 1)
    mouse(page, "mouseMoved", 75, -10, 1)
    mouse(page, "mouseMoved", 150, -10, 1)
    # A model that is dropped before the simulation has told its pose stays where it is.
    wait_until(lambda: abs(world.place("box_0")[0] - x) + abs(world.place("box_0")[1] - y) > 0.5)
    mouse(page, "mouseReleased", 150, -10)
    wait_until(lambda: world.place("box_0")[2] == pytest.approx(0.25, abs=0.02))
    page.click(".sim-bar button", "Reset world")
    wait_until(lambda: world.place("box_0")[1] == pytest.approx(0, abs=1e-3))

    # The tool Push moves it away from the viewpoint at +x and +y.
    page.click(".tools button", "Push")
    point_at(page, "box_0")
    mouse(page, "mousePressed", 0, -10, 1)
    mouse(page, "mouseReleased", 0, -10)
    page.wait_text("[role=status]", "box_0::link: 400 N for 0.2 s")
    wait_until(lambda: world.place("box_0")[0] < -0.002)
    # A click beside all models deselects; one on the ground selects the ground.
    page.click(".tools button", "Select")
    mouse(page, "mousePressed", -300, 150, 1)
    mouse(page, "mouseReleased", -300, 150)
    page.wait_text(f"{SELECTED} h3", "ground_plane")
    page.wait("return document.querySelector('.sim-side').innerText.includes('static')")


@needs_chromium
def test_joints_are_shown_and_moved_and_the_view_follows(serve: Serve, browse: Browse, start: Start) -> None:
    world = World(serve, browse, start, "-u")
    page = world.page
    world.spawn("mill", MILL)
    page.click(".sim-model .name", "mill")
    page.wait_text("[data-joint=shaft] .num", "0.000")
    page.type("[data-joint=shaft] input", "1.25")
    page.click("[data-joint=shaft] button", "Set")
    page.wait_text("[data-joint=shaft] .num", "1.250")
    page.type("[data-joint=shaft] input", "x")
    page.click("[data-joint=shaft] button", "Set")
    page.wait_text("p.error", 'shaft: "x" is not a number')
    page.choose("select[aria-label=Joints]", "effort")
    page.type("[data-joint=shaft] input", "0.4")
    page.click("[data-joint=shaft] button", "Set")
    page.wait_text(".sim-bar", "paused")
    page.click(".sim-play")
    page.wait("return Number(document.querySelector('[data-joint=shaft] .num').textContent) > 1.5")
    # The picture is loaded, and has the frames of the links, some time after the numbers.
    page.wait(
        "return [...document.querySelector(\"select[aria-label='Target frame']\").options]"
        ".some(e => e.value.startsWith('mill::'))"
    )
    page.click(f"{SELECTED} button", "Follow")
    page.wait(
        "return document.querySelector(\"select[aria-label='Target frame']\").value.startsWith('mill::')"
    )
    page.click(".sim-model .name", "ground_plane")
    page.wait(
        "return document.querySelector(\"select[aria-label='Target frame']\").value === '<Fixed Frame>'"
    )


@needs_chromium
@pytest.mark.skipif(sys.platform == "win32", reason="the test stops a process by a signal")
def test_simulation_that_stands_or_has_died_is_named(serve: Serve, browse: Browse, start: Start) -> None:
    world = World(serve, browse, start)
    page = world.page
    # The list of models is asked for, too, and its error may replace that of the button at once.
    page.evaluate(
        "window.said = []; new MutationObserver(() => said.push(document.querySelector('p.error').textContent))"
        ".observe(document.querySelector('p.error'), {childList: true, characterData: true, subtree: true})"
    )
    world.process.send_signal(signal.SIGSTOP)
    try:
        page.wait_text(".sim-bar", "no answer")
        page.click(".sim-bar button", "Reset world")
        page.wait("return said.some(each => each.includes('/gazebo/reset_world does not answer'))")
    finally:
        world.process.send_signal(signal.SIGCONT)
    page.wait("return !document.querySelector('.sim-bar').textContent.includes('no answer')")
    world.process.kill()
    world.process.wait()
    # The bar is hidden if the page has noticed first.
    page.evaluate(
        "said.length = 0; [...document.querySelectorAll('.sim-bar button')]"
        ".find(each => each.textContent === 'Reset world').click()"
    )
    page.wait("return said.some(each => each.includes('/gazebo/reset_world'))")


@needs_chromium
def test_read_only_page_shows_the_world_and_changes_nothing(
    serve: Serve, browse: Browse, start: Start
) -> None:
    served = serve(access=Access(read_token="look-only-0", write_token=TOKEN, requires_token=True))
    start("gazebo_ros", "gzserver", "-u", "__name:=gazebo")
    page = browse(address(served, "simulation?token=look-only-0"))
    page.wait_text(".sim-model", "ground_plane")
    page.wait("return document.querySelector('.sim-play').disabled")
    page.click("[data-model=ground_plane] .sim-delete")
    page.wait_text("p.error", "This token is read-only.")


@needs_chromium
def test_3d_view_adds_no_displays_of_the_windows_topics(serve: Serve, browse: Browse, start: Start) -> None:
    served = serve()
    start("gazebo_ros", "gzserver", "-u", "__name:=gazebo")
    page = browse(address(served, "3d"))
    page.wait_text(".displays", "/gazebo/world_markers")
    page.wait("return document.querySelector('.displays')")
    assert not [name for name in levels(page) if "/window/" in name]


@needs_chromium
def test_page_of_a_phone_in_german_has_everything(serve: Serve, browse: Browse, start: Start) -> None:
    served = serve()
    start("gazebo_ros", "gzserver", "-u", "__name:=gazebo")
    page = browse(address(served, "simulation"), width=390, height=800)
    page.evaluate("localStorage.setItem('language', 'de')")
    page.reload()
    page.wait_text(".sim-model", "ground_plane")
    page.wait_text(".sim-bar", "angehalten")
    page.click(f"{INSERT} button", "Einfügen")
    page.wait_text(f"{SELECTED} h3", "box_0")
    page.wait_text(f"{SELECTED} button", "Lage setzen")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


LATE_LIST = """(async () => {
  const { Simulation } = await import("/js/views/simulation.js");
  Simulation.prototype.load = () => {}; // the test needs no picture
  const answers = [];
  const names = ["pause_physics", "get_world_properties", "set_model_state"];
  const link = Object.assign(new EventTarget(), {
    state: "open", mayWrite: true, channels: new Map(), parameters: new Map(),
    services: new Map(names.map((name) => [`/gazebo/${name}`, {}])),
    subscribe: () => () => {}, watch(_, react) { react(); return () => {}; },
    call: () => new Promise((resolve) => answers.push(resolve)),
  });
  const main = document.createElement("div");
  document.body.append(main);
  const view = new Simulation(link, new URLSearchParams("model=old"), main, { remember() {} });
  const settled = () => new Promise((resolve) => setTimeout(resolve));
  const [list] = answers;
  view.select("new");
  list({ success: true, model_names: ["ground_plane"] });
  await settled();
  const kept = view.model;
  const again = view.list();
  answers.at(-1)({ success: true, model_names: ["ground_plane"] });
  await again;
  view.close();
  return [kept, view.model];
})()"""


@needs_chromium
def test_model_that_is_selected_stays_so_if_a_list_from_before_comes(serve: Serve, browse: Browse) -> None:
    page = browse(address(serve(), "topics"))
    page.wait_text("#state", "connected")
    assert page.evaluate(LATE_LIST) == ["new", ""]
