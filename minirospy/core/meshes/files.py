"""Read mesh files from disk."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from minirospy.core.meshes.collada import parse_dae
from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import Mesh
from minirospy.core.meshes.obj import parse_obj
from minirospy.core.meshes.stl import parse_stl
from minirospy.core.sdf.model import Vector

__all__ = ["MAX_BYTES", "read_mesh"]

MAX_BYTES = 200_000_000  # maximum file size; a larger file needs gigabytes of memory
MAX_LIBRARY_BYTES = 1_000_000  # maximum size of an MTL file


def read_mesh(
    path: str, submesh: str = "", scale: Vector = (1.0, 1.0, 1.0), *, is_centered: bool = False
) -> list[Mesh]:
    """Return the meshes in a file: all nodes or objects, or only the one named ``submesh``, centred if requested.

    Raise MeshError, with the file's name, if the file cannot be read.
    """
    try:
        meshes = list(_read(path, Path(path).stat().st_mtime_ns))
        if submesh:
            names = sorted({mesh.name for mesh in meshes})
            meshes = [mesh for mesh in meshes if mesh.name == submesh]
            if not meshes:
                raise MeshError(f"there is no sub-mesh '{submesh}'; there are: {', '.join(names)[:200]}")
    except MeshError as error:
        raise MeshError(error.why, path) from None
    except OSError as error:
        raise MeshError(error.strerror or str(error), path) from None

    if is_centered:
        points = np.concatenate([mesh.vertices[mesh.triangles].reshape(-1, 3) for mesh in meshes])
        center = (points.min(axis=0) + points.max(axis=0)) / 2
        meshes = [replace(mesh, vertices=mesh.vertices - center) for mesh in meshes]
    return [mesh.scaled(scale) for mesh in meshes]


@lru_cache(maxsize=64)
def _read(path: str, changed: int) -> tuple[Mesh, ...]:
    file = Path(path)
    parse = _PARSERS.get(file.suffix.lower())
    if parse is None:
        raise MeshError(f"the format '{file.suffix}' is not supported: convert it to .stl, .obj or .dae")
    if file.stat().st_size > MAX_BYTES:
        raise MeshError(f"the file is larger than {MAX_BYTES // 1_000_000} MB")
    return tuple(_with_textures(mesh, file.parent) for mesh in parse(file.read_bytes(), file))


def _with_textures(mesh: Mesh, folder: Path) -> Mesh:
    """Return the mesh with the paths of its textures. Missing textures are removed."""
    if not any(material.texture for material in mesh.materials):
        return mesh
    materials = tuple(replace(each, texture=_picture(each.texture, folder)) for each in mesh.materials)
    return replace(mesh, materials=materials)


def _picture(name: str, folder: Path) -> str:
    """Return the path of the texture ``name`` of a mesh file in ``folder``, or "" if there is no such file.

    Gazebo's models store their textures in ``materials/textures``.
    """
    name = unquote(name.removeprefix("file://")).replace("\\", "/")
    if not name or "\0" in name:
        return ""
    for place in (folder, folder.parent / "materials" / "textures"):
        for path in (place / name, place / name.rpartition("/")[2]):
            if os.path.isfile(path):
                return str(path)
    return ""


def _stl(data: bytes, _: Path) -> list[Mesh]:
    return [parse_stl(data)]


def _obj(data: bytes, file: Path) -> list[Mesh]:
    def library(name: str) -> str:
        path = file.parent / name
        try:
            if path.stat().st_size <= MAX_LIBRARY_BYTES:
                return path.read_text(encoding="utf-8", errors="replace")
        except (OSError, ValueError):
            pass
        return ""

    return parse_obj(data.decode("utf-8", errors="replace"), library)


def _dae(data: bytes, _: Path) -> list[Mesh]:
    return parse_dae(data)


_PARSERS: dict[str, Callable[[bytes, Path], list[Mesh]]] = {".stl": _stl, ".obj": _obj, ".dae": _dae}
