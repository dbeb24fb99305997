"""The shapes of collisions and visuals as MuJoCo geoms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.files import read_mesh
from minirospy.core.meshes.mesh import Mesh
from minirospy.core.meshes.parts import collision_parts
from minirospy.core.meshes.solids import polyline_mesh, terrain
from minirospy.core.sdf.model import (
    Box,
    Collision,
    Color,
    Cylinder,
    Geometry,
    Heightmap,
    MeshShape,
    Plane,
    Polyline,
    Pose,
    Quaternion,
    Sphere,
    Surface,
    Vector,
    Visual,
)
from minirospy.core.sdf.poses import compose, rotate, unit
from minirospy.ros.gazebo_ros.physics.decomposition import Decomposition
from minirospy.ros.gazebo_ros.physics.library import SimulationError, load_mujoco
from minirospy.ros.gazebo_ros.physics.textures import Textures

__all__ = [
    "GROUP_COLLISION",
    "GROUP_CONTACT_ONLY",
    "GROUP_RAY_ONLY",
    "GROUP_VISUAL",
    "PART",
    "SOLREF",
    "Grain",
    "Shapes",
    "friction",
    "grain",
    "to_wxyz",
]

# MuJoCo's geom groups, which select the geoms for rays and cameras.
GROUP_COLLISION = 0
GROUP_VISUAL = 2
GROUP_CONTACT_ONLY = 3
GROUP_RAY_ONLY = 4

SOLREF = (0.005, 1.0)  # time constant (s), damping ratio: stiff contacts, stable with steps of 1 to 2.5 ms
# Contacts are soft at first, and stiff from a depth of 0.6 mm. If they were stiff from the start,
# a robot on four supports would rattle: supports would lift off in turn, and wheels would lose their grip.
SOLIMP = (0.5, 0.99, 0.0006, 0.5, 2.0)
# A turning wheel is also pulled sideways. With SOLIMP, it would lift off in most steps,
# and a robot with four such wheels would turn too slowly, so this contact is softer at first.
SOLIMP_WHEEL = (0.2, 0.99, 0.0006, 0.5, 2.0)
# Larger friction coefficients, such as 1e5, do not hold better, and would stop a wheel with two contact points from turning.
MAX_FRICTION = 2.0
PART = "\t"  # separates a collision's name from its geom's number
MIN_SIZE = 1e-6  # m; MuJoCo rejects sizes of zero
MIN_VERTICES = 4  # minimum number of vertices per mesh; MuJoCo rejects meshes with fewer
MIN_AREA = 1e-14  # minimum surface area per mesh, in m^2; MuJoCo rejects smaller ones
WALL_THICKNESS = 0.01  # m; too thick for a robot at 10 m/s to pass through in a 1 ms step
_GREY: Color = (0.7, 0.7, 0.7, 1.0)
_WHITE: Color = (1.0, 1.0, 1.0, 1.0)


class Grain(NamedTuple):
    """A surface with direction-dependent friction: the direction of ``mu`` in body axes, and both coefficients."""

    direction: Vector
    mu: float
    mu2: float


def grain(collision: Collision) -> Grain | None:
    """Return a collision's direction-dependent friction, or None if ``fdir1`` is missing or both coefficients are equal."""
    surface = collision.surface
    direction = unit(rotate(collision.pose.orientation, surface.fdir1))
    mu, mu2 = _coefficients(surface)
    return None if direction is None or mu == mu2 else Grain(direction, mu, mu2)


def friction(surface: Surface) -> tuple[float, int]:
    """Return a geom's friction coefficient and its priority.

    As in ODE, the smoother of two surfaces counts: MuJoCo uses the coefficient of the geom with the higher priority. A geom in
    MuJoCo has one coefficient for both directions, so use the smaller of ``mu`` and ``mu2``: with the larger one, a robot with
    four wheels, which slip sideways in a turn, would not turn. If one of them is zero, as for a wheel that rolls sideways, use
    the mean, because the wheel must drive.
    """
    mu, mu2 = _coefficients(surface)
    value = min(mu, mu2) or (mu + mu2) / 2
    return value, round((MAX_FRICTION - value) * 1e6)


def _coefficients(surface: Surface) -> tuple[float, float]:
    mu, mu2 = (min(max(value, 0.0), MAX_FRICTION) for value in (surface.mu, surface.mu2))
    return mu, mu2


@dataclass(frozen=True)
class _Piece:
    """A geom to add: its type, sizes and pose in the shape's frame, or a mesh or heightmap's name."""

    kind: str
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pose: Pose = Pose()  # noqa: RUF009 (immutable)
    asset: str = ""
    group: int = GROUP_COLLISION
    color: Color | None = None
    texture: str = ""  # path of an image file
    has_texcoords: bool = False


class Shapes:
    """Adds geoms to an MjSpec's bodies; geoms share meshes.

    ``grains`` maps geom names to their grains. It keeps those of deleted geoms until a geom of the same name is added.
    """

    def __init__(self, spec: Any) -> None:
        self._mujoco = load_mujoco()
        self._spec = spec
        self.grains: dict[str, Grain | None] = {}
        self.warnings: list[str] = []  # warnings about textures and moving meshes
        self._textures = Textures(spec, self.warnings)
        self._decomposition = Decomposition(self.warnings)
        self._assets: dict[tuple[object, ...], list[_Piece]] = {}
        self._elements: dict[int, Any] = {}  # the spec's meshes and heightmaps by number
        self._count = 0

    @property
    def last(self) -> int:
        """Return the number of the last mesh or heightmap added."""
        return self._count

    def delete_after(self, last: int) -> None:
        """Delete the meshes and heightmaps with numbers above ``last``. They must not be used by any geom."""
        numbers = [number for number in self._elements if number > last]
        names = {self._elements[number].name for number in numbers}
        for number in numbers:
            self._spec.delete(self._elements.pop(number))
        for key, pieces in list(self._assets.items()):
            if any(piece.asset in names for piece in pieces):
                del self._assets[key]

    def add_collision(
        self,
        body: Any,
        name: str,
        collision: Collision,
        *,
        is_static: bool,
        turns: bool = False,
        is_wheel: bool = False,
        is_wall: bool = False,
    ) -> None:
        """Add a collision's geoms.

        ``turns``: a joint without limits rotates the body. ``is_wheel``: the collision is a cylinder that rotates about its axis.
        ``is_wall``: it is a plane that is not level.
        """
        mu, priority = friction(collision.surface)
        pose, directions = collision.pose, grain(collision)
        if is_wheel and isinstance(collision.geometry, Cylinder):
            pieces = _wheel(collision.geometry)
        elif is_wall and isinstance(collision.geometry, Plane):
            pieces = [_wall(collision.geometry)]
        else:
            pieces = self._pieces(collision.geometry, is_static=is_static)
        for index, piece in enumerate(pieces):
            geom = self._add(body, f"{name}{PART}{index}" if index else name, piece, pose)
            geom.group = piece.group
            geom.friction = [mu, 0.0, 0.0]
            if directions is not None or geom.name in self.grains:
                self.grains[geom.name] = directions
            geom.priority = priority
            geom.solref, geom.solimp = SOLREF, SOLIMP_WHEEL if turns else SOLIMP
            if piece.group == GROUP_RAY_ONLY:
                geom.contype = geom.conaffinity = 0

    def add_visual(self, body: Any, name: str, visual: Visual) -> None:
        """Add a visual's geoms. They do not collide."""
        opacity = 1.0 - min(max(visual.transparency, 0.0), 1.0)
        for index, piece in enumerate(self._visible(visual.geometry)):
            geom = self._add(body, f"{name}{PART}{index}" if index else name, piece, visual.pose)
            geom.group = GROUP_VISUAL
            geom.contype = geom.conaffinity = 0
            picture = visual.material.texture or ("" if visual.material.color else piece.texture)
            material = self._textures.material(picture, is_flat=piece.kind in ("PLANE", "MESH"))
            if material and (piece.kind != "MESH" or piece.has_texcoords):
                geom.material = material
                red, green, blue, alpha = visual.material.color or _WHITE
            else:
                red, green, blue, alpha = visual.material.color or piece.color or _GREY
            geom.rgba = [red, green, blue, alpha * opacity]

    def _add(self, body: Any, name: str, piece: _Piece, pose: Pose) -> Any:
        kinds = self._mujoco.mjtGeom
        geom = body.add_geom(name=name, type=getattr(kinds, f"mjGEOM_{piece.kind}"), size=piece.size)
        if piece.kind == "MESH":
            geom.meshname = piece.asset
        elif piece.kind == "HFIELD":
            geom.hfieldname = piece.asset
        whole = compose(pose, piece.pose)
        geom.pos = whole.position
        geom.quat = to_wxyz(whole.orientation)
        return geom

    def _pieces(self, geometry: Geometry, *, is_static: bool) -> list[_Piece]:
        simple = _primitive(geometry)
        if simple is not None:
            return [simple]
        key = ("collision", is_static, geometry)
        if key not in self._assets:
            self._assets[key] = list(self._make_pieces(geometry, is_static=is_static))
        return self._assets[key]

    def _make_pieces(self, geometry: Geometry, *, is_static: bool) -> Iterator[_Piece]:
        if isinstance(geometry, Heightmap):
            yield self._heightmap(geometry)
            return

        mesh = _joined(_meshes(geometry))
        name = geometry.path if isinstance(geometry, MeshShape) else "of a polyline"
        try:
            parts = collision_parts(
                mesh,
                is_static=is_static,
                split=lambda part, most: self._decomposition.split(part, name, most),
            )
        except MeshError as error:
            raise SimulationError(f"{getattr(geometry, 'path', 'polyline')}: {error}") from error
        is_whole = parts.are_exact
        if not is_whole:  # this geom must be the body's first, as Engine.cast expects
            yield _Piece("MESH", asset=self._add_mesh(mesh.vertices, mesh.triangles), group=GROUP_RAY_ONLY)
        for part in parts.meshes:
            asset = self._add_mesh(part.vertices, part.triangles if is_whole else None)
            yield _Piece("MESH", asset=asset, group=GROUP_COLLISION if is_whole else GROUP_CONTACT_ONLY)

    def _visible(self, geometry: Geometry) -> list[_Piece]:
        if isinstance(geometry, Plane):
            x, y = geometry.size
            size = (max(x, MIN_SIZE) / 2, max(y, MIN_SIZE) / 2, 1.0)
            return [_Piece("PLANE", size, Pose(orientation=_turn_to(geometry.normal)))]
        simple = _primitive(geometry)
        if simple is not None:
            return [simple]
        key = ("visual", geometry)
        if key not in self._assets:
            if isinstance(geometry, Heightmap):
                self._assets[key] = self._pieces(geometry, is_static=True)
            else:
                self._assets[key] = [
                    self._section(section)
                    for mesh in _meshes(geometry)
                    for section in mesh.sections()
                    if _area(section) > MIN_AREA
                ]
        return self._assets[key]

    def _section(self, mesh: Mesh) -> _Piece:
        """Add a section of a mesh, the part with one material; return its geom."""
        (material,) = mesh.materials[:1]
        asset = self._add_mesh(mesh.vertices, mesh.triangles, mesh.texcoords)
        has_texcoords = mesh.texcoords is not None
        return _Piece(
            "MESH", asset=asset, color=material.color, texture=material.texture, has_texcoords=has_texcoords
        )

    def _add_mesh(
        self,
        vertices: NDArray[np.float64],
        triangles: NDArray[np.int32] | None,
        texcoords: NDArray[np.float32] | None = None,
    ) -> str:
        self._count += 1
        name = f"mesh{self._count}"
        mesh = self._elements[self._count] = self._spec.add_mesh(name=name)
        if triangles is not None:
            used, faces = np.unique(triangles, return_inverse=True)
            vertices = vertices[used]
            mesh.userface = faces.ravel().astype(np.int32)
            if texcoords is not None:
                # MuJoCo's texture coordinates start at the picture's upper left corner.
                mesh.usertexcoord = (texcoords * (1, -1) + (0, 1)).astype(np.float32).ravel()
                mesh.userfacetexcoord = np.arange(faces.size, dtype=np.int32)
        lacking = MIN_VERTICES - len(vertices)
        if lacking > 0:
            vertices = np.concatenate([vertices, vertices[-1:].repeat(lacking, axis=0)])
        mesh.uservert = vertices.astype(np.float32).ravel()
        # An open or flat mesh has no volume, so treat it as a shell. Bodies have explicit inertias in any case.
        mesh.inertia = self._mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        return name

    def _heightmap(self, shape: Heightmap) -> _Piece:
        try:
            heights = terrain(shape.path)
        except MeshError as error:
            raise SimulationError(str(error)) from error
        # MuJoCo scales heights to 0..1; in SDF, the highest point has the given height.
        highest = max(float(heights.max()), MIN_SIZE)
        lowest = float(heights.min()) / highest
        self._count += 1
        name = f"terrain{self._count}"
        x, y, z = shape.size
        rows, columns = heights.shape
        self._elements[self._count] = self._spec.add_hfield(
            name=name,
            nrow=rows,
            ncol=columns,
            size=[x / 2, y / 2, max(z * (1 - lowest), MIN_SIZE), max(z, 1.0) / 10],
            userdata=heights.astype(np.float32).ravel(),
        )
        px, py, pz = shape.position
        return _Piece("HFIELD", asset=name, pose=Pose((px, py, pz + z * lowest)))


def _primitive(geometry: Geometry) -> _Piece | None:
    """Return the geom for a shape that MuJoCo supports directly, or None."""
    if isinstance(geometry, Box):
        x, y, z = (max(abs(side) / 2, MIN_SIZE) for side in geometry.size)
        return _Piece("BOX", (x, y, z))
    if isinstance(geometry, Cylinder):
        return _Piece("CYLINDER", (max(geometry.radius, MIN_SIZE), max(geometry.length / 2, MIN_SIZE), 0.0))
    if isinstance(geometry, Sphere):
        return _Piece("SPHERE", (max(geometry.radius, MIN_SIZE), 0.0, 0.0))
    if isinstance(geometry, Plane):
        return _Piece("PLANE", (0.0, 0.0, 1.0), Pose(orientation=_turn_to(geometry.normal)))
    return None


def _wheel(shape: Cylinder) -> list[_Piece]:
    """Return an ellipsoid for contacts and a cylinder for rays.

    A cylinder touches the ground along a line. When a robot turns, one end of that line slips forward and the other backward, so
    that the effective distance between the wheels depends on the friction. An ellipsoid touches the ground only at its middle.
    """
    radius, half = max(shape.radius, MIN_SIZE), max(shape.length / 2, MIN_SIZE)
    return [
        _Piece("ELLIPSOID", (radius, radius, half), group=GROUP_CONTACT_ONLY),
        _Piece("CYLINDER", (radius, half, 0.0), group=GROUP_RAY_ONLY),
    ]


def _wall(shape: Plane) -> _Piece:
    """Return a thin box of the plane's size, because posters and walls must not extend to infinity."""
    x, y = (max(side / 2, MIN_SIZE) for side in shape.size)
    turn = _turn_to(shape.normal)
    behind = rotate(turn, (0.0, 0.0, -WALL_THICKNESS / 2))
    return _Piece("BOX", (x, y, WALL_THICKNESS / 2), Pose(behind, turn))


def _area(mesh: Mesh) -> float:
    # MuJoCo stores vertices in single precision.
    rounded = Mesh(mesh.vertices.astype(np.float32).astype(np.float64), mesh.triangles)
    return float(np.linalg.norm(rounded.crosses, axis=1).sum()) / 2


def _meshes(geometry: Geometry) -> list[Mesh]:
    try:
        if isinstance(geometry, Polyline):
            return [polyline_mesh(geometry.points, geometry.height)]
        assert isinstance(geometry, MeshShape)
        return read_mesh(geometry.path, geometry.submesh, geometry.scale, is_centered=geometry.is_centered)
    except MeshError as error:
        raise SimulationError(str(error)) from error


def _joined(meshes: list[Mesh]) -> Mesh:
    return meshes[0] if len(meshes) == 1 else Mesh.join(meshes)


def _turn_to(normal: tuple[float, float, float]) -> Quaternion:
    """Return a rotation that turns the z axis to ``normal``."""
    x, y, z = normal
    length = (x * x + y * y + z * z) ** 0.5
    if length < MIN_SIZE:
        return 0.0, 0.0, 0.0, 1.0
    x, y, z = x / length, y / length, z / length
    if z < -1 + 1e-12:
        return 1.0, 0.0, 0.0, 0.0
    scale = (2 * (1 + z)) ** 0.5
    return -y / scale, x / scale, 0.0, scale / 2


def to_wxyz(rotation: Quaternion) -> Quaternion:
    """Return a quaternion in MuJoCo's order."""
    x, y, z, w = rotation
    return w, x, y, z
