"""Virtual environments in build/ that contain third-party software from PyPI, for interop tests."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

__all__ = ["PeerEnvironment"]

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class PeerEnvironment:
    """A venv with packages. ``stamp`` is written when the venv is complete, and contains the packages' versions."""

    name: str
    packages: tuple[str, ...]

    @property
    def folder(self) -> Path:
        """Return the venv's folder, which depends on the Python version."""
        return ROOT / "build" / f"{self.name}-{sys.version_info[0]}.{sys.version_info[1]}"

    @property
    def python(self) -> Path:
        """Return the venv's interpreter."""
        return self.folder / "bin" / "python"

    @property
    def stamp(self) -> Path:
        """Return the file that exists once the environment is complete."""
        return self.folder / "installed"

    @property
    def is_complete(self) -> bool:
        """Return whether the environment has these packages."""
        return self.stamp.exists() and self.stamp.read_text() == "\n".join(self.packages)

    def create(self) -> bool:
        """Create the venv and install the packages; return whether pip succeeded."""
        print("Installing", self.packages[0].partition("==")[0], "and more from PyPI into", self.folder)
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(self.folder)], check=True)
        # Modules are compiled when they are first imported: most of them never are.
        options = ["-q", "--disable-pip-version-check", "--prefer-binary", "--no-compile"]
        command = [str(self.python), "-m", "pip", "install", *options, *self.packages]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    def complete(self) -> None:
        """Write the stamp."""
        self.stamp.write_text("\n".join(self.packages))
