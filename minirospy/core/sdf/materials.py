"""The colours of Gazebo's built-in materials, and materials from models' scripts (Ogre's ``.material`` files)."""

from __future__ import annotations

import os
import re
from pathlib import Path

from minirospy.core.sdf.model import Color, Material
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element

__all__ = ["named_material", "read_material"]

_MAX_SCRIPT_BYTES = 1024 * 1024
_MAX_SCRIPTS = 100  # maximum files per folder of a model's scripts
_PICTURES = (".jpg", ".jpeg", ".png")

_BLOCK = re.compile(r"^[ \t]*material\s+([^\s{:]+)\s*(?::[^\n{]*)?\s*\{", re.MULTILINE)
_COLOR = re.compile(r"^\s*(ambient|diffuse|emissive)\s+([\d.eE+\- \t]+)", re.MULTILINE)
_TEXTURE = re.compile(r"^\s*texture\s+(\S+)", re.MULTILINE)


# Diffuse colours, each with the names of its materials. A material with a texture has the texture's average colour.
_TABLE: dict[Color, str] = {
    (0.7, 0.7, 0.7, 1.0): "Grey Gray",
    (0.175, 0.175, 0.175, 1.0): "DarkGrey DarkGray",
    (0.8, 0.8, 0.8, 1.0): "LightGrey",
    (1.0, 1.0, 1.0, 1.0): "White JointAnchor",
    (0.1, 0.1, 0.1, 1.0): "FlatBlack",
    (0.0, 0.0, 0.0, 1.0): "Black",
    (1.0, 0.0, 0.0, 1.0): "Red",
    (0.87, 0.26, 0.07, 1.0): "RedBright",
    (0.0, 1.0, 0.0, 1.0): "Green",
    (0.0, 0.0, 1.0, 1.0): "Blue",
    (0.13, 0.44, 0.7, 1.0): "SkyBlue",
    (1.0, 1.0, 0.0, 1.0): "Yellow",
    (0.9725, 0.9529, 0.2078, 1.0): "ZincYellow",
    (0.7, 0.7, 0.0, 1.0): "DarkYellow",
    (1.0, 0.0, 1.0, 1.0): "Purple",
    (0.0, 1.0, 1.0, 1.0): "Turquoise",
    (1.0, 0.5088, 0.0468, 1.0): "Orange",
    (0.33, 0.0, 0.5, 1.0): "Indigo",
    (0.8, 0.64869, 0.120759, 1.0): "Gold",
    (0.681193, 0.000923, 0.000923, 1.0): "Pioneer2Body",
    (0.8, 0.1, 0.1, 1.0): "PioneerBody",
    (0.62, 0.44, 0.26, 1.0): "Wood WoodTexture",
    (0.55, 0.36, 0.2, 1.0): "WoodFloor",
    (0.7, 0.55, 0.35, 1.0): "WoodPallet",
    (0.6, 0.32, 0.25, 1.0): "Bricks",
    (0.85, 0.85, 0.82, 1.0): "CeilingTiled",
    (0.85, 0.82, 0.75, 1.0): "PaintedWall",
    (0.75, 0.75, 0.75, 1.0): "WindowFrame BuildingFrame",
    (0.25, 0.25, 0.25, 1.0): "Road Motorway Primary Secondary Lane_1 Lanes_2 Lanes_4 Lanes_6 Runway",
    (0.3, 0.3, 0.3, 1.0): "Residential Tertiary",
    (0.55, 0.55, 0.53, 1.0): "Pedestrian Footway Steps",
    (0.25, 0.45, 0.15, 1.0): "Grass",
    (0.4, 0.28, 0.18, 1.0): "Trunk",
    (0.9, 0.9, 0.3, 1.0): "CoM",
    (1.0, 0.0, 0.0, 0.5): "RedTransparent RedTransparentOverlay",
    (0.0, 1.0, 0.0, 0.5): "GreenTransparent GreenTransparentOverlay",
    (0.0, 0.0, 1.0, 0.5): "BlueTransparent BlueTransparentOverlay",
    (0.5, 0.5, 0.5, 0.5): "GreyTransparent",
    (0.0, 0.0, 0.0, 0.5): "BlackTransparent",
    (1.0, 1.0, 0.0, 0.5): "YellowTransparent",
    (1.0, 0.44, 0.0, 0.4): "OrangeTransparent",
    (0.6, 0.0, 0.6, 0.5): "DarkMagentaTransparent",
    (0.0, 0.0, 1.0, 0.4): "BlueLaser",
    (0.5, 0.5, 1.0, 0.4): "LightBlueLaser",
    (1.0, 0.5, 0.0, 0.5): "OrangeTransparentOverlay",
    (0.7, 0.35, 0.0, 0.5): "DarkOrangeTransparentOverlay",
}
_COLORS = {name: color for color, names in _TABLE.items() for name in names.split()}
_GLOWING = {
    f"{name}Glow": _COLORS[name]
    for name in ["White", "Red", "Green", "Blue", "Yellow", "Purple", "Turquoise"]
} | {
    "TurquoiseGlowOutline": _COLORS["Turquoise"],
    "LightOn": _COLORS["Green"],
    "LightOff": _COLORS["Red"],
}


def named_material(name: str) -> Material | None:
    """Return one of Gazebo's built-in materials, such as ``Gazebo/Grey``, or None if the name is unknown."""
    if name == "__default__":
        return Material(None, name)
    room, _, short = name.partition("/")
    if room != "Gazebo":
        return None
    if short in _GLOWING:
        return Material(_GLOWING[short], name, "", _GLOWING[short])
    return Material(_COLORS[short], name) if short in _COLORS else None


def read_material(element: Element, source: Source) -> Material:
    """Read ``<material>``: the script's colours, overridden by the element's own colours."""
    script = element.first("script")
    name = ""
    if script is not None:
        # Also accept the name as the text of ``<script>``, where it was before SDF 1.4.
        name = source.text(script, "name") or script.text.strip()
    known = named_material(name) if name else Material()
    if known is None and script is not None:
        known = _script_material(name, script, source)
    if known is None:
        source.warn(script, f"the material '{name}' does not exist: the part is grey")
        known = Material(None, name)

    color = source.color(element, "diffuse", None) or source.color(element, "ambient", None)
    emissive = source.color(element, "emissive", known.emissive)
    if emissive is not None and not any(emissive[:3]):
        emissive = None
    return Material(color or known.color, name, _map(element, source) or known.texture, emissive)


def _map(element: Element, source: Source) -> str:
    """Return the path of the texture in an ``<albedo_map>`` of ``<pbr>``, or "" if there is none."""
    pbr = element.first("pbr")
    for workflow in pbr.children if pbr else ():
        uri = source.text(workflow, "albedo_map")
        if uri:
            path = source.find(uri)
            if path is None:
                source.warn(workflow, f"the picture {uri} does not exist")
            return path or ""
    return ""


def _script_material(name: str, script: Element, source: Source) -> Material | None:
    """Return a material defined in the files or folders of the ``<uri>`` elements, or None."""
    paths = [path for uri in script.all("uri") if (path := source.find(uri.text))]
    for path in paths:
        for file in _scripts(path):
            found = _find_block(_text(file), name)
            if found is not None:
                folders = [
                    os.path.dirname(file),
                    *paths,
                    os.path.join(os.path.dirname(file), "..", "textures"),
                ]
                return _block_material(name, found, folders)
    return None


def _scripts(path: str) -> list[str]:
    if not os.path.isdir(path):
        return [path]
    try:
        names = sorted(name for name in os.listdir(path) if name.endswith(".material"))
    except OSError:
        return []
    return [os.path.join(path, name) for name in names[:_MAX_SCRIPTS]]


def _text(file: str) -> str:
    try:
        if os.path.getsize(file) > _MAX_SCRIPT_BYTES:
            return ""
        return Path(file).read_text("utf-8", "replace")
    except OSError:
        return ""


def _find_block(text: str, name: str) -> str | None:
    """Return the text between the braces of a material's definition, or None if the definition is missing."""
    for match in _BLOCK.finditer(text):
        if match.group(1) == name:
            level = 1
            for index in range(match.end(), len(text)):
                level += {"{": 1, "}": -1}.get(text[index], 0)
                if not level:
                    return text[match.end() : index]
            return text[match.end() :]
    return None


def _block_material(name: str, block: str, folders: list[str]) -> Material:
    colors: dict[str, Color] = {}
    for match in _COLOR.finditer(block):
        numbers = _numbers(match.group(2))
        if len(numbers) >= 3:
            red, green, blue = numbers[:3]
            colors.setdefault(match.group(1), (red, green, blue, numbers[3] if len(numbers) > 3 else 1.0))
    texture = _TEXTURE.search(block)
    picture = _picture(texture.group(1), folders) if texture else ""
    white = (1.0, 1.0, 1.0, 1.0) if picture else None
    emissive = colors.get("emissive")
    if emissive is not None and not any(emissive[:3]):
        emissive = None
    return Material(colors.get("diffuse") or colors.get("ambient") or white, name, picture, emissive)


def _numbers(text: str) -> list[float]:
    numbers = []
    for part in text.split():
        try:
            numbers.append(min(max(float(part), 0.0), 1.0))
        except ValueError:
            break
    return numbers


def _picture(name: str, folders: list[str]) -> str:
    for folder in folders:
        path = os.path.join(folder, name)
        if name.lower().endswith(_PICTURES) and os.path.isfile(path):
            return os.path.normpath(path)
    return ""
