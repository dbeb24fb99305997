"""A mesh of triangles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from minirospy.core.meshes.errors import MeshError
from minirospy.core.sdf.model import Color, Vector

__all__ = ["MAX_TRIANGLES", "Mesh", "MeshMaterial"]

MAX_TRIANGLES = 2_000_000  # maximum triangles per file; with more, the arrays and the data derived from them exceed a gigabyte


@dataclass(frozen=True)
class MeshMaterial:
    """A material: its name, diffuse colour and texture path (empty: no texture)."""

    name: str = ""
    color: Color | None = None
    texture: str = ""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices (n, 3) in metres, and triangles (m, 3) as vertex indices, counter-clockwise seen from outside.

    ``material_of`` (m,): each triangle's index in ``materials``. ``texcoords`` (m, 3, 2): each corner's texture coordinates, from
    0 to 1, with the origin at the lower left; None if the file has none.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    name: str = ""
    materials: tuple[MeshMaterial, ...] = (MeshMaterial(),)
    material_of: NDArray[np.int32] | None = None
    texcoords: NDArray[np.float32] | None = None

    @classmethod
    def checked(
        cls,
        vertices: NDArray[np.float64],
        triangles: NDArray[np.int32],
        name: str = "",
        materials: tuple[MeshMaterial, ...] = (MeshMaterial(),),
        material_of: NDArray[np.int32] | None = None,
        texcoords: NDArray[np.float32] | None = None,
    ) -> Mesh:
        """Return the mesh. Raise MeshError if an index or a coordinate is invalid, or if there are no triangles."""
        if not len(triangles):
            raise MeshError(f"the mesh '{name}' has no triangles" if name else "there are no triangles")
        if len(triangles) > MAX_TRIANGLES:
            raise MeshError(f"there are more than {MAX_TRIANGLES} triangles")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise MeshError("a triangle uses a vertex that does not exist")
        if not np.isfinite(vertices[np.unique(triangles)]).all() or abs(vertices[triangles]).max() > 1e30:
            raise MeshError("a coordinate is not a finite number")
        if texcoords is not None and not np.isfinite(texcoords).all():
            texcoords = None
        return cls(vertices, triangles, name, materials, material_of, texcoords)

    @classmethod
    def join(cls, meshes: Sequence[Mesh]) -> Mesh:
        """Return one mesh with the triangles of all meshes, without materials."""
        starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
        triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts[:-1].tolist(), strict=True)]
        return cls(
            np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles).astype(np.int32)
        )

    def transformed(self, matrix: NDArray[np.float64], offset: NDArray[np.float64]) -> Mesh:
        """Return the mesh with vertices ``matrix @ vertex + offset``. A mirroring matrix reverses the triangles' orientation."""
        triangles, texcoords = self.triangles, self.texcoords
        if np.linalg.det(matrix) < 0:
            triangles = np.ascontiguousarray(triangles[:, ::-1])
            texcoords = None if texcoords is None else np.ascontiguousarray(texcoords[:, ::-1])
        vertices = self.vertices @ matrix.T + offset
        return Mesh(vertices, triangles, self.name, self.materials, self.material_of, texcoords)

    @property
    def corners(self) -> NDArray[np.float64]:
        """Return the corners of the triangles (m, 3, 3)."""
        return self.vertices[self.triangles]

    @property
    def crosses(self) -> NDArray[np.float64]:
        """Return each triangle's normal vector (m, 3), whose length is twice the triangle's area."""
        corners = self.corners
        crosses: NDArray[np.float64] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return crosses

    def scaled(self, scale: Vector) -> Mesh:
        """Return the mesh scaled along each axis."""
        return self if scale == (1.0, 1.0, 1.0) else self.transformed(np.diag(scale), np.zeros(3))

    def by_material(self) -> Iterator[tuple[NDArray[np.int32], Color | None]]:
        """Yield the triangles of each material, with the material's colour."""
        for mesh in self.sections():
            yield mesh.triangles, mesh.materials[0].color

    def sections(self) -> Iterator[Mesh]:
        """Yield the triangles of each material as a mesh that shares the vertices."""
        if self.material_of is None or len(self.materials) <= 1:
            yield replace(self, materials=self.materials or (MeshMaterial(),))
            return
        for index, material in enumerate(self.materials):
            rows = np.flatnonzero(self.material_of == index)
            if len(rows):
                texcoords = None if self.texcoords is None else self.texcoords[rows]
                yield Mesh(self.vertices, self.triangles[rows], self.name, (material,), None, texcoords)
