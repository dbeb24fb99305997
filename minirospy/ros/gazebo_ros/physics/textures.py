"""Pictures on visible shapes, as MuJoCo materials."""

from __future__ import annotations

from typing import Any

from minirospy.ros.gazebo_ros.physics.library import load_mujoco

__all__ = ["Textures"]

MAX_PIXELS = 1024  # maximum pixels per side; larger pictures are scaled down: cameras cannot show more
SIDES = (90, 270, 180, 0, 0, 180)  # degrees by which a cube's pictures at x, -x, y, -y, z and -z are turned
MAX_AREA = 60_000_000  # maximum pixels per file; larger files take seconds to read


class Textures:
    """Adds each picture to an MjSpec once. An unreadable picture causes one warning and is left out."""

    def __init__(self, spec: Any, warnings: list[str]) -> None:
        self._spec = spec
        self._names: dict[tuple[str, bool], str] = {}
        self._warnings = warnings

    def material(self, path: str, *, is_flat: bool) -> str:
        """Return the name of a picture's material, or an empty string if the picture is unreadable.

        ``is_flat``: the picture is applied to a plane, or to a mesh by its texture coordinates. On all other shapes it is
        repeated on six sides.
        """
        key = (path, is_flat)
        if path and key not in self._names:
            try:
                self._names[key] = self._add(path, is_flat)
            except (OSError, ValueError, SyntaxError) as error:
                self._names[key] = ""
                line = f"the picture {path} is not shown: {error}"
                if line not in self._warnings:
                    self._warnings.append(line)
        return self._names.get(key, "")

    def _add(self, path: str, is_flat: bool) -> str:
        """Add a texture and its material. Raise OSError, ValueError or SyntaxError, like Pillow, if the file is unreadable."""
        try:
            from PIL import Image
        except ImportError:
            raise ValueError("textures need the library Pillow: minirospy[images]") from None
        try:
            opened = Image.open(path)
        except Image.DecompressionBombError as error:
            raise ValueError(str(error)) from None
        with opened as picture:
            width, height = picture.size
            if width * height > MAX_AREA:
                raise ValueError(f"it has {width} x {height} pixels")
            pixels = picture.convert("RGB")
        pixels.thumbnail((MAX_PIXELS, MAX_PIXELS))
        if not is_flat:
            side = max(pixels.size)
            pixels = pixels.resize((side, side))

        mujoco = load_mujoco()
        name = f"picture{len(self._names)}"
        kind = mujoco.mjtTexture.mjTEXTURE_2D if is_flat else mujoco.mjtTexture.mjTEXTURE_CUBE
        texture = self._spec.add_texture(name=name, type=kind)
        turns = (0,) if is_flat else SIDES
        texture.width, texture.height, texture.nchannel = pixels.width, pixels.height * len(turns), 3
        texture.data = b"".join(pixels.rotate(turn).tobytes() for turn in turns)
        material = self._spec.add_material(name=name)
        roles = material.textures
        roles[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
        material.textures = roles
        return name
