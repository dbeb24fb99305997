"""Detect a Raspberry Pi. The virtual board does not control its physical pins."""

from __future__ import annotations

import sys
from pathlib import Path

from minirospy.base.installation import install_command

__all__ = ["model_name", "warn_of_missing_library"]

_MODEL_FILE = Path("/proc/device-tree/model")


def model_name(file: Path = _MODEL_FILE) -> str | None:
    """Return the Raspberry Pi's model, or None on any other computer."""
    try:
        name = file.read_bytes().rstrip(b"\0").decode(errors="replace")
    except OSError:
        return None
    return name if name.startswith("Raspberry Pi") else None


def warn_of_missing_library(file: Path = _MODEL_FILE) -> None:
    """If this is a Raspberry Pi, warn on stderr that the program controls only a virtual board."""
    name = model_name(file)
    if name is not None:
        print(
            f"RPi.GPIO: this {name}'s own pins are not used, the virtual board is; "
            f"for the real library: {install_command('minirospy[pi]')}",
            file=sys.stderr,
        )
