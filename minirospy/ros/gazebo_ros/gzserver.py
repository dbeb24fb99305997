"""`rosrun gazebo_ros gzserver`: the node /gazebo. `gazebo`, `debug` and `gzclient` are variants of it.

Exit statuses: 0 after Ctrl-C or a shutdown request; 1 if the simulation library or world file is missing or invalid, or the
simulation failed; 2 for wrong arguments.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy import client as rospy
from minirospy.base.clock import SimulatedClock
from minirospy.base.errors import MinirospyError, SdfError
from minirospy.client.session import current_session
from minirospy.core.sdf.model import World
from minirospy.core.sdf.read import parse_world
from minirospy.ros.gazebo_ros.paths import ResourcePaths, resource_paths
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.loop import SimulationLoop
    from minirospy.ros.gazebo_ros.physics import Simulation

__all__ = ["ABOUT", "main", "new_parser", "read_world_file", "world_warnings"]

ABOUT = "minirospy's simulation (MuJoCo) under Gazebo's names"
DEFAULT_WORLD = "worlds/empty.world"


def new_parser(program: str) -> argparse.ArgumentParser:
    """Return a parser with Gazebo's options; the help of unsupported options says that they have no effect."""
    parser = argparse.ArgumentParser(prog=program, description=ABOUT)
    parser.add_argument("world", nargs="?", default=DEFAULT_WORLD, help="file of the world")
    parser.add_argument("-v", "--version", action="version", version=ABOUT)
    parser.add_argument("--verbose", action="store_true", help="log what is left out of models")
    parser.add_argument("-u", "--pause", action="store_true", help="start paused")
    parser.add_argument("-e", "--physics", default="ode", metavar="ENGINE", help="no effect: MuJoCo is used")
    parser.add_argument("-r", "--record", action="store_true", help="no effect: use rosbag record")
    parser.add_argument("--record_path", metavar="PATH", help="no effect")
    parser.add_argument("--seed", type=int, default=0, help="start of the random numbers for noise")
    parser.add_argument("--iters", type=int, default=0, metavar="N", help="end after N steps")
    parser.add_argument("--lockstep", action="store_true", help="no effect: sensors are always in step")
    for option in ("-s", "--server-plugin", "-g", "--gui-plugin"):
        parser.add_argument(option, action="append", default=[], metavar="FILE", help="no effect")
    return parser


def read_world_file(name: str, resources: ResourcePaths) -> World:
    """Return the world in a file. Raise SdfError if the file is missing or invalid."""
    path = resources.find_world(name)
    if path is None:
        raise SdfError(name, 0, "there is no such world file, here or below GAZEBO_RESOURCE_PATH")
    try:
        text = Path(path).read_bytes()
    except OSError as error:
        raise SdfError(path, 0, error.strerror or str(error)) from error
    return parse_world(text, resources.resolve, file=path)


def world_warnings(world: World) -> list[str]:
    """Return the warnings about a world and its models. A warning about several models appears once, with their number."""
    places: dict[str, list[str]] = {}
    for model in world.models:
        for line in model.warnings:
            place, _, text = line.partition(": ")
            places.setdefault(text or place, []).append(place)
    lines = list(world.warnings)
    for text, found in places.items():
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        lines.append(f"{found[0]}: {text}{more}")
    return lines


def main(program: str = "gzserver", argv: Sequence[str] | None = None) -> int:
    """Run the node until it shuts down; return the exit status."""
    words = list(rospy.myargv()[1:] if argv is None else argv)
    arguments = new_parser(program).parse_args([word for word in words if word])
    try:
        from minirospy.ros.gazebo_ros.physics import Simulation
        from minirospy.ros.gazebo_ros.physics.library import load_mujoco

        load_mujoco()
    except MinirospyError as error:
        print(error, file=sys.stderr)
        return 1

    packages = Packages()
    resources = resource_paths(os.environ, packages.folders().values(), packages.find)
    try:
        world = read_world_file(arguments.world, resources)
        simulation = Simulation(world, seed=arguments.seed)
    except MinirospyError as error:
        print(f"{program}: {error}", file=sys.stderr)
        return 1

    try:
        _start_node()
        for line in (*world_warnings(world), *simulation.warnings):
            rospy.logwarn("%s", line)
        loop = _run(simulation, world, resources, paused=arguments.pause, steps=arguments.iters)
        return 1 if loop.failure is not None else 0
    except rospy.ROSInterruptException:
        pass
    except rospy.ROSException as error:
        print(f"{program}: {error}", file=sys.stderr)
        return 1
    return 0


def _start_node() -> None:
    """Start the node /gazebo, and set /use_sim_time if it is not set."""
    # This process sets its own clock, so it does not subscribe to /clock.
    rospy.init_node("gazebo", disable_rostime=True)
    rospy.loginfo("%s", ABOUT)
    if not rospy.has_param("/use_sim_time"):
        rospy.set_param("/use_sim_time", True)


def _run(
    simulation: Simulation, world: World, resources: ResourcePaths, *, paused: bool, steps: int
) -> SimulationLoop:
    from minirospy.ros.gazebo_ros.loop import SimulationLoop
    from minirospy.ros.gazebo_ros.physics_services import PhysicsServices
    from minirospy.ros.gazebo_ros.reconfigure import PhysicsReconfigure
    from minirospy.ros.gazebo_ros.server import Server
    from minirospy.ros.gazebo_ros.state_services import StateServices

    clock = None
    if rospy.get_param("/use_sim_time"):
        session = current_session()
        clock = session.clock = SimulatedClock(changed=session.time_changed)
    rate = rospy.get_param("~pub_clock_frequency", 0)
    has_network = bool(rospy.get_param("~enable_ros_network", True))
    loop = SimulationLoop(simulation, paused=paused, tick_rate=float(rate) if _is_number(rate) else 0.0)
    server = Server(loop, world, resources, clock, only_clock=not has_network)
    loop.start()
    try:
        loop.call(lambda: server.start(world))
        if has_network:
            StateServices(server)
            PhysicsReconfigure(server, PhysicsServices(server))
            rospy.loginfo("Physics dynamic reconfigure ready.")
        else:
            rospy.loginfo("ROS gazebo topics/services are disabled")
        if steps:
            loop.end_after(steps, lambda: rospy.signal_shutdown("all steps are done"))
        rospy.spin()
    finally:
        server.close()
    return loop


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0
