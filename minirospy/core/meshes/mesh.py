"""A mesh of triangles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from minirospy.core.meshes.errors import MeshError
from minirospy.core.sdf.model import Color, Vector

__all__ = ["MAX_TRIANGLES", "Mesh", "MeshMaterial"]

MAX_TRIANGLES = 2_000_000  # per file; the arrays of a larger one, and what is made of them, exceed a gigabyte


@dataclass(frozen=True)
class MeshMaterial:
    """A material: its name, diffuse colour, and the texture's path as the file names it."""

    name: str = ""
    color: Color | None = None
    texture: str = ""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices (n, 3) in metres, triangles (m, 3) as indices of vertices, counter-clockwise seen from outside.

    ``material_of`` (m,) has each triangle's index in ``materials``.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    name: str = ""
    materials: tuple[MeshMaterial, ...] = (MeshMaterial(),)
    material_of: NDArray[np.int32] | None = None

    @classmethod
    def checked(
        cls,
        vertices: NDArray[np.float64],
        triangles: NDArray[np.int32],
        name: str = "",
        materials: tuple[MeshMaterial, ...] = (MeshMaterial(),),
        material_of: NDArray[np.int32] | None = None,
    ) -> Mesh:
        """Return the mesh. Raise MeshError if an index or a coordinate is invalid, or if there is no triangle."""
        if not len(triangles):
            raise MeshError(f"the mesh '{name}' has no triangles" if name else "there are no triangles")
        if len(triangles) > MAX_TRIANGLES:
            raise MeshError(f"there are more than {MAX_TRIANGLES} triangles")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise MeshError("a triangle uses a vertex that does not exist")
        if not np.isfinite(vertices[np.unique(triangles)]).all() or abs(vertices[triangles]).max() > 1e30:
            raise MeshError("a coordinate is not a finite number")
        return cls(vertices, triangles, name, materials, material_of)

    @classmethod
    def join(cls, meshes: Sequence[Mesh]) -> Mesh:
        """Return one mesh with the triangles of all, without their materials."""
        starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
        triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts[:-1].tolist(), strict=True)]
        return cls(
            np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles).astype(np.int32)
        )

    def transformed(self, matrix: NDArray[np.float64], offset: NDArray[np.float64]) -> Mesh:
        """Return the mesh with ``matrix @ vertex + offset``; a mirroring matrix turns the triangles around."""
        triangles = self.triangles
        if np.linalg.det(matrix) < 0:
            triangles = np.ascontiguousarray(triangles[:, ::-1])
        vertices = self.vertices @ matrix.T + offset
        return Mesh(vertices, triangles, self.name, self.materials, self.material_of)

    def scaled(self, scale: Vector) -> Mesh:
        """Return the mesh, scaled along the axes."""
        return self if scale == (1.0, 1.0, 1.0) else self.transformed(np.diag(scale), np.zeros(3))

    def by_material(self) -> Iterator[tuple[NDArray[np.int32], Color | None]]:
        """Yield the triangles of each material, with its colour."""
        if self.material_of is None or len(self.materials) <= 1:
            yield self.triangles, self.materials[0].color if self.materials else None
            return
        for index, material in enumerate(self.materials):
            triangles = self.triangles[self.material_of == index]
            if len(triangles):
                yield triangles, material.color
