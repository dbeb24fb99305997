"""The error for meshes that cannot be read."""

from __future__ import annotations

from minirospy.base.errors import MinirospyError

__all__ = ["MeshError"]


class MeshError(MinirospyError):
    """Raised if a mesh is invalid, too large or in an unknown format. ``file`` is empty until the file reader sets it."""

    def __init__(self, why: str, file: str = "") -> None:
        super().__init__(why, file)
        self.why = why
        self.file = file

    def __str__(self) -> str:
        return f"{self.file}: {self.why}" if self.file else self.why
