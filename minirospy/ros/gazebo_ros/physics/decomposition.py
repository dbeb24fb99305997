"""Convex parts of hollow moving meshes. The library coacd computes them once, and they are stored in ROS_HOME."""

from __future__ import annotations

import hashlib
import importlib
import os
import time
import zipfile
from pathlib import Path

import numpy as np

from minirospy.base.installation import install_command
from minirospy.core.meshes.mesh import Mesh
from minirospy.workspace.folders import ros_home

__all__ = ["Decomposition"]

FOLDER = "convex_parts"  # in ROS_HOME
CONCAVITY = 0.05  # concavity threshold, relative to the mesh's size; coacd's default
MAX_TRIANGLES = 20_000  # decomposing a finer mesh would take minutes


class Decomposition:
    """Splits hollow meshes into convex parts. ``warnings`` names each split mesh; if coacd is missing, it says so once."""

    def __init__(self, warnings: list[str]) -> None:
        self._warnings = warnings
        self._is_told = False

    def split(self, mesh: Mesh, name: str, most: int) -> list[Mesh] | None:
        """Return at most ``most`` convex parts of a connected mesh, or None if the mesh is to be replaced by its convex hull."""
        data = mesh.vertices.tobytes() + mesh.triangles.tobytes() + f"{most} {CONCAVITY}".encode()
        path = Path(ros_home(), FOLDER, f"{hashlib.sha256(data).hexdigest()[:32]}.npz")
        try:
            with np.load(path) as kept:
                return [Mesh(kept[key], np.zeros((0, 3), np.int32)) for key in kept.files]
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            pass
        started = time.monotonic()
        parts = self._compute(mesh, name, most)
        if parts:
            self._warnings.append(
                f"the mesh {name} was split into {len(parts)} convex parts in {time.monotonic() - started:.0f} s"
            )
            _keep(path, parts)
        return parts or None

    def _compute(self, mesh: Mesh, name: str, most: int) -> list[Mesh]:
        try:
            coacd = importlib.import_module("coacd")
        except ImportError:
            why = install_command("coacd")
        else:
            why = f"it has more than {MAX_TRIANGLES} triangles"
            if len(mesh.triangles) <= MAX_TRIANGLES:
                try:
                    coacd.set_log_level("error")
                    found = coacd.run_coacd(
                        coacd.Mesh(mesh.vertices, mesh.triangles),
                        threshold=CONCAVITY,
                        max_convex_hull=most,
                    )
                    return [
                        Mesh(np.asarray(points, np.float64), np.zeros((0, 3), np.int32))
                        for points, _ in found
                    ]
                except Exception as error:  # noqa: BLE001 - the library raises errors of many types
                    why = f"coacd failed: {error}"
        if not self._is_told:
            self._is_told = True
            self._warnings.append(f"the mesh {name} moves and is hollow: its convex hull collides ({why})")
        return []


def _keep(path: Path, parts: list[Mesh]) -> None:
    """Write the parts to a cache file, if possible, without exposing an incomplete file to readers."""
    partial = path.with_name(f"{path.stem}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with partial.open("wb") as file:
            np.savez(file, *[part.vertices for part in parts])
        partial.replace(path)
    except OSError:
        partial.unlink(missing_ok=True)
