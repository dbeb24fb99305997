"""`minirospy python FILE`, which users need if minirospy is in its own environment."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

BIN = Path(sys.executable).parent


def run(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([BIN / "minirospy", "python", *words], capture_output=True, text=True, check=False)


def test_program_runs_in_the_python_of_minirospy(tmp_path: Path) -> None:
    program = tmp_path / "node.py"
    program.write_text("import rospy, sys; print(sys.executable, sys.argv[1:]); sys.exit(3)")
    done = run(str(program), "a:=b", "-h")
    assert (done.returncode, done.stdout, done.stderr) == (3, f"{sys.executable} ['a:=b', '-h']\n", "")


def test_options_are_those_of_python() -> None:
    assert run("-c", "print(6 * 7)").stdout == "42\n"
    assert run("-m", "no_such_module").returncode == 1


def test_help_names_what_may_follow() -> None:
    done = run("-h")
    assert done.returncode == 0
    assert done.stdout.startswith("usage: minirospy python [FILE [ARGS]]\n")
