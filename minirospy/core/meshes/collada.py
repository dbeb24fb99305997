"""Parse Collada files (DAE): geometry, material colours, the scene's transforms and units.

Animations, skins, cameras and lights are ignored. So is ``up_axis``, as in Gazebo and RViz: files of robots have z up, whatever
``up_axis`` says. Source: https://www.khronos.org/files/collada_spec_1_4.pdf.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from minirospy.base.xml_text import XmlElement, XmlError, parse_xml
from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import MAX_TRIANGLES, Mesh, MeshMaterial

__all__ = ["parse_dae"]

MAX_NODES = 20_000  # maximum node instances, because nodes that instantiate each other multiply
MAX_DEPTH = 100  # maximum nesting depth of nodes
PRIMITIVES = ("triangles", "polylist", "polygons", "trifans", "tristrips")
Matrix = NDArray[np.float64]
Texcoords = NDArray[np.float32]


def parse_dae(data: bytes) -> list[Mesh]:
    """Return the meshes of the scene in metres. Each mesh has the name of its node.

    Raise MeshError if the data is not Collada, refers to missing parts, or is too large.
    """
    end = re.search(rb"</COLLADA\s*>", data)
    if end and end.end() < len(data):
        data = data[: end.end()]  # text after the end is ignored, as in ROS
    try:
        root = parse_xml(data)
    except XmlError as error:
        raise MeshError(f"this is no Collada file: {error}") from None
    if _tag(root) != "COLLADA":
        raise MeshError(f"this is no Collada file: it begins with <{root.tag[:40]}>")
    try:
        return _Reader(root).meshes()
    except MeshError:
        raise
    except (ValueError, IndexError, OverflowError) as error:
        raise MeshError(f"this Collada file is broken: {error}") from error


class _Part(NamedTuple):
    """The triangles of one material, with its symbol. texcoords (n, 3, 2): the corners' texture coordinates, or None."""

    symbol: str
    vertices: Matrix
    triangles: NDArray[np.int32]
    texcoords: Texcoords | None


class _Reader:
    def __init__(self, root: XmlElement) -> None:
        self._root = root
        self._by_id: dict[str, XmlElement] = {}
        waiting = [root]
        while waiting:
            element = waiting.pop()
            if "id" in element.attributes:
                self._by_id.setdefault(element.attributes["id"], element)
            waiting.extend(element.children)
        self._geometries: dict[str, list[_Part]] = {}
        self._nodes = 0
        self._triangles = 0

    def meshes(self) -> list[Mesh]:
        """Return the meshes of the scene, or all geometries if the file has no scene."""
        asset = _child(self._root, "asset")
        unit = _child(asset, "unit") if asset else None
        scale = float(unit.attributes.get("meter", "1")) if unit else 1.0
        whole = np.diag([scale, scale, scale, 1.0])

        result: list[Mesh] = []
        scene = _child(self._root, "scene")
        visual = self._target(_child(scene, "instance_visual_scene") if scene else None)
        if visual is None:
            visual = next(
                (
                    each
                    for library in _children(self._root, "library_visual_scenes")
                    for each in library.children
                ),
                None,
            )
        if visual is not None:
            for node in _children(visual, "node"):
                self._read_node(node, whole, result, 0)
        else:
            for library in _children(self._root, "library_geometries"):
                for geometry in _children(library, "geometry"):
                    self._add(geometry, geometry.attributes.get("name", ""), {}, whole, result)
        if not result:
            raise MeshError("this Collada file has no triangles")
        return result

    def _read_node(self, node: XmlElement, above: Matrix, result: list[Mesh], depth: int) -> None:
        self._nodes += 1
        if self._nodes > MAX_NODES or depth > MAX_DEPTH:
            raise MeshError("this Collada file has too many nodes, or nodes that contain themselves")
        matrix = above @ _node_matrix(node)
        name = node.attributes.get("name", node.attributes.get("id", ""))
        for child in node.children:
            tag = _tag(child)
            if tag == "node":
                self._read_node(child, matrix, result, depth + 1)
            elif tag == "instance_node":
                target = self._find(child, "node")
                self._read_node(target, matrix, result, depth + 1)
            elif tag == "instance_geometry":
                self._add(self._find(child, "geometry"), name, self._bindings(child), matrix, result)
            elif tag == "instance_controller":
                # For a skin, use its mesh at rest.
                skin = _child(self._find(child, "controller"), "skin")
                source = self._target(skin, "source")
                if source is not None:
                    self._add(source, name, self._bindings(child), matrix, result)

    def _find(self, instance: XmlElement, tag: str) -> XmlElement:
        target = self._target(instance)
        if target is None or _tag(target) != tag:
            raise MeshError(f"this Collada file has no {tag} '{instance.attributes.get('url', '')[:60]}'")
        return target

    def _target(self, element: XmlElement | None, key: str = "url") -> XmlElement | None:
        """Return the element to which an attribute refers, or None."""
        return self._by_id.get(_reference(element.attributes.get(key, ""))) if element is not None else None

    def _add(
        self,
        geometry: XmlElement,
        name: str,
        bindings: dict[str, MeshMaterial],
        matrix: Matrix,
        result: list[Mesh],
    ) -> None:
        key = geometry.attributes.get("id", "") or str(id(geometry))
        if key not in self._geometries:
            self._geometries[key] = list(self._read_geometry(geometry))
        parts = self._geometries[key]
        if not parts:
            return
        self._triangles += sum(len(part.triangles) for part in parts)
        if self._triangles > MAX_TRIANGLES:
            raise MeshError(f"there are more than {MAX_TRIANGLES} triangles")

        materials: dict[str, int] = {}
        starts, start = [], 0
        rows: list[NDArray[np.int32]] = []
        places: list[Texcoords] = []
        for symbol, vertices, triangles, texcoords in parts:
            index = materials.setdefault(symbol, len(materials))
            rows.append(np.full(len(triangles), index, np.int32))
            starts.append(triangles + start)
            start += len(vertices)
            places.append(np.zeros((len(triangles), 3, 2), np.float32) if texcoords is None else texcoords)
        mesh = Mesh.checked(
            np.concatenate([part.vertices for part in parts]),
            np.concatenate(starts).astype(np.int32),
            name,
            tuple(bindings.get(symbol) or self._material(symbol) for symbol in materials),
            np.concatenate(rows),
            None if all(part.texcoords is None for part in parts) else np.concatenate(places),
        )
        result.append(mesh.transformed(matrix[:3, :3], matrix[:3, 3]))

    def _read_geometry(self, geometry: XmlElement) -> Iterator[_Part]:
        """Yield the triangles of each set of primitives."""
        mesh = _child(geometry, "mesh")
        for element in mesh.children if mesh else ():
            if _tag(element) not in PRIMITIVES:
                continue
            inputs = list(_children(element, "input"))
            width = max((int(each.attributes.get("offset", "0")) for each in inputs), default=0) + 1
            vertex = _input(inputs, "VERTEX")
            if vertex is None:
                raise MeshError("primitives of this Collada file have no vertices")
            offset = int(vertex.attributes.get("offset", "0"))
            vertices = self._positions(vertex.attributes.get("source", ""))
            rows = [_rows(_integers(each.text), width) for each in _children(element, "p")]
            ends = np.cumsum([len(each) for each in rows])
            numbers = [
                np.arange(end - len(each), end, dtype=np.int32) for each, end in zip(rows, ends, strict=True)
            ]
            corners = _triangulate(_tag(element), numbers, element)
            if len(corners):
                indices = np.concatenate(rows)
                triangles = indices[:, offset][corners]
                if triangles.min() < 0 or triangles.max() >= len(vertices):
                    raise MeshError("a triangle uses a vertex that does not exist")
                texcoords = self._texcoords(inputs, indices, corners)
                yield _Part(element.attributes.get("material", ""), vertices, triangles, texcoords)

    def _texcoords(
        self, inputs: list[XmlElement], indices: NDArray[np.int32], corners: NDArray[np.int32]
    ) -> Texcoords | None:
        """Return the texture coordinates of the triangles' corners, or None if the file has no usable ones."""
        found = _input(inputs, "TEXCOORD")
        if found is None:
            return None
        try:
            values = self._values(found.attributes.get("source", ""), 2)
            chosen = indices[:, int(found.attributes.get("offset", "0"))][corners]
        except (ValueError, IndexError, OverflowError):
            return None
        if values is None or chosen.min() < 0 or chosen.max() >= len(values):
            return None
        return values.astype(np.float32)[chosen]

    def _positions(self, url: str) -> Matrix:
        source = self._by_id.get(_reference(url))
        if source is not None and _tag(source) == "vertices":
            source = self._target(_input(_children(source, "input"), "POSITION"), "source")
        values = self._values(source.attributes.get("id", ""), 3) if source is not None else None
        if values is None:
            raise MeshError(f"this Collada file has no positions '{url[:60]}' with three coordinates")
        return values

    def _values(self, url: str, count: int) -> Matrix | None:
        """Return the first ``count`` numbers in each entry of a source; None if the source is missing or has shorter entries."""
        source = self._by_id.get(_reference(url))
        array = _child(source, "float_array") if source is not None else None
        if source is None or array is None:
            return None
        values = np.array(array.text.split(), np.float64)
        technique = _child(source, "technique_common")
        accessor = _child(technique, "accessor") if technique else None
        stride = int(accessor.attributes.get("stride", str(count))) if accessor else count
        if stride < count:
            return None
        return values[: len(values) // stride * stride].reshape(-1, stride)[:, :count]

    def _bindings(self, instance: XmlElement) -> dict[str, MeshMaterial]:
        """Return an instance's materials, as a dict from symbol to material."""
        return {
            element.attributes.get("symbol", ""): self._material(
                _reference(element.attributes.get("target", ""))
            )
            for binding in _children(instance, "bind_material")
            for technique in _children(binding, "technique_common")
            for element in _children(technique, "instance_material")
        }

    def _material(self, name: str) -> MeshMaterial:
        material = self._by_id.get(name)
        effect = self._target(_child(material, "instance_effect") if material is not None else None)
        if effect is None:
            return MeshMaterial(name)
        diffuse = _descendant(effect, "diffuse")
        color = _child(diffuse, "color") if diffuse is not None else None
        if color is not None:
            numbers = [float(value) for value in color.text.split()]
            if len(numbers) >= 3:
                red, green, blue = numbers[:3]
                return MeshMaterial(name, (red, green, blue, numbers[3] if len(numbers) > 3 else 1.0))
        has_texture = diffuse is not None and _child(diffuse, "texture") is not None
        return MeshMaterial(name, None, self._image(effect) if has_texture else "")

    def _image(self, effect: XmlElement) -> str:
        start = _descendant(effect, "init_from")
        image = self._by_id.get(start.text.strip()) if start is not None else None
        path = _descendant(image, "init_from") if image is not None else None
        return path.text.strip() if path is not None else ""


def _node_matrix(node: XmlElement) -> Matrix:
    matrix: Matrix = np.eye(4)
    for child in node.children:
        tag = _tag(child)
        if tag not in ("matrix", "translate", "rotate", "scale"):
            continue
        values = np.array(child.text.split(), np.float64)
        step = np.eye(4)
        if tag == "matrix":
            step = values[:16].reshape(4, 4)
        elif tag == "translate":
            step[:3, 3] = values[:3]
        elif tag == "scale":
            step[:3, :3] = np.diag(values[:3])
        else:
            step[:3, :3] = _turn(values[:3], math.radians(values[3]))
        matrix = matrix @ step
    return matrix


def _turn(axis: Matrix, angle: float) -> Matrix:
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        return np.eye(3)
    x, y, z = axis / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Matrix = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return turn


def _triangulate(tag: str, lists: list[NDArray[np.int32]], element: XmlElement) -> NDArray[np.int32]:
    """Return the triangles (n, 3) of one set of primitives, given its corners."""
    if tag == "triangles":
        whole = np.concatenate(lists) if lists else np.zeros(0, np.int32)
        return whole[: len(whole) // 3 * 3].reshape(-1, 3)
    if tag == "tristrips":
        pieces = []
        for row in lists:
            strip = np.stack([row[:-2], row[1:-1], row[2:]], axis=1)
            strip[1::2] = strip[1::2, ::-1]
            pieces.append(strip)
        return np.concatenate(pieces) if pieces else np.zeros((0, 3), np.int32)
    if tag == "polylist":
        counts = _child(element, "vcount")
        sizes = _integers(counts.text) if counts else np.zeros(0, np.int32)
        whole = np.concatenate(lists) if lists else np.zeros(0, np.int32)
        if sizes.sum(dtype=np.int64) > len(whole) or (len(sizes) and sizes.min() < 0):
            raise MeshError("a polylist of this Collada file is shorter than its counts")
        if (sizes == 3).all():
            return whole[: 3 * len(sizes)].reshape(-1, 3)
        return _fans(whole, sizes)
    whole = np.concatenate(lists) if lists else np.zeros(0, np.int32)
    return _fans(whole, np.array([len(row) for row in lists], np.int32))


def _fans(corners: NDArray[np.int32], sizes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the triangles of consecutive polygons, each divided into a fan from its first corner."""
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if len(sizes) else np.zeros(0, np.int64)
    counts = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.stack([corners[first], corners[first + within + 1], corners[first + within + 2]], axis=1)


def _rows(values: NDArray[np.int32], width: int) -> NDArray[np.int32]:
    return values[: len(values) // width * width].reshape(-1, width)


def _integers(text: str) -> NDArray[np.int32]:
    return np.array(text.split(), np.int32)


def _tag(element: XmlElement) -> str:
    """Return a tag without its namespace."""
    return element.tag.rpartition(":")[2]


def _children(element: XmlElement, tag: str) -> Iterator[XmlElement]:
    return (each for each in element.children if _tag(each) == tag)


def _child(element: XmlElement, tag: str) -> XmlElement | None:
    return next(_children(element, tag), None)


def _input(inputs: Iterable[XmlElement], semantic: str) -> XmlElement | None:
    return next((each for each in inputs if each.attributes.get("semantic") == semantic), None)


def _descendant(element: XmlElement, tag: str) -> XmlElement | None:
    for child in element.children:
        found = child if _tag(child) == tag else _descendant(child, tag)
        if found is not None:
            return found
    return None


def _reference(url: str) -> str:
    return url.rpartition("#")[2]
