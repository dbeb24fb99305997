"""Build the command line that adds a library to minirospy's own environment.

Environments created by pipx or uv have no `python -m pip`; pipx and uv have commands for this. Sources:
https://pipx.pypa.io and https://docs.astral.sh/uv/concepts/tools.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

__all__ = ["install_command"]

IS_WINDOWS = os.name == "nt"
_PIPX_FILE = "pipx_metadata.json"
_UV_FILE = "uv-receipt.toml"

_SHELLS_OWN = re.compile(r"[^\w./\\:~+-]")
"""Characters that are special in at least one of the shells."""


def install_command(*requirements: str, upgrade: bool = False) -> str:
    """Return the command line that installs requirements (``minirospy[web]``, ``lz4``) into minirospy's own environment.

    The command line works in sh, cmd.exe and PowerShell. ``upgrade``: replace an installed version that is too old.
    """
    # Import these modules here, because only this error message needs them.
    import importlib.util
    import sysconfig

    prefix = Path(sys.prefix)
    words = " ".join(_quoted(each) for each in requirements)
    option = " --upgrade" if upgrade else ""
    if (prefix / _PIPX_FILE).is_file():
        # Do not use `pipx inject`: pipx 1.7 thinks that minirospy itself is already injected, and does nothing.
        return f"pipx runpip {_quoted(prefix.name)} install{option} {words}"
    if (prefix / _UV_FILE).is_file():
        return _uv_tool_command(prefix / _UV_FILE, requirements, option)
    if importlib.util.find_spec("pip") is None:
        return f"uv pip install --python {_quoted_path(sys.executable)}{option} {words}"

    # If the environment is externally managed (PEP 668), pip requires this option, as it did to install minirospy.
    marker = Path(sysconfig.get_path("stdlib")) / "EXTERNALLY-MANAGED"
    if sys.prefix == sys.base_prefix and marker.is_file():
        option += " --break-system-packages"
    return f"{_python()} -m pip install{option} {words}"


def _uv_tool_command(receipt: Path, requirements: tuple[str, ...], option: str) -> str:
    """Return a `uv tool install` command that repeats all earlier requirements, because uv removes the ones not repeated."""
    try:
        text = receipt.read_text(encoding="utf-8").partition("entrypoints")[0]
    except OSError:
        text = ""
    extras: dict[str, None] = {}
    others: dict[str, None] = {}
    entries = re.findall(r'\{ name = "([^"]+)"(?:, extras = \[([^]]*)\])?(?:, specifier = "([^"]*)")?', text)
    for name, extra, specifier in [*entries, *map(_parts, requirements)]:
        names = dict.fromkeys(re.findall(r"[\w.-]+", extra))
        if name == "minirospy":
            extras |= names
        else:
            others[_requirement(name, names) + specifier] = None

    words = [_requirement("minirospy", extras), *others]
    return f"uv tool install{option} " + " --with ".join(_quoted(word) for word in words)


def _parts(requirement: str) -> tuple[str, str, str]:
    """Return a requirement's name, the text between its brackets, and its version range."""
    name, has_extras, rest = requirement.partition("[")
    if not has_extras:
        return name, "", ""
    extras, _, specifier = rest.partition("]")
    return name, extras, specifier


def _requirement(name: str, extras: dict[str, None]) -> str:
    return f"{name}[{','.join(extras)}]" if extras else name


def _python() -> str:
    """Return "python" or "python3" if that runs this interpreter, else the interpreter's path."""
    import shutil

    for name in ("python", "python3"):
        found = shutil.which(name)
        # Do not use os.path.samefile: a venv's interpreter may be a link to the system's.
        if found is not None and os.path.normcase(found) == os.path.normcase(sys.executable):
            return name
    return _quoted_path(sys.executable)


def _quoted(word: str) -> str:
    """Quote a word for any shell, with double quotes, because single quotes have no meaning in cmd.exe."""
    return f'"{word}"' if _SHELLS_OWN.search(word) else word


def _quoted_path(path: str) -> str:
    """Quote a program's path for the system's shells.

    On Windows only the parts that need it are quoted: cmd.exe and PowerShell both run ``C:\\"Program Files"\\python.exe``,
    but PowerShell parses a line that starts with a quote as an expression.
    """
    if not IS_WINDOWS:
        import shlex

        return shlex.quote(path)
    return "\\".join(_quoted(part) for part in path.split("\\"))
