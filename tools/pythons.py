"""Run the fast tests on every Python from 3.10 on: `make pythons`, or `python tools/pythons.py [-- ARGUMENT ...]`.

Each version gets an environment in build/pythons, and runs the tests with `-X dev`, so that a test fails if it leaves a
socket or file open. Arguments select versions (`python tools/pythons.py 3.10 3.14t`, or `oldest newest`), or name an
interpreter's path. Arguments after `--` are passed to pytest. The exit status is 1 if a test failed on any version.
With `--install`, it only creates the environments.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tools.release import find_pythons

ROOT = Path(__file__).parents[1]

FOLDER = ROOT / "build" / "pythons"


def main(words: Sequence[str]) -> int:
    """Run the tests; return the exit status."""
    split = list(words).index("--") if "--" in words else len(words)
    chosen, arguments = [word for word in words[:split] if word != "--install"], list(words[split + 1 :])
    pythons = [word for word in chosen if os.sep in word]
    names = [word for word in chosen if os.sep not in word]
    found = find_pythons() if names or not chosen else {}
    try:
        pythons += [found[name] for name in (choose(names, list(found)) if names else found)]
    except LookupError as error:
        sys.exit(error.args[0])

    if "--install" in words[:split]:
        for python in pythons:
            make_environment(python, _version(python))
        return 0
    failed = []
    for python in pythons:
        label = _version(python)
        start = time.monotonic()
        passed = _run_tests(make_environment(python, label), arguments)
        print(
            f"Python {label}: {'passed' if passed else 'FAILED'} in {time.monotonic() - start:.0f} s",
            flush=True,
        )
        if not passed:
            failed.append(label)
    if failed:
        print(f"failed on Python {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def choose(words: Sequence[str], found: Sequence[str]) -> list[str]:
    """Return the versions selected by ``words`` from the sorted ones that were found.

    Raise LookupError if one was not found.
    """
    with_gil = [name for name in found if not name.endswith("t")] or list(found)
    names = {{"oldest": with_gil[0], "newest": with_gil[-1]}.get(word, word) for word in words}
    if missing := names - set(found):
        raise LookupError(f"not found: {', '.join(sorted(missing))}; there are {', '.join(found)}")
    return [name for name in found if name in names]


def _version(python: str) -> str:
    """Return a name such as 3.13.0, or 3.14.0t for a build without the GIL."""
    code = "import sys, sysconfig as s; print(sys.version.split()[0] + 't' * bool(s.get_config_var('Py_GIL_DISABLED')))"
    return subprocess.run([python, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def make_environment(python: str, label: str) -> Path:
    """Return the interpreter of an environment with this checkout and its test dependencies.

    The environment is created once.
    """
    folder = FOLDER / label
    inner = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = folder / ".installed"
    if not stamp.exists() or stamp.stat().st_mtime < (ROOT / "pyproject.toml").stat().st_mtime:
        subprocess.run([python, "-m", "venv", "--clear", str(folder)], check=True)
        # Modules are compiled when they are first imported: most of them never are.
        pip = [str(inner), "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-compile"]
        subprocess.run([*pip, "--editable", f"{ROOT}[dev]"], check=True)
        stamp.touch()
    return inner


def _run_tests(python: Path, arguments: list[str]) -> bool:
    options = ["-q", "-p", "no:cacheprovider", "-n", "2", "--dist", "worksteal"]
    command = [str(python), "-X", "dev", "-m", "pytest", *options, *arguments]
    environ = {name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "PYTHON"))}
    # The fast tests do not import every module, and a newer Python's syntax is an error on an older one.
    compiled = subprocess.run(
        [str(python), "-m", "compileall", "-q", "minirospy"], cwd=ROOT, env=environ, check=False
    )
    if compiled.returncode:
        return False
    return subprocess.run(command, cwd=ROOT, env=environ, check=False).returncode == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
