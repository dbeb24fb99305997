"""notebook: cells of a real Jupyter kernel, and the dashboard that a cell shows."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import psutil
import pytest

from minirospy.base.errors import MinirospyError
from minirospy.notebook import view
from tests.waiting import wait_until

FIRST_STEPS = Path(__file__).parents[2] / "docs/notebooks/first_steps.ipynb"
RUN = """
import json, sys
from nbclient import NotebookClient
from nbformat import v4

cells = json.load(sys.stdin)
notebook = v4.new_notebook(cells=[v4.new_code_cell(cell) for cell in cells])
client = NotebookClient(notebook, timeout=120, allow_errors=True, kernel_name="python3")
client.execute()
print(json.dumps([cell.outputs for cell in notebook.cells]))
"""
INTERRUPT = """
import os, signal, sys, threading, time
def interrupt():
    "Interrupt the kernel, as its button does, once the cell waits in rospy.spin()."
    names = set()
    while not {"threading.wait", "minirospy.base.clock.wait"} & names or "minirospy.client.lifecycle.spin" not in names:
        time.sleep(0.01)
        frame, names = sys._current_frames()[threading.main_thread().ident], set()
        while frame:
            names.add(frame.f_globals["__name__"] + "." + frame.f_code.co_name)
            frame = frame.f_back
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt).start()
rospy.spin()
"""


def run_cells(*cells: str) -> list[list[dict[str, Any]]]:
    """Run cells in a new kernel; return the outputs of each cell."""
    pytest.importorskip("nbclient", reason="nbclient is not installed")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    ended = subprocess.run(
        [sys.executable, "-c", RUN],
        input=json.dumps(cells),
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return list(json.loads(ended.stdout.splitlines()[-1]))


def test_cells_show_messages_and_log_lines_and_survive_interrupts(master: str) -> None:
    outputs = run_cells(
        "%load_ext minirospy.notebook\nimport rospy\nfrom std_msgs.msg import String\nrospy.init_node('cells')",
        "String('hello')",
        "rospy.loginfo('from a cell')",
        INTERRUPT,
        "rospy.is_shutdown()",
        "%unload_ext minirospy.notebook\nString('plain')",
        INTERRUPT,
        "rospy.is_shutdown()",
    )
    assert outputs[0] == []
    assert "<caption>std_msgs/String</caption>" in outputs[1][0]["data"]["text/html"]
    assert outputs[2][0]["text"].endswith("from a cell\n")
    assert outputs[3][0]["ename"] == "KeyboardInterrupt"
    assert outputs[4][0]["data"]["text/plain"] == "False"
    assert list(outputs[5][0]["data"]) == ["text/plain"]
    # Without the extension, an interrupt in spin() shuts the node down, as in ROS.
    assert outputs[6] == []
    assert outputs[7][0]["data"]["text/plain"] == "True"


def test_first_steps_run_from_the_top(master: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = json.loads(FIRST_STEPS.read_text(encoding="utf-8"))
    monkeypatch.chdir(tmp_path)
    outputs = run_cells(
        *("".join(each["source"]) for each in notebook["cells"] if each["cell_type"] == "code")
    )
    errors = [each for cell in outputs for each in cell if each["output_type"] == "error"]
    assert errors == []
    table = outputs[-2][0]["data"]["text/plain"]
    assert re.search(r"^count +40\.0+$", table, flags=re.MULTILINE), table


SHOW = """
import os, sys
from minirospy.notebook import view
print(view("plot", path="/odom/x", height=100)._repr_html_(), flush=True)
print(view("graph").url, flush=True)
sys.stdin.read()
"""


def test_view_is_embedded_and_its_dashboard_ends_with_a_killed_kernel(master: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", SHOW], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as kernel:
        assert kernel.stdout
        html, url = kernel.stdout.readline(), kernel.stdout.readline().strip()
        (dashboard,) = psutil.Process(kernel.pid).children()
        try:
            base, _, fragment = url.partition("#")
            assert f'<iframe src="{base}#/plot?path=/odom/x&amp;token=' in html
            assert fragment.startswith("/graph?token=")
            with urllib.request.urlopen(base, timeout=30) as answer:
                policy = answer.headers["Content-Security-Policy"]
            assert "frame-ancestors http://localhost:* http://127.0.0.1:*" in policy
        finally:
            kernel.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)
    wait_until(lambda: not dashboard.is_running() or dashboard.status() == psutil.STATUS_ZOMBIE)


@pytest.mark.skipif(sys.platform == "win32", reason="process groups")
def test_dashboard_survives_an_interrupt_of_the_kernel_and_its_group(master: str) -> None:
    program = SHOW.replace("sys.stdin.read()", "os.write(1, sys.stdin.readline().encode())")
    with subprocess.Popen(
        [sys.executable, "-c", f"import signal; signal.signal(signal.SIGINT, lambda *_: None)\n{program}"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as kernel:
        assert kernel.stdout
        assert kernel.stdin
        kernel.stdout.readline()
        base = kernel.stdout.readline().partition("#")[0]
        (dashboard,) = psutil.Process(kernel.pid).children()
        assert os.getpgid(dashboard.pid) != os.getpgid(kernel.pid)
        os.killpg(kernel.pid, signal.SIGINT)
        with urllib.request.urlopen(base, timeout=30) as answer:
            assert answer.status == 200
        kernel.stdin.close()


def test_view_without_a_master_says_so() -> None:
    environ = {**os.environ, "ROS_MASTER_URI": "http://localhost:1"}
    with subprocess.Popen(
        [sys.executable, "-c", SHOW], env=environ, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as kernel:
        assert kernel.stdout
        kernel.stdout.readline()
        base, _, token = kernel.stdout.readline().strip().partition("#/graph?token=")
        request = urllib.request.Request(f"{base}status", headers={"Authorization": f"Bearer {token}"})
        with pytest.raises(urllib.error.HTTPError, match="503") as refused:
            urllib.request.urlopen(request, timeout=30)
        assert b"no ROS master answers at http://localhost:1" in refused.value.read()
        assert kernel.stdin
        kernel.stdin.close()


def test_dashboard_that_cannot_start_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "localhost")
    with pytest.raises(MinirospyError, match=r"the dashboard did not start: .*ROS_MASTER_URI"):
        view("plot")


def test_view_that_does_not_exist_is_named() -> None:
    with pytest.raises(MinirospyError, match=r"there is no view 'plt'; did you mean plot\?"):
        view("plt")
