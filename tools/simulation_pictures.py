"""Make the pictures of docs/simulation.md again: the simulation's window with an arm, a house and contacts.

    python tools/simulation_pictures.py [FOLDER]

It needs chromium, Pillow, minirospy[sim] and minirospy[web]. The pictures are WebP files in docs/simulation.
"""

from __future__ import annotations

import contextlib
import io
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.conftest import free_port  # noqa: E402 - found in the folder above
from tests.interop.browser import Page  # noqa: E402
from tests.waiting import wait_until  # noqa: E402

FOLDER = ROOT / "docs" / "simulation"
ROVER = ROOT / "tests" / "ros" / "simulation" / "rover.urdf"
WIDTH, HEIGHT = 1180, 720
MAX_BYTES = 120_000  # of a picture
QUALITY = 82  # of WebP
SHIFT = 8  # of Chromium's modifiers
SECONDS = 30.0  # for a program that must end


class Scene(NamedTuple):
    """The commands that start it, which go on or end, and what the page does then."""

    commands: Sequence[Sequence[str]]
    act: Callable[[Page], None]


def spawn(model: str, name: str, **place: float) -> list[str]:
    """Return the command that adds a model of the library, at x, y and z."""
    words = ["-sdf", "-database", model, "-model", name]
    return ["rosrun", "gazebo_ros", "spawn_model", *words, *_place_words(place)]


def _place_words(place: dict[str, float]) -> list[str]:
    return [word for axis, value in place.items() for word in (f"-{axis}", str(value))]


def zoom(page: Page, notches: int) -> None:
    """Turn the mouse's wheel over the picture; positive numbers zoom in."""
    for _ in range(abs(notches)):
        page.call(
            "Input.dispatchMouseEvent",
            type="mouseWheel",
            x=400,
            y=450,
            deltaX=0,
            deltaY=-100 if notches > 0 else 100,
        )


def turn(page: Page, x: int, y: int, *, is_moved: bool = False) -> None:
    """Turn the view by pixels of the mouse, or move it."""
    for kind, dx, dy in (("mousePressed", 0, 0), ("mouseMoved", x, y), ("mouseReleased", x, y)):
        page.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=400 + dx,
            y=450 + dy,
            button="left",
            buttons=0 if kind == "mouseReleased" else 1,
            clickCount=1,
            modifiers=SHIFT if is_moved else 0,
        )


def settle(page: Page, pictures: int = 12) -> None:
    """Wait until some more pictures are drawn, or two seconds."""
    page.evaluate(
        "new Promise(done => { const canvas = document.querySelector('canvas.stage');"
        f"const last = Number(canvas.dataset.drawn) + {pictures}, end = performance.now() + 2000;"
        "const look = () => Number(canvas.dataset.drawn) >= last || performance.now() > end"
        " ? done() : setTimeout(look, 50); look(); })"
    )


def show_arm(page: Page) -> None:
    """Select the arm, whose joints are held by controllers."""
    page.click(".sim-model .name", "arm")
    page.wait("return Number(document.querySelector('[data-joint=elbow] .num')?.textContent) > 1")
    zoom(page, 6)
    turn(page, 0, 190, is_moved=True)


def show_house(page: Page) -> None:
    """Show the rays of the robot in the house."""
    page.click(".sim-bar button", "Rays")
    page.click(".sim-model .name", "rover")
    page.wait("return document.querySelector('[data-joint=left_joint]')")
    page.click(".sim-side button", "Follow")
    zoom(page, 7)
    turn(page, 60, 40)


def show_contacts(page: Page) -> None:
    """Show the contacts of stacked cubes."""
    page.click(".sim-bar button", "Contacts")
    page.click(".sim-model .name", "cube_3")
    zoom(page, 11)
    turn(page, 0, -20)


SCENES = {
    "arm": Scene(
        [
            ["roslaunch", "two_link_arm_gazebo", "gazebo.launch", "gui:=false"],
            *(
                ["rostopic", "pub", "-r", "5", f"/{joint}_controller/command", "std_msgs/Float64", angle]
                for joint, angle in (("shoulder", "0.6"), ("elbow", "1.1"))
            ),
        ],
        show_arm,
    ),
    "house": Scene(
        [
            ["rosrun", "gazebo_ros", "gzserver", "worlds/house.world", "__name:=gazebo"],
            [
                *("rosrun", "gazebo_ros", "spawn_model", "-urdf", "-file", str(ROVER), "-model", "rover"),
                *_place_words({"x": 0.5, "y": -2.2, "z": 0.1}),
            ],
        ],
        show_house,
    ),
    "contacts": Scene(
        [
            ["rosrun", "gazebo_ros", "gzserver", "__name:=gazebo"],
            *(
                spawn("wood_cube_10cm", f"cube_{index}", x=0.02 * (index % 2), z=0.06 + 0.105 * index)
                for index in range(4)
            ),
            spawn("cricket_ball", "ball", x=0.12, y=0.14, z=0.05),
            spawn("red_cube", "red_cube", x=0.1, y=-0.14, z=0.05),
            spawn("coke_can", "can", x=-0.2, y=0.16, z=0.05),
        ],
        show_contacts,
    ),
}


@contextlib.contextmanager
def running(
    command: Sequence[str], environment: dict[str, str], log: io.TextIOBase
) -> Iterator[subprocess.Popen[str]]:
    """Run a program until the end of the block."""
    program = subprocess.Popen(command, env=environment, stdout=log, stderr=subprocess.STDOUT, text=True)
    try:
        yield program
    finally:
        program.terminate()
        program.wait(SECONDS)


def make(name: str, scene: Scene, folder: Path) -> Path:
    """Make one picture; return its file. Raise ValueError if it is too large."""
    from PIL import Image

    port, page_port = free_port(), free_port()
    tools = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}", "PATH": tools}
    with contextlib.ExitStack() as stack:
        log = stack.enter_context(tempfile.TemporaryFile("w+"))
        stack.enter_context(running(["roscore", "-p", str(port)], environment, log))  # type: ignore[arg-type]
        wait_until(lambda: _listens(port), SECONDS, "roscore does not start")
        for command in scene.commands:
            if "spawn_model" in command:
                subprocess.run(command, env=environment, check=True, stdout=log, stderr=log)
            else:
                stack.enter_context(running(command, environment, log))  # type: ignore[arg-type]
        window = [sys.executable, "-m", "minirospy", "dashboard", "simulation", "--no-browser"]
        pipe = subprocess.Popen(
            [*window, "--port", str(page_port)], env=environment, stdout=subprocess.PIPE, text=True
        )
        stack.callback(pipe.wait, SECONDS)
        stack.callback(pipe.terminate)
        assert pipe.stdout is not None
        url = pipe.stdout.readline().split()[-1]
        page = stack.enter_context(
            contextlib.closing(Page(url, width=WIDTH, height=HEIGHT, flags=("--enable-unsafe-swiftshader",)))
        )
        page.wait(
            "return document.querySelectorAll('.sim-model').length > 1 && document.querySelector('canvas.stage')"
        )
        settle(page)
        scene.act(page)
        settle(page, 20)
        shot = folder / f"{name}.png"
        page.screenshot(shot)
    file = folder / f"{name}.webp"
    with Image.open(shot) as picture:
        picture.convert("RGB").save(file, quality=QUALITY, method=6)
    shot.unlink()
    if file.stat().st_size > MAX_BYTES:
        raise ValueError(f"{file} is larger than {MAX_BYTES} bytes")
    return file


def _listens(port: int) -> bool:
    try:
        socket.create_connection(("localhost", port), SECONDS).close()
    except OSError:
        return False
    return True


def main() -> None:
    """Make all pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for name, scene in SCENES.items():
        file = make(name, scene, folder)
        print(f"{file} {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
