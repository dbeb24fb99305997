"""`PYTHONPATH=. python benchmarks/dashboard_tasks.py [tasks] [page] [access]`: the dashboard's page as a user meets it.

tasks: ten tasks of daily work in headless chromium, with a robot of 40 nodes and 300 topics. Prints for each task the
clicks (a choice in a list counts as two), the texts typed, and the seconds until the answer is visible. The script acts at
once, so the seconds are those of the page and the robot, without a person's.

page: the size of the files that the browser loads, compressed as they are served, and the seconds from opening the link to the
first live value.

access: the accessibility score of each view by Lighthouse, which npm installs:
`npm install --prefix /tmp/lighthouse lighthouse@12.8.2`, then `--lighthouse /tmp/lighthouse`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.dashboard import BIN, start, wait_for_master
from minirospy.web.dashboard.views import VIEWS
from tests.conftest import free_port
from tests.interop.browser import CHROMIUM, Page

ROBOT = """
import asyncio
from geometry_msgs.msg import Twist
from minirospy import Node
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Bool, Float64

NODES, TOPICS = 40, 300
IMAGE = Image(height=48, width=64, encoding="rgb8", step=192, data=bytes(x % 256 for x in range(9216)))

async def main():
    nodes = []
    for number in range(NODES):
        nodes.append(Node(f"node_{number:02d}", namespace=f"/robot/arm_{number % 4}"))
        await nodes[-1].start()
    senders, kept = [], []
    for number in range(TOPICS):
        topic = f"/robot/arm_{number % 4}/topic_{number:03d}"
        senders.append(await nodes[number % NODES].advertise(topic, Float64))
        if number % 2:
            kept.append(await nodes[(number + 1) % NODES].subscribe(topic, Float64))
        await nodes[0].set_param(f"/gains/joint_{number % 6}/p_{number:03d}", number)
    camera = await nodes[3].advertise("/camera/image_raw", Image)
    joints = await nodes[4].advertise("/joint_states", JointState)
    kept += [
        await nodes[0].advertise("/scan", LaserScan),
        await nodes[1].subscribe("/scan", LaserScan),
        await nodes[2].advertise("/led_command", Bool),
        await nodes[5].subscribe("/led_comand", Bool),
        await nodes[6].subscribe("/cmd_vel", Twist),
    ]
    nodes[7].log.error("no motor answers at /dev/ttyUSB0")
    count = 0
    while True:
        count += 1
        for sender in senders[:50]:
            await sender.publish(Float64(count))
        await camera.publish(IMAGE)
        await joints.publish(JointState(name=["elbow"], position=[count / 10]))
        await asyncio.sleep(0.1)

asyncio.run(main())
"""

# What the views Trajectory, State machines and Diagnostics show.
CONTENTS = """
import asyncio
from control_msgs.msg import JointTrajectoryControllerState
from controller_manager_msgs.msg import ControllerState, HardwareInterfaceResources
from controller_manager_msgs.srv import ListControllers
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from minirospy import Node
from smach_msgs.msg import SmachContainerStatus, SmachContainerStructure
from trajectory_msgs.msg import JointTrajectoryPoint

JOINT = '<joint name="{0}" type="revolute"><parent link="base"/><child link="{0}_link"/><axis xyz="0 0 1"/>' \
    '<limit lower="-1" upper="2" effort="1" velocity="1"/></joint><link name="{0}_link"/>'
NAMES = ["lift", "shoulder"]
ROBOT = '<robot name="arm"><link name="base"/>' + "".join(map(JOINT.format, NAMES)) + "</robot>"

async def main():
    node = Node("contents")
    await node.start()
    await node.set_param("/robot_description", ROBOT)
    type_ = "position_controllers/JointTrajectoryController"
    claims = [HardwareInterfaceResources("hardware_interface::PositionJointInterface", NAMES)]
    controllers = [ControllerState("arm", "running", type_, claims)]
    await node.set_param("/arm", {"type": type_, "joints": NAMES})
    await node.serve("/controller_manager/list_controllers", ListControllers, lambda request: [controllers])
    for topic, message in {
        "/arm/state": JointTrajectoryControllerState(
            joint_names=NAMES, actual=JointTrajectoryPoint(positions=[0.2, 0.5])
        ),
        "/machine/smach/container_structure": SmachContainerStructure(
            path="/ROOT", children=["DRIVE", "DOCK"], internal_outcomes=["arrived"], outcomes_from=["DRIVE"],
            outcomes_to=["DOCK"], container_outcomes=["done"],
        ),
        "/machine/smach/container_status": SmachContainerStatus(path="/ROOT", active_states=["DOCK"]),
        "/diagnostics_agg": DiagnosticArray(status=[
            DiagnosticStatus(1, "/Robot", "low", "", []),
            DiagnosticStatus(1, "/Robot/Battery", "low", "", [KeyValue("voltage", "21.3")]),
        ]),
    }.items():
        publisher = await node.advertise(topic, type(message), latch=True)
        await publisher.publish(message)
    print("ready", flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""

_LAMP = "kind%3Dlamp%26path%3D%252Fled_command%252Fdata%26label%3DLED"
_GAUGE = "kind%3Dgauge%26path%3D%252Fjoint_states%252Fposition%255B0%255D%26max%3D100"
SETTINGS = {
    "layout": "preset=workshop",
    "panels": f"edit=1&p={_LAMP}&p={_GAUGE}",
    "plot": "path=/joint_states/position[0]",
    "topics": "open=/joint_states",
}
"""Settings of views that would show little without."""


@contextlib.contextmanager
def robot(*, is_large: bool = True) -> Iterator[str]:
    """Run a master, the robot, and a dashboard in an empty folder; yield the dashboard's link."""
    uri = f"http://localhost:{free_port()}"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home, contextlib.ExitStack() as stack:
        os.environ.update(ROS_MASTER_URI=uri, ROS_HOSTNAME="localhost", ROS_HOME=home)
        os.environ["MINIROSPY_RUNTIME_DIR"] = home
        stack.callback(os.chdir, Path.cwd())
        os.chdir(home)
        start(stack, str(BIN / "roscore"), "-p", uri.rpartition(":")[2])
        wait_for_master()
        if is_large:
            start(stack, sys.executable, "-c", ROBOT)
            make_joint_bag(Path("joints.bag"))
        dashboard = start(stack, str(BIN / "minirospy"), "dashboard", "--no-browser", "--port", "0")
        assert dashboard.stdout
        found = re.search(rb"http\S+", dashboard.stdout.readline())
        assert found, "the dashboard prints no link"
        yield found[0].decode()


def make_joint_bag(path: Path) -> None:
    import rosbag
    import rospy
    from sensor_msgs.msg import JointState

    with rosbag.Bag(str(path), "w") as bag:
        for number in range(100):
            message = JointState(name=["elbow"], position=[number / 10])
            bag.write("/recorded/joint_states", message, rospy.Time.from_sec(1000 + number / 10))


class User:
    """Acts on a page, and counts clicks and typed texts."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.clicks = 0
        self.texts = 0

    def click(self, find: str, text: str = "") -> None:
        self.page.click(find, text)
        self.clicks += 1

    def choose(self, find: str, value: str) -> None:
        self.page.choose(find, value)
        self.clicks += 2

    def type(self, find: str, text: str) -> None:
        self.page.type(find, text)
        self.texts += 1

    def menu(self, group: str, view: str) -> None:
        """Open a view by its menu."""
        self.click(".views > button", group)
        self.click(".menu a", view)

    def press(self, kind: str, key: str) -> None:
        """Press ("rawKeyDown") or release ("keyUp") a key; a press counts as a text."""
        self.page.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)
        self.texts += kind == "rawKeyDown"

    def see(self, find: str, text: str) -> None:
        self.page.wait_text(find, text)


def find_dark_led(user: User) -> None:
    user.see(".findings", "/led_comand")
    user.see(".findings", "/led_command is published")


def plot_bag(user: User) -> None:
    # A bag is played while its view is open, so the plot is beside it.
    user.page.evaluate("location.hash = '#/layout?tree=row(bag,plot)'")
    user.texts += 1
    user.choose("select[aria-label='Bag']", "joints.bag")
    user.click(".publish-switch input")
    user.click("button.play")
    user.type("[data-view='plot'] .bar input", "/recorded/joint_states/position[0]")
    user.click("[data-view='plot'] button[type=submit]")
    user.page.wait("return /[0-9]/.test(document.querySelector('.series .num')?.textContent)")


def find_silent_scan(user: User) -> None:
    user.see(".findings", "/scan is silent")


def drive_and_stop(user: User) -> None:
    user.menu("Drive", "Teleop")
    user.see(".teleop", "stopped")
    user.press("rawKeyDown", "ArrowUp")
    user.page.wait("return !document.querySelector('.teleop').textContent.includes('stopped')")
    user.press("keyUp", "ArrowUp")
    user.see(".teleop", "stopped")


def kill_node(user: User) -> None:
    user.click(".overview tr[data-node] a", "node_00")
    user.click(".side button", "Kill")
    user.click(".question button", "Kill")
    user.see(".note", "was requested to shut down")


def change_parameter(user: User) -> None:
    user.menu("System", "Parameters")
    user.type("input[type=search]", "p_017")
    row = ".row.parameter[data-name='/gains/joint_5/p_017']"
    user.type(f"{row} input", "2.5")
    user.page.evaluate(f"document.querySelector({json.dumps(row)}).requestSubmit()")
    user.page.wait(f"return document.querySelector({json.dumps(row + ' input')}).value === '2.5'")


def find_topic(user: User) -> None:
    user.page.evaluate("document.getElementById('find').click()")
    user.clicks += 1
    user.type("dialog.palette input", "topic_217")
    user.page.evaluate("document.querySelector('dialog.palette li').click()")
    user.clicks += 1
    user.page.wait("return document.querySelector(\".row[data-topic$='topic_217'] [aria-expanded=true]\")")


def see_camera(user: User) -> None:
    user.menu("Look", "Image")
    user.page.wait(
        "return [...document.querySelectorAll('#view select option')].some(e => e.value === '/camera/image_raw')"
    )
    user.choose("#view select", "/camera/image_raw")
    user.page.wait("return document.querySelector('canvas.image')?.width === 64")


def record_bag(user: User) -> None:
    user.menu("Files", "Bags")
    user.click("button", "Record …")
    user.click("[data-topic='/joint_states'] input")
    user.type("input[aria-label='Name of the recording']", "mine")
    user.click(".recorder button", "Record")
    user.see(".recording", " kB")
    user.click(".recording button", "Stop")
    user.see(".recording", "saved")


def read_last_error(user: User) -> None:
    user.see(".recent", "no motor answers at /dev/ttyUSB0")


TASKS: dict[str, Callable[[User], None]] = {
    "find why the LED stays dark": find_dark_led,
    "plot a joint of a bag": plot_bag,
    "see why the scan is not shown": find_silent_scan,
    "drive and stop": drive_and_stop,
    "change a parameter": change_parameter,
    "find a topic among 300": find_topic,
    "see a camera": see_camera,
    "record a bag": record_bag,
    "read the last error": read_last_error,
    "kill a node": kill_node,
}


def measure_tasks() -> None:
    """Print the clicks, texts and seconds of each task, each from opening the page."""
    with robot() as link:
        page = Page(link)
        try:
            page.wait_text(".overview h2", "41 nodes")
            for name, task in TASKS.items():
                page.open("about:blank")
                begun = time.monotonic()
                page.open(link)
                user = User(page)
                page.wait("return document.getElementById('state')?.dataset.state === 'open'")
                task(user)
                seconds = time.monotonic() - begun
                print(f"| {name} | {user.clicks} | {user.texts} | {seconds:.1f} |", flush=True)
        finally:
            page.close()


SIZES = """
performance.getEntriesByType("resource").concat(performance.getEntriesByType("navigation"))
  .reduce((sum, { encodedBodySize }) => sum + encodedBodySize, 0)
"""


def measure_page() -> None:
    """Print the compressed size of what the first view loads and of all files, and the time to the first live value."""
    from minirospy.web.dashboard.files import read_folder

    files = {id(file): file for file in read_folder().values()}
    print(
        f"all files of the page, compressed: {sum(len(file.packed) for file in files.values()) / 1000:.0f} kB"
    )
    with robot(is_large=False) as link:
        seconds = []
        page = Page("about:blank")
        try:
            for _ in range(5):
                page.call("Network.clearBrowserCache")
                page.open("about:blank")
                begun = time.monotonic()
                page.open(link)
                page.wait("return document.querySelector('tr[data-node]')")
                seconds.append(time.monotonic() - begun)
            print(f"loaded by the first view, compressed: {page.evaluate(SIZES) / 1000:.0f} kB")
        finally:
            page.close()
    median = statistics.median(seconds)
    print(f"to the first node shown, cold: {median:.2f} s ({min(seconds):.2f} to {max(seconds):.2f})")


def measure_access(folder: Path, views: list[str]) -> None:
    """Print Lighthouse's accessibility score of each view, and the audits that fail."""
    assert CHROMIUM
    command = folder / "node_modules" / ".bin" / "lighthouse"
    with contextlib.ExitStack() as stack:
        link = stack.enter_context(robot())
        results = stack.enter_context(tempfile.TemporaryDirectory())
        contents = start(stack, sys.executable, "-c", CONTENTS)
        assert contents.stdout
        assert contents.stdout.readline() == b"ready\n"
        address, _, token = link.partition("#/overview?")
        for view in views:
            file = Path(results, f"{view}.json")
            words = "&".join(filter(None, (SETTINGS.get(view), token)))
            subprocess.run(
                [
                    str(command), f"{address}#/{view}?{words}", "--only-categories=accessibility", "--quiet", "--output=json",
                    f"--output-path={file}", "--chrome-flags=--headless=new --no-sandbox --disable-gpu",
                ],
                env={**os.environ, "CHROME_PATH": CHROMIUM},
                check=True,
            )  # fmt: skip
            found = json.loads(file.read_text())
            failed = [
                f"{name} ({len(audit['details']['items'])}: {audit['details']['items'][0]['node']['selector']})"
                for name, audit in found["audits"].items()
                if audit["score"] == 0 and audit.get("details", {}).get("items")
            ]
            score = found["categories"]["accessibility"]["score"] * 100
            print(f"| {view} | {score:.0f} | {', '.join(failed)} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="*", default=["tasks", "page"])
    parser.add_argument("--lighthouse", type=Path, help="the folder into which npm has installed lighthouse")
    parser.add_argument("--views", default=",".join(VIEWS), help="the views that access looks at")
    options = parser.parse_args()
    if "page" in options.what:
        measure_page()
    if "tasks" in options.what:
        measure_tasks()
    if "access" in options.what:
        if options.lighthouse is None:
            parser.error("access needs --lighthouse FOLDER")
        measure_access(options.lighthouse.absolute(), options.views.split(","))


if __name__ == "__main__":
    main()
