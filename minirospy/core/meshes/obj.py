"""Parse Wavefront OBJ files and their MTL files. Source: http://paulbourke.net/dataformats/obj, .../mtl."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import MAX_TRIANGLES, Mesh, MeshMaterial

__all__ = ["parse_mtl", "parse_obj"]

_Place = tuple[float, float]


def parse_obj(text: str, library: Callable[[str], str] = lambda name: "") -> list[Mesh]:
    """Return a mesh for each object (``o``). ``library`` returns the text of an MTL file, or an empty string.

    Polygons are divided into fans of triangles. Raise MeshError, with the line, if a vertex or face is invalid.
    """
    vertices: list[tuple[float, float, float]] = []
    places: list[tuple[float, float]] = []  # texture coordinates
    known: dict[str, MeshMaterial] = {}
    used: dict[str, int] = {}
    material, name, count = "", "", 0
    objects: dict[str, _Faces] = {}
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        keyword, values = words[0], words[1:]
        try:
            if keyword == "v":
                vertices.append((float(values[0]), float(values[1]), float(values[2])))
            elif keyword == "vt":
                places.append(_place(values))
            elif keyword == "f":
                corners = [_index(word.partition("/")[0], len(vertices)) for word in values]
                if len(corners) < 3:
                    raise ValueError
                faces = objects.setdefault(name, _Faces())
                faces.add(corners, _places(values, places), used.setdefault(material, len(used)))
                count += len(corners) - 2
            elif keyword == "o":
                name = " ".join(values)
            elif keyword == "usemtl":
                material = " ".join(values)
            elif keyword == "mtllib":
                known |= parse_mtl(library(" ".join(values)))
        except (ValueError, IndexError):
            raise MeshError(f"line {number} of this OBJ file is invalid: {line.strip()[:60]!r}") from None
        if count > MAX_TRIANGLES:
            raise MeshError(f"there are more than {MAX_TRIANGLES} triangles")

    if not objects:
        raise MeshError("this OBJ file has no faces")
    materials_used = tuple(known.get(each, MeshMaterial(each)) for each in used)
    points = np.array(vertices, np.float64).reshape(-1, 3)
    return [
        Mesh.checked(
            points,
            np.array(faces.triangles, np.int32),
            key,
            materials_used,
            np.array(faces.materials, np.int32),
            np.array(faces.places, np.float32) if faces.has_places else None,
        )
        for key, faces in objects.items()
    ]


@dataclass
class _Faces:
    """The triangles of one object, with each triangle's material index and each corner's texture coordinates."""

    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)
    places: list[tuple[_Place, _Place, _Place]] = field(default_factory=list)
    has_places: bool = False

    def add(self, corners: list[int], places: list[_Place] | None, material: int) -> None:
        """Add a polygon as a fan of triangles."""
        self.has_places = self.has_places or places is not None
        places = places or [(0.0, 0.0)] * len(corners)
        self.triangles += [(corners[0], second, third) for second, third in pairwise(corners[1:])]
        self.places += [(places[0], second, third) for second, third in pairwise(places[1:])]
        self.materials += [material] * (len(corners) - 2)


def _places(words: list[str], known: list[_Place]) -> list[_Place] | None:
    """Return the texture coordinates of a polygon's corners, or None if they are missing or invalid."""
    try:
        return [known[_index(word.split("/")[1], len(known))] for word in words]
    except (ValueError, IndexError):
        return None


def _place(values: list[str]) -> _Place:
    try:
        return float(values[0]), float(values[1]) if len(values) > 1 else 0.0
    except (ValueError, IndexError):
        return math.nan, math.nan  # the object then has no texture coordinates


def _index(word: str, count: int) -> int:
    """Return the 0-based index for a corner's index such as ``3`` or ``-1``. Raise ValueError if it does not exist."""
    index = int(word)
    index = index - 1 if index > 0 else count + index
    if not 0 <= index < count:
        raise ValueError
    return index


def parse_mtl(text: str) -> dict[str, MeshMaterial]:
    """Return the materials in an MTL file, by name. Invalid lines are ignored."""
    result: dict[str, MeshMaterial] = {}
    name, color, alpha, texture = "", (0.8, 0.8, 0.8), 1.0, ""
    for line in [*text.splitlines(), "newmtl"]:
        keyword, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        try:
            if keyword == "newmtl":
                if name:
                    result[name] = MeshMaterial(name, (*color, alpha), texture)
                name, color, alpha, texture = rest, (0.8, 0.8, 0.8), 1.0, ""
            elif keyword == "Kd":
                red, green, blue = (float(value) for value in rest.split()[:3])
                color = (red, green, blue)
            elif keyword == "d":
                alpha = float(rest.split()[-1])
            elif keyword == "Tr":
                alpha = 1.0 - float(rest.split()[-1])
            elif keyword == "map_Kd":
                texture = rest.split()[-1]
        except (ValueError, IndexError):
            continue
    return result
