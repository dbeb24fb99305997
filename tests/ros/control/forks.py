"""Run programs in processes that already have the controllers' modules: importing them takes longer than most programs.

A server process imports them once, and forks a process for each program. The node, the master and the environment of a program
are its own. Where Python cannot fork safely, each program is started as usual.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

__all__ = ["end_server", "run_program"]

_TIMEOUT_SECONDS = 100  # of one program, where it is started as usual; else pytest's own limit ends it
_ROOT = Path(__file__).parents[3]

_SERVER = """
import gc, json, os, sys
import rospy, actionlib, dynamic_reconfigure.client, rospy_message_converter.message_converter
import ackermann_steering_controller, controller_interface, diff_drive_controller, effort_controllers
import force_torque_sensor_controller, gripper_action_controller, imu_sensor_controller, joint_state_controller
import joint_trajectory_controller, position_controllers, velocity_controllers
import controller_manager.controller_manager_interface, controller_manager_msgs.srv
import nav_msgs.msg, diagnostic_msgs.msg, rosgraph_msgs.msg, tf.msg
import minirospy.core.control.loopback, minirospy.core.urdf.read

# A program's garbage collection, above all the one at its end, would otherwise visit all objects of these modules.
gc.collect()
gc.freeze()
while True:
    line = sys.stdin.readline()
    if not line:
        os._exit(0)
    child = os.fork()
    if child == 0:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)

program, folder, environment, *files = json.loads(line)
os.chdir(folder)
os.environ.clear()
os.environ.update(environment)
for number, file in enumerate((os.devnull, *files)):
    os.dup2(os.open(file, os.O_RDWR | os.O_CREAT), number)
exec(compile(program, "<string>", "exec"), {"__name__": "__main__"})
"""

_servers: list[subprocess.Popen[str]] = []


def run_program(program: str, folder: Path = _ROOT) -> subprocess.CompletedProcess[str]:
    """Run Python code with this process's environment; return its status and output."""
    command = [sys.executable, "-c", program]
    if sys.platform != "linux":
        return subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=_TIMEOUT_SECONDS, check=False
        )
    if not _servers:
        started = [sys.executable, "-c", _SERVER]
        pipe = subprocess.PIPE
        _servers.append(
            subprocess.Popen(started, cwd=_ROOT, stdin=pipe, stdout=pipe, text=True, start_new_session=True)
        )
    server = _servers[0]
    assert server.stdin
    assert server.stdout
    with tempfile.TemporaryDirectory() as name:
        files = [Path(name) / "stdout", Path(name) / "stderr"]
        request = [program, str(folder), dict(os.environ), *map(str, files)]
        print(json.dumps(request), file=server.stdin, flush=True)
        status = int(server.stdout.readline())
        output, errors = (file.read_text() for file in files)
    return subprocess.CompletedProcess(command, status, output, errors)


def end_server() -> None:
    """End the server, and a program that still runs."""
    while _servers:
        server = _servers.pop()
        os.killpg(server.pid, signal.SIGKILL)
        server.wait()
        for pipe in (server.stdin, server.stdout):
            if pipe:
                pipe.close()
