"""Make the pictures of docs/dashboard: `python tools/dashboard_pictures.py [NAME ...]`.

Shows each view with the same robot in a room as the tests, in Debian's chromium. If `pngquant` is installed, pictures
have at most 128 colors, which keeps them small. Look at each picture before you commit it.
"""

from __future__ import annotations

import argparse
import io
import math
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from base64 import b64decode
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from urllib.parse import quote, urlencode  # noqa: E402 - the folder above comes first

from control_msgs.msg import JointTrajectoryControllerState  # noqa: E402
from geometry_msgs.msg import Twist  # noqa: E402
from PIL import Image as Screenshot  # noqa: E402
from rosgraph_msgs.msg import Log  # noqa: E402
from sensor_msgs.msg import Image, LaserScan  # noqa: E402
from std_msgs.msg import Bool, Float64, String  # noqa: E402
from trajectory_msgs.msg import JointTrajectoryPoint  # noqa: E402
from turtlesim.msg import Pose  # noqa: E402
from turtlesim.srv import SetPen, Spawn  # noqa: E402

from minirospy.board.board import Board  # noqa: E402
from minirospy.runtime.master.master import Master  # noqa: E402
from minirospy.runtime.transport.loop import LoopThread  # noqa: E402
from minirospy.web.access import Access  # noqa: E402
from minirospy.web.bridge import BridgeOptions  # noqa: E402
from tests.interop import robot_scene  # noqa: E402
from tests.interop.browser import PATIENCE, Page  # noqa: E402
from tests.interop.test_interop_dashboard import address, drag, publisher, repeated  # noqa: E402
from tests.interop.test_interop_reconfigure import HERE, generate  # noqa: E402
from tests.interop.test_interop_walk import furnish, use  # noqa: E402
from tests.web.dashboard.bags import make_bag  # noqa: E402
from tests.web.dashboard.conftest import TOKEN, Served  # noqa: E402

FOLDER = ROOT / "docs" / "dashboard"
COLORS = "128"
LINES = (
    (2, "/talker_scan", "the scanner is ready"),
    (4, "/led", "the battery is low"),
    (8, "/arm", "no motor answers at /dev/ttyUSB0"),
    (2, "/talker_camera", "30 images per second"),
)


WIDGETS = (
    {"kind": "lamp", "path": "/button/data", "label": "Button"},
    {"kind": "gauge", "path": "/turtle1/pose/x", "max": "11", "label": "Turtle x"},
    {"kind": "value", "path": "/turtle1/pose/theta", "label": "Yaw", "unit": "rad"},
    {"kind": "slider", "path": "/speed", "max": "2", "label": "Speed", "unit": "m/s"},
    {"kind": "switch", "path": "/lamp", "type": "std_msgs/Bool", "label": "Lamp"},
    {"kind": "button", "path": "/reset", "type": "std_msgs/Bool", "label": "Reset"},
)
PANELS = "panels?edit=1&" + "&".join("p=" + quote(urlencode(each), safe="") for each in WIDGETS)

JOINTS = {  # name: type, lower and upper limit
    "base_yaw": ("continuous", -3.142, 3.142),
    "shoulder_pitch": ("revolute", -1.9, 1.2),
    "elbow_pitch": ("revolute", 0.0, 2.6),
    "wrist_pitch": ("revolute", -1.57, 1.57),
    "lift": ("prismatic", 0.0, 0.45),
    "shoulder": ("revolute", -1.9, 1.9),
}


def arm() -> str:
    """Return the description of an arm, whose joints have limits."""
    links, joints, parent = ['<link name="base_link"/>'], [], "base_link"
    for name, (kind, lower, upper) in JOINTS.items():
        links.append(f'<link name="{name}_link"/>')
        joints.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{name}_link"/><axis xyz="0 0 1"/>'
            f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint>'
        )
        parent = f"{name}_link"
    return f'<robot name="picker">{"".join(links + joints)}</robot>'


LAUNCH = """<launch>
  <arg name="speed" default="0.4" doc="metres a second"/>
  <arg name="rooms" doc="names of the rooms, as 101,102"/>
  <arg name="camera" default="true" doc="start the camera, too"/>
  <node name="drive" pkg="patrol" type="drive.py" output="screen"/>
  <node name="camera" pkg="patrol" type="camera.py" if="$(arg camera)"/>
  <node name="lidar" pkg="patrol" type="lidar.py" respawn="true" respawn_delay="1"/>
  <node name="load_map" pkg="patrol" type="done.py"/>
</launch>
"""
PROGRAMS = {
    "drive": """import rospy
rospy.init_node("drive")
for room in range(101, 200):
    rospy.loginfo("room %d reached, battery %d %%", room, 191 - room)
    if room % 4 == 0:
        rospy.logwarn("a person is in the way, waiting")
    if room % 6 == 0:
        rospy.logerr("no transform from [map] to [base_link]")
    rospy.sleep(0.2)
rospy.spin()
""",
    "camera": "import sys, time\ntime.sleep(2)\nsys.exit(2)\n",
    "lidar": """import pathlib, time
starts = pathlib.Path("starts.txt")
count = len(starts.read_text()) if starts.exists() else 0
starts.write_text("x" * (count + 1))
time.sleep(1 if count < 2 else 1000)
""",
    "done": "",
}

MARKERS = """
import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from interactive_markers.menu_handler import MenuHandler
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl as Control, Marker

TURNS = {"x": (1, 0, 0), "y": (0, 0, 1), "z": (0, 1, 0)}

def control(mode, axis="x", *shapes):
    made = Control(interaction_mode=mode, name=f"{axis}{mode}", markers=list(shapes), always_visible=bool(shapes))
    orientation = made.orientation
    orientation.w, (orientation.x, orientation.y, orientation.z) = 1.0, TURNS[axis]
    return made

def body(kind, size, *color):
    made = Marker(type=kind)
    made.scale.x, made.scale.y, made.scale.z = size
    made.color.r, made.color.g, made.color.b, made.color.a = *color, 1.0
    made.pose.orientation.w = 1.0
    return made

def insert(name, x, y, z, controls):
    made = InteractiveMarker(name=name, description=name, scale=1.0, controls=controls)
    made.header.frame_id = "map"
    made.pose.position.x, made.pose.position.y, made.pose.position.z, made.pose.orientation.w = x, y, z, 1.0
    server.insert(made, lambda feedback: None)

rospy.init_node("tables")
server = InteractiveMarkerServer("/tables")
modes = [Control.MOVE_AXIS, Control.ROTATE_AXIS]
insert("gripper", -1.5, -1.5, 0.6, [control(mode, axis) for mode in modes for axis in TURNS]
       + [control(Control.NONE, "x", body(Marker.CUBE, (0.35, 0.35, 0.35), 0.4, 0.4, 0.45))])
insert("table", 1.2, 2.2, 0.15, [control(Control.ROTATE_AXIS, "z"),
       control(Control.MOVE_PLANE, "z", body(Marker.CYLINDER, (0.6, 0.6, 0.3), 0.7, 0.45, 0.1))])
insert("dock", -2.5, 1.0, 0.25, [control(Control.MENU, "x", body(Marker.CUBE, (0.5, 0.5, 0.5), 0.1, 0.9, 0.3))])
menu = MenuHandler()
menu.insert("Drive here", callback=print)
charge = menu.insert("Charge")
menu.insert("Now", parent=charge, callback=print)
menu.insert("At night", parent=charge, callback=print)
slowly = menu.insert("Slowly", callback=print)
menu.setCheckState(slowly, MenuHandler.CHECKED)
menu.insert("Rename", callback=print)
menu.apply(server, "dock")
server.applyChanges()
print("ready", flush=True)
rospy.spin()
"""


class Picture(NamedTuple):
    """A view to show: its link, a text to wait for in a selected element, and the window's size in pixels."""

    link: str
    wait: tuple[str, str] | None = None
    size: tuple[int, int] = (1200, 760)
    prepare: Callable[[Studio], None] | None = None  # runs before the page is opened
    act: Callable[[Studio, Page], None] | None = None  # uses the page
    seconds: float = 2.0  # to let the view receive data


class Studio:
    """The dashboard, and the programs that single pictures need. Close ``stack`` to end the programs."""

    def __init__(self, served: Served, home: Path, stack: ExitStack) -> None:
        self.served = served
        self._home = home
        self._stack = stack

    def describe(self, text: str) -> None:
        """Set robot_description."""
        self.served.run(self.served.node_of_dashboard.set_param("/robot_description", text))

    def run(self, *words: str, until: str = "") -> subprocess.Popen[str]:
        """Start a Python program; return once it has printed a line with ``until``."""
        program = subprocess.Popen(
            [sys.executable, *words],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip

        def end() -> None:
            program.terminate()
            program.communicate(timeout=PATIENCE)

        self._stack.callback(end)
        assert program.stdout
        while until and until not in (line := program.stdout.readline()):
            assert line, f"{words} has ended"
        return program

    # --- before the page is opened

    def start_counter(self) -> None:
        self._counter = self.run(str(HERE / "actions_page_peer.py"), until="ready")

    def start_markers(self) -> None:
        self.run("-c", MARKERS, until="ready")

    def start_lamp(self) -> None:
        modules = generate("ours", self._home)
        self.run(str(HERE / "reconfigure_peer.py"), "serve", str(modules), until="ready")

    def start_turtles(self) -> None:
        program = "from minirospy.ros.turtlesim.node import main; main()"
        self.run("-c", program, "__ns:=/sim")
        caller = self.served.node("caller")

        async def spawn() -> None:
            await caller.wait_for_service("/sim/spawn", PATIENCE)
            await caller.call("/sim/spawn", Spawn, x=7.5, y=1.0, theta=0.0, name="leonardo")
            await caller.call("/sim/turtle1/set_pen", SetPen, r=255, g=90, b=80, width=4)
            await caller.call("/sim/leonardo/set_pen", SetPen, r=255, g=200, b=30, width=4)

        self.served.run(spawn())

    def prepare_panels(self) -> None:
        speed = publisher(self.served, "/speed", Float64, latch=True)
        self.served.run(speed.publish(1.2))

    def prepare_arm(self) -> None:
        self.describe(arm())
        state = publisher(self.served, "/arm/state", JointTrajectoryControllerState, latch=True)
        actual = JointTrajectoryPoint(positions=[0.2, 0.8])
        message = JointTrajectoryControllerState(joint_names=["lift", "shoulder"], actual=actual)
        self.served.run(state.publish(message))

    # --- on the page

    def send_goal(self, page: Page) -> None:
        page.choose("select[aria-label=Action]", "/count")
        page.type("input[name=goal]", "3")
        page.click("button", "Send goal")
        page.wait_text("[aria-label='Chosen goal'] .badge", "Active")
        assert self._counter.stdin
        self._counter.stdin.write("\n")
        self._counter.stdin.flush()
        page.wait_text("[aria-label=Feedback]", "feedback: 1")

    def load_controller(self, page: Page) -> None:
        page.click("tr[data-controller='states'] button", "Load")
        page.wait_text("tr[data-controller='states'] .badge", "initialized")

    def move_joints(self, page: Page) -> None:
        page.click(".publish-switch input")
        page.click("button", "Randomize")

    def start_launch(self, page: Page) -> None:
        page.type("input[aria-label='Filter packages and files']", "patrol")
        page.evaluate("document.activeElement.dispatchEvent(new Event('input'))")
        page.click(".launch-files button", "launch/patrol.launch")
        page.wait_text(".launch-arg", "metres a second")
        page.type(".launch-arg input[name=rooms]", "101,102")
        page.evaluate("document.querySelector('.launch-form').dispatchEvent(new Event('input'))")
        page.click(".launch-form button", "Start")
        page.wait_text(".launch-nodes", "/drive")
        page.click(".launch-nodes tr button", "log")
        page.wait_text(".launch-log", "no transform")

    def show_room(self, page: Page) -> None:
        self.zoom_out(page, 2)

    def zoom_out(self, page: Page, steps: int = 4) -> None:
        page.wait("return Number(document.querySelector('canvas.stage')?.dataset.drawn) > 0")
        x, y = page.evaluate(
            "(() => { const r = document.querySelector('canvas.stage').getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2] })()"
        )
        for _ in range(steps):
            page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=120)

    def open_menu(self, page: Page) -> None:
        page.wait_text(".labels .name", "base_link")
        # Hide what is not needed here.
        for name in (
            "TF",
            "PoseArray /particles",
            "Range /sonar",
            "WrenchStamped /wrench",
            "MarkerArray /shapes",
        ):
            page.click(f".display[data-name='{name}'] input[type=checkbox]")
        self.zoom_out(page)
        page.evaluate("new Promise(resolve => setTimeout(resolve, 3000))")
        end = time.monotonic() + PATIENCE
        while len(green := green_pixels(page)) < 30:
            assert time.monotonic() < end, "the green marker is not shown"
        x, y = (sum(each[axis] for each in green) / len(green) for axis in (0, 1))
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            is_moved = kind == "mouseMoved"
            page.call(
                "Input.dispatchMouseEvent",
                type=kind, x=x, y=y, button="none" if is_moved else "left", clickCount=int(not is_moved),
            )  # fmt: skip
        page.wait_text(".marker-menu button", "Charge")

    def hold_stick(self, page: Page) -> None:
        page.wait_text("#state", "connected")
        drag(page, "mousePressed", 0, 40)
        drag(page, "mouseMoved", -30, 70)
        page.wait("return !document.querySelector('.teleop').textContent.includes('stopped')")

    def move_trajectory(self, page: Page) -> None:
        page.wait("return document.querySelector('.publish-switch input')?.disabled === false")
        page.click(".publish-switch input")
        page.type("[data-joint=shoulder] input[type=number]", "-0.6")
        page.evaluate("document.activeElement.blur()")

    def drive_turtles(self, page: Page) -> None:
        page.wait_text(".turtle-row", "leonardo")
        for turtle, speed, turn in (("turtle1", 1.5, 1.0), ("leonardo", 2.0, 0.8)):
            twist = Twist()
            twist.linear.x, twist.angular.z = speed, turn
            sender = publisher(self.served, f"/sim/{turtle}/cmd_vel", Twist)
            self._stack.enter_context(repeated(self.served, sender, twist))


def green_pixels(page: Page) -> list[tuple[int, int]]:
    """Return the positions of bright green in the page."""
    data = b64decode(page.call("Page.captureScreenshot", format="png")["data"])
    image = Screenshot.open(io.BytesIO(data)).convert("RGB")
    found = []
    for y in range(0, image.height, 2):
        for x in range(0, image.width, 2):
            red, green, blue = image.getpixel((x, y))  # type: ignore[misc]
            if green > 110 and red < green / 4 and green / 5 < blue < green / 2:
                found.append((x, y))
    return found


PICTURES = {
    "overview": Picture("overview", (".findings", "/scan_front is silent")),
    "topics": Picture("topics?open=/turtle1/pose", (".fields", "theta"), (960, 560)),
    "console": Picture("console", (".line .text", "no motor answers"), (960, 520)),
    "plot": Picture("plot?path=/turtle1/pose/x&path=/turtle1/pose/y&window=10", (".series .num", "."), (960, 620), seconds=8),
    "plot_xy": Picture("plot?path=/turtle1/pose/x&path=/turtle1/pose/y&x=/turtle1/pose/x", (".series .num", "."), seconds=8),
    "graph": Picture("graph?filter=navigation", (".traffic", "Hz")),
    "image": Picture("image?topic=/camera/image_raw", (".status", "320"), (1000, 600)),
    "board": Picture("board", ("svg.board text", "GPIO 11"), (960, 500)),
    "publish": Picture("publish", None, (960, 560)),
    "nodes": Picture("nodes?node=/talker_scan", (".side h2", "/talker_scan")),
    "tf": Picture("tf", (".tf .frame-box", "left_wheel")),
    "smach": Picture("smach", (".smach-state", "DOCK")),
    "diagnostics": Picture("diagnostics", (".report", "Battery"), (1200, 560)),
    "bags": Picture("bag?file=walk.bag", (".bag-label", "/chatter")),
    "workshop": Picture("layout?preset=workshop", (".pane .line .text", "no motor answers"), (1400, 860), seconds=8),
    "3d": Picture("3d", (".labels .name", "base_link"), act=Studio.show_room),
    "markers": Picture("3d", prepare=Studio.start_markers, act=Studio.open_menu, size=(1280, 800)),
    "actions": Picture("actions", prepare=Studio.start_counter, act=Studio.send_goal, size=(1200, 450)),
    "controllers": Picture("controllers", act=Studio.load_controller, size=(1200, 260)),
    "launch": Picture("launch", act=Studio.start_launch, seconds=8),
    "panels": Picture(PANELS, (".big", "rad"), (1200, 350), Studio.prepare_panels),
    "reconfigure": Picture("reconfigure", (".side button", "/lamp"), prepare=Studio.start_lamp),
    "teleop": Picture("teleop?topic=/turtle1/cmd_vel&linear=2", act=Studio.hold_stick, size=(1200, 620)),
    "turtlesim": Picture(
        "turtlesim?space=/sim", prepare=Studio.start_turtles, act=Studio.drive_turtles, seconds=4
    ),
    "joints": Picture("joints", (".joint .name", "elbow"), (1200, 450), Studio.prepare_arm, Studio.move_joints),
    "trajectory": Picture(
        "trajectory", (".joint .name", "shoulder"), (1200, 230), Studio.prepare_arm, Studio.move_trajectory
    ),
}  # fmt: skip


@contextmanager
def scene(folder: Path) -> Iterator[Served]:
    """Run a master, a robot that moves, a board, and a dashboard; yield the dashboard."""
    loop = LoopThread("pictures-master")

    async def start() -> Master:
        master = Master()
        await master.start()
        return master

    master = loop.run(start())
    os.environ.update(ROS_MASTER_URI=f"http://localhost:{master.port}", ROS_HOSTNAME="localhost")
    os.environ["MINIROSPY_RUNTIME_DIR"] = str(folder / "boards")
    served = Served(BridgeOptions(foxglove_port=0, diagnostics=False, access=Access(write_token=TOKEN)))
    stopped = threading.Event()
    moving: threading.Thread | None = None
    try:
        served.start()
        furnish(served)
        moving = threading.Thread(target=move, args=(served, stopped))
        moving.start()
        with Board():
            yield served
    finally:
        stopped.set()
        if moving:
            moving.join()
        served.close()
        loop.run(master.close(), 30.0)
        loop.close()


def move(served: Served, stopped: threading.Event) -> None:
    """Publish a turtle on a circle, a button, images and log lines until ``stopped`` is set."""
    turtle = publisher(served, "/turtle1/pose", Pose)
    button = publisher(served, "/button", Bool)
    camera = publisher(served, "/camera/image_raw", Image)
    log = publisher(served, "/rosout_agg", Log)
    publisher(served, "/scan_front", LaserScan)
    listening = served.node("navigation")

    async def listen() -> list[object]:
        topics = (
            ("/scan_front", LaserScan),
            ("/turtle1/pose", Pose),
            ("/button", Bool),
            ("/goal_text", String),
        )
        return [await listening.subscribe(topic, cls) for topic, cls in topics]

    kept = served.run(listen())
    count = 0
    while not stopped.wait(0.05):
        count += 1
        angle = count / 30
        pose = Pose(
            x=5.5 + 3 * math.cos(angle),
            y=5.5 + 3 * math.sin(angle),
            theta=angle % math.pi,
            linear_velocity=1.0,
        )
        served.run(turtle.publish(pose))
        served.run(button.publish(count % 40 < 20))
        if count % 4 == 0:
            served.run(camera.publish(picture(count)))
        if count % 20 == 0:
            level, name, text = LINES[count // 20 % len(LINES)]
            line = Log(level=level, name=name, msg=text, file="robot.py", line=12, function="step")
            line.header.stamp = served.node_of_dashboard.now()
            served.run(log.publish(line))
    del kept


def picture(count: int) -> Image:
    """Return a color gradient with a square that moves."""
    width, height = 320, 240
    rows = []
    left = count * 3 % (width - 40)
    for y in range(height):
        row = bytearray()
        for x in range(0, width, 4):
            inside = left <= x < left + 40 and 100 <= y < 140
            row += (bytes((240, 60, 40)) if inside else bytes((x * 255 // width, y, 160))) * 4
        rows.append(bytes(row))
    return Image(width=width, height=height, encoding="rgb8", step=3 * width, data=b"".join(rows))


def write_package(folder: Path) -> None:
    """Write the package patrol, with a launch file and its programs."""
    (folder / "launch").mkdir(parents=True)
    (folder / "package.xml").write_text(
        '<package format="2"><name>patrol</name><version>0.0.1</version><description>Patrol</description>'
        '<maintainer email="a@b.cd">A</maintainer><license>BSD</license></package>'
    )
    (folder / "launch" / "patrol.launch").write_text(LAUNCH)
    for name, text in PROGRAMS.items():
        program = folder / f"{name}.py"
        program.write_text(f"#!{sys.executable}\n{text}")
        program.chmod(0o755)


def take(studio: Studio, name: str, output: Path) -> None:
    """Save the picture of a view."""
    chosen = PICTURES[name]
    studio.describe(robot_scene.description())
    if chosen.prepare:
        chosen.prepare(studio)
    page = Page(address(studio.served, chosen.link), width=chosen.size[0], height=chosen.size[1])
    try:
        if chosen.wait:
            page.wait_text(*chosen.wait)
        if name == "publish":
            use(page, "publish")
        if chosen.act:
            chosen.act(studio, page)
        page.evaluate(f"new Promise(resolve => setTimeout(resolve, {chosen.seconds * 1000}))")
        page.screenshot(output)
    finally:
        page.close()


def main() -> None:
    """Make the pictures that the arguments name, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*PICTURES, []], default=[])
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where the pictures are written")
    options = parser.parse_args()
    folder = options.folder.absolute()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home, ExitStack() as stack:
        stack.callback(os.chdir, Path.cwd())
        os.chdir(home)
        make_bag(Path(home, "walk.bag"), 10)
        write_package(Path(home, "src", "patrol"))
        os.environ.update(ROS_PACKAGE_PATH=str(Path(home, "src")), ROS_HOME=str(Path(home, "ros")))
        served = stack.enter_context(scene(Path(home)))
        for name in options.names or PICTURES:
            output = folder / f"{name}.png"
            with ExitStack() as programs:
                take(Studio(served, Path(home), programs), name, output)
            if pngquant := shutil.which("pngquant"):
                subprocess.run([pngquant, "--force", "--ext", ".png", COLORS, str(output)], check=True)
            print(output, output.stat().st_size)


if __name__ == "__main__":
    main()
