"""Parse STL files, binary and ASCII. Source: https://en.wikipedia.org/wiki/STL_(file_format)."""

from __future__ import annotations

import numpy as np

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import MAX_TRIANGLES, Mesh

__all__ = ["parse_stl"]

HEADER = 84  # bytes before the triangles: an 80-byte comment and the 4-byte number of triangles
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def parse_stl(data: bytes) -> Mesh:
    """Return the mesh, with equal vertices merged. Raise MeshError if the data is not STL or is incomplete."""
    count = int.from_bytes(data[80:HEADER], "little") if len(data) >= HEADER else 0
    needed = HEADER + count * RECORD.itemsize
    if len(data) >= HEADER and len(data) == needed:
        return _binary(data, count)
    # Some programs start binary files with "solid", and some append bytes after the last triangle.
    if data[:512].lstrip()[:5].lower() == b"solid" and b"facet" in data[:4096]:
        return _ascii(data)
    if len(data) < HEADER:
        raise MeshError("this is no STL file: it is shorter than a header")
    if len(data) < needed:
        found = (len(data) - HEADER) // RECORD.itemsize
        raise MeshError(f"this STL file is incomplete: {found} of {count} triangles")
    return _binary(data, count)


def _binary(data: bytes, count: int) -> Mesh:
    if count > MAX_TRIANGLES:
        raise MeshError(f"there are more than {MAX_TRIANGLES} triangles")
    records = np.frombuffer(data, RECORD, count, HEADER)
    return _merged(records["corners"].reshape(-1, 3).astype(np.float64))


def _ascii(data: bytes) -> Mesh:
    words = data.split()
    starts = [index for index, word in enumerate(words) if word.lower() == b"vertex"]
    if len(starts) > 3 * MAX_TRIANGLES:
        raise MeshError(f"there are more than {MAX_TRIANGLES} triangles")
    if len(starts) % 3:
        raise MeshError(f"this STL file is incomplete: {len(starts)} vertices are not triangles")
    try:
        corners = np.array([words[at + 1 : at + 4] for at in starts], dtype=np.float64)
    except ValueError:
        raise MeshError("a vertex of this STL file is not three numbers") from None
    return _merged(corners.reshape(-1, 3))


def _merged(corners: np.typing.NDArray[np.float64]) -> Mesh:
    vertices, indices = np.unique(corners, axis=0, return_inverse=True)
    return Mesh.checked(vertices, indices.reshape(-1, 3).astype(np.int32))
