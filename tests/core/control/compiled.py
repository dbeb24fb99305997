"""Compile C++ files of a git repository unmodified, with headers that replace the rest of ROS."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

__all__ = ["compile_program", "list_files", "output", "read_file"]


def list_files(repository: str, branch: str, folder: str) -> list[str]:
    """Return the paths of the files below a folder. ``repository``: a git directory."""
    return _git(repository, "ls-tree", "-r", "--name-only", branch, folder).split()


def read_file(repository: str, branch: str, path: str) -> str:
    """Return the text of a file. ``repository``: a git directory."""
    return _git(repository, "show", f"{branch}:{path}")


def compile_program(folder: Path, files: Mapping[str, str], flags: Iterable[str]) -> Path:
    """Write the files, compile each .cpp file, and return the program. ``files``: by path below ``folder``, the texts."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    sources = [folder / path for path in files if path.endswith(".cpp")]
    program = folder / "program"
    subprocess.run(["g++", "-w", "-std=c++17", f"-I{folder}", *sources, "-o", program, *flags], check=True)
    return program


def output(files: Mapping[str, str], flags: Iterable[str], *arguments: str) -> str:
    """Compile the files, and return what the program prints."""
    with tempfile.TemporaryDirectory() as folder:
        program = compile_program(Path(folder), files, flags)
        return subprocess.run([program, *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout


def _git(repository: str, *words: str) -> str:
    command = ["git", f"--git-dir={repository}", *words]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
