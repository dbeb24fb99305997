"""catkin.environment_cache: generates a script that repeats the environment changes of another script."""

from __future__ import annotations

import json
import os
import subprocess
import sys

__all__ = ["generate_environment_script"]

_HEADER = """\
{start}
{comment} generated from catkin/python/catkin/environment_cache.py

{comment} based on a snapshot of the environment before and after calling the setup script
{comment} it emulates the modifications of the setup script without recurring computations
"""
_IS_WINDOWS = sys.platform == "win32"


def generate_environment_script(env_script: str) -> list[str]:
    """Return the lines of a script that sets the variables that ``env_script`` adds or changes.

    ``env_script``, such as devel/env.sh, runs the command in its arguments. If a new value ends with the old value, the script
    refers to the old value by its variable. Raise subprocess.CalledProcessError if ``env_script`` fails, OSError if it cannot be
    run.
    """
    program = "import json, os; print(json.dumps(dict(os.environ)))"
    output = subprocess.run(
        [env_script, sys.executable, "-c", program], check=True, stdout=subprocess.PIPE, encoding="utf-8"
    ).stdout
    after: dict[str, str] = json.loads(output)
    before = dict(os.environ)

    comment = "REM" if _IS_WINDOWS else "#"
    start = "@echo off" if _IS_WINDOWS else "#!/usr/bin/env sh"
    lines = _HEADER.format(start=start, comment=comment).splitlines()
    lines += ["", f"{comment} new environment variables"]
    lines += [_assignment(name, _quoted(after[name])) for name in sorted(after.keys() - before.keys())]
    lines += ["", f"{comment} modified environment variables"]
    changed = sorted(name for name in after.keys() & before.keys() if after[name] != before[name])
    lines += [_assignment(name, _changed(name, before[name], after[name])) for name in changed]
    return lines


def _changed(name: str, old: str, new: str) -> str:
    if not new.endswith(os.pathsep + old):
        return _quoted(new)
    added = new[: len(new) - len(old)]
    return f"{added}%{name}%" if _IS_WINDOWS else f'"{added}${name}"'


def _quoted(value: str) -> str:
    """Return a value quoted for the shell. As in catkin, a value that is already in double quotes stays unchanged."""
    if _IS_WINDOWS or (value.startswith('"') and value.endswith('"')):
        return value
    return "'" + value.replace("'", "'\\''") + "'"


def _assignment(name: str, value: str) -> str:
    return f"set {name}={value}" if _IS_WINDOWS else f"export {name}={value}"
