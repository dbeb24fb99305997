"""Convert a robot description (URDF) with ``<gazebo>`` tags to an SDF model, by the rules of sdformat's reader.

- A link that a fixed joint attaches is merged into its parent: masses add, and its parts move along. ``preserveFixedJoint`` keeps
  the joint, ``disableFixedJointLumping`` makes a revolute one with the limits 0 and 0.
- A link without mass is left out, with all links below it. A massless root whose fixed children have masses gets theirs.
- Joints to a root link named ``world`` fix the robot.
- Unlike sdformat: colours of the URDF are kept, mimic joints are read, friction applies to collisions that have a name, children
  of floating and planar joints are free bodies, and links below a massless link stay if a fixed joint merges it.

Source: http://sdformat.org/tutorials?tut=pose_frame_semantics, https://classic.gazebosim.org/tutorials?tut=ros_urdf.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from minirospy.base.errors import SdfError, UrdfError
from minirospy.core.sdf.inertias import add_inertials, moved
from minirospy.core.sdf.materials import named_material
from minirospy.core.sdf.model import IDENTITY, Inertial, Model, Pose
from minirospy.core.sdf.poses import compose, pose_from_rpy
from minirospy.core.sdf.read_model import read_model
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element, copy_of, new_element
from minirospy.core.urdf.model import (
    Box,
    Collision,
    Cylinder,
    Geometry,
    JointType,
    Link,
    Mesh,
    Origin,
    Robot,
    Visual,
)
from minirospy.core.urdf.model import Joint as UrdfJoint
from minirospy.core.urdf.model import Material as UrdfMaterial
from minirospy.core.urdf.read import robot_from_element

__all__ = ["read_urdf"]

_WORLD = "world"
_LUMP = "_fixed_joint_lump__"
_MIN_MASS = 1e-6  # kg; sdformat treats a smaller mass as zero
_TRUE = ("1", "true", "yes")
_FALSE = ("0", "false", "no")

_CONTACT = {"kp": "kp", "kd": "kd", "maxVel": "max_vel", "minDepth": "min_depth"}
_FRICTION = {"mu1": "mu", "mu2": "mu2", "fdir1": "fdir1"}
_DYNAMICS = {"springReference": "spring_reference", "springStiffness": "spring_stiffness"}
_WITHOUT_EFFECT = frozenset(
    (
        "canonicalBody", "cfmDamping", "disableFixedJointLumping", "fudgeFactor", "implicitSpringDamper", "laserRetro",
        "maxContacts", "preserveFixedJoint", "provideFeedback", "stopCfm", "stopErp", "stopKp", "stopKd",
    )
)  # fmt: skip
_MOVED = ("sensor", "light", "projector")


def read_urdf(root: Element, source: Source, name: str = "") -> Model:
    """Return the model of a robot description. Raise SdfError if the description is unusable."""
    try:
        robot = robot_from_element(root, source.file)
    except UrdfError as error:
        raise SdfError(error.file, error.line, error.text) from None
    for problem in robot.problems:
        line = f"{source.file}:{problem.line}: {problem}" if problem.line else f"{source.file}: {problem}"
        source.warnings.append(line)
    converter = _Converter(robot, root, source)
    element = converter.convert()
    model = read_model(element, source, name or robot.name)
    return replace(
        model,
        lumped=converter.lumped,
        warnings=(*dict.fromkeys((*source.warnings, *model.warnings)),),
    )


@dataclass
class _Body:
    """A link of the model: its own parts and those of the links merged into it, each with that link's name and pose."""

    link: Link
    inertial: Inertial | None
    visuals: list[tuple[str, Pose, Visual]] = field(default_factory=list)
    collisions: list[tuple[str, Pose, Collision]] = field(default_factory=list)
    merged: list[tuple[str, Pose]] = field(default_factory=list)


class _Converter:
    """Converts one robot. ``lumped``: for each merged link, the name of the link that contains it, and its pose there."""

    def __init__(self, robot: Robot, root: Element, source: Source) -> None:
        self.lumped: dict[str, tuple[str, Pose]] = {}
        self._robot = robot
        self._source = source
        self._extensions: dict[str, list[Element]] = {}
        for element in root.all("gazebo"):
            reference = element.attributes.get("reference", "")
            self._extensions.setdefault(reference, []).extend(element.children)
        self._kept = self._flagged("preserveFixedJoint")
        self._revolute = self._flagged("disableFixedJointLumping") - self._kept
        self._bodies: dict[str, _Body] = {}
        self._names: dict[tuple[str, str], str] = {}  # keyed by (link, collision name): the name in the model

    def convert(self) -> Element:
        """Return the ``<model>``. Raise SdfError if no part of the robot remains."""
        self._check_references()
        for link in self._tree():
            self._merge(link)
        for body in self._bodies.values():
            self._sum(body)
        kept = self._with_mass()
        if not kept:
            raise SdfError(
                self._source.file,
                self._robot.links[self._robot.root].line,
                "no link is left: the root link has no mass, so it and all links below it are left out. Add an <inertial> to it",
            )

        model = new_element("model", attributes={"name": self._robot.name})
        for name in kept:
            model.children += self._link(name, kept)
        for name, (target, pose) in self.lumped.items():
            model.children.append(_frame(name, target, pose))
        self._add_robot_extensions(model)
        return model

    # ---- the tree

    def _flagged(self, tag: str) -> set[str]:
        return {
            reference
            for reference, children in self._extensions.items()
            for child in children
            if child.tag == tag and _value(child).lower() in _TRUE
        }

    def _check_references(self) -> None:
        for reference, children in self._extensions.items():
            if reference and reference not in self._robot.links and reference not in self._robot.joints:
                line = children[0] if children else None
                self._source.warn(
                    line, f'<gazebo reference="{reference}"> is left out: no link or joint has this name'
                )

    def _is_merged(self, joint: UrdfJoint | None) -> bool:
        return (
            joint is not None
            and joint.type is JointType.FIXED
            and joint.parent != _WORLD
            and joint.name not in self._kept
            and joint.name not in self._revolute
        )

    def _tree(self) -> Iterator[str]:
        """Yield the links, starting at the root, each before its descendants; siblings are sorted by their joints' names."""
        seen: set[str] = set()
        stack = [self._robot.root]
        while stack:
            name = stack.pop()
            if name in seen:
                continue
            seen.add(name)
            yield name
            stack.extend(joint.child for joint in reversed(self._robot.child_joints(name)))

    def _merge(self, name: str) -> None:
        """Make the link a body of its own or, if a fixed joint merges it, add it to the body of its parent."""
        link, joint = self._robot.links[name], self._robot.parent_joint(name)
        target, pose = name, IDENTITY
        if joint is not None and self._is_merged(joint):
            above, above_pose = self.lumped.get(joint.parent, (joint.parent, IDENTITY))
            target, pose = above, compose(above_pose, _pose(joint.origin))
            self.lumped[name] = target, pose
        else:
            self._bodies[name] = _Body(link, None)
        body = self._bodies[target]
        body.merged.append((name, pose))

    def _sum(self, body: _Body) -> None:
        """Collect the parts of a body's links in sdformat's order: its own parts, then those of the merged links, depth first."""
        for name, pose in _merged_links(body, self._robot):
            link = self._robot.links[name]
            body.visuals += [(name, pose, visual) for visual in link.visuals]
            body.collisions += [(name, pose, collision) for collision in link.collisions]
            if link.inertial is not None and link.inertial.mass >= 0.0:
                own = Inertial(link.inertial.mass, _pose(link.inertial.origin), link.inertial.inertia)
                inertial = moved(own, pose) if name != body.link.name else own
                body.inertial = inertial if body.inertial is None else add_inertials(body.inertial, inertial)

    def _with_mass(self) -> list[str]:
        """Return the links that remain, in tree order. Leave out massless links and all links below them, with a warning."""
        kept: list[str] = []
        lost: dict[str, int] = {}  # dict from the topmost massless link to the number of links below it
        cause: dict[str, str] = {}
        for name, body in self._bodies.items():
            joint = self._robot.parent_joint(name)
            above = None
            if joint is not None:
                above = self.lumped.get(joint.parent, (joint.parent, IDENTITY))[0]
            if above in cause:
                cause[name] = cause[above]
                lost[cause[name]] += 1
            elif name == _WORLD:
                continue
            elif body.inertial is None or body.inertial.mass <= _MIN_MASS:
                cause[name], lost[name] = name, 0
            else:
                kept.append(name)
        for name, below in lost.items():
            why = "has no <inertial>" if self._robot.links[name].inertial is None else "has no mass"
            others = (
                f", and the {below} links below it are"
                if below > 1
                else ", and the link below it are"
                if below
                else " is"
            )
            self._source.warnings.append(
                f"{self._source.file}:{self._robot.links[name].line}: link [{name}] {why}: it{others} left out"
            )
        return kept

    # ---- links

    def _link(self, name: str, kept: list[str]) -> Iterator[Element]:
        body, joint = self._bodies[name], self._robot.parent_joint(name)
        link = new_element("link", attributes={"name": name}, line=body.link.line)
        assert body.inertial is not None, name
        link.children.append(_inertial(body.inertial))
        if joint is not None:
            parent, pose = self._attachment(joint)
            link.children.append(_pose_element(pose, parent))
        self._add_shapes(link, body)
        for merged, pose in body.merged:
            self._add_link_extensions(link, merged, pose)
        yield link
        if joint is not None:
            element = self._joint(joint)
            if element is not None:
                yield element

    def _attachment(self, joint: UrdfJoint) -> tuple[str, Pose]:
        """Return the link of the model to which a joint is attached (empty: the model itself), and the joint's pose there."""
        if joint.parent == _WORLD:
            return "", _pose(joint.origin)
        parent, pose = self.lumped.get(joint.parent, (joint.parent, IDENTITY))
        return parent, compose(pose, _pose(joint.origin))

    def _add_shapes(self, link: Element, body: _Body) -> None:
        for index, (owner, pose, visual) in enumerate(body.visuals):
            name = _part_name(body.link.name, visual.name or owner, "visual", index)
            element = _shape("visual", name, pose, visual.origin, visual.geometry, body.link.line)
            self._add_look(element, owner, visual.material)
            link.children.append(element)
        for index, (owner, pose, collision) in enumerate(body.collisions):
            name = _part_name(body.link.name, collision.name or owner, "collision", index)
            self._names.setdefault((owner, f"{collision.name or owner}_collision"), name)
            element = _shape("collision", name, pose, collision.origin, collision.geometry, body.link.line)
            self._add_surface(element, owner)
            link.children.append(element)

    def _add_look(self, visual: Element, owner: str, material: UrdfMaterial | None) -> None:
        script = ""
        for child in self._extensions.get(owner, ()):
            if child.tag == "material":
                script = _value(child)
            elif child.tag == "visual":
                visual.children += [copy_of(part) for part in child.children]
        look = visual.first("material")
        if look is None:
            look = new_element("material", line=visual.line)
            visual.children.append(look)
        if script:
            look.children.insert(0, new_element("script", "", new_element("name", script), line=visual.line))
            if named_material(script) is not None:
                return
        self._add_colors(look, material)

    def _add_colors(self, look: Element, material: UrdfMaterial | None) -> None:
        if material is None:
            return
        if material.color is None and not material.texture:
            defined = self._robot.materials.get(material.name)
            if defined is None:
                if named_material(material.name) is not None and look.first("script") is None:
                    look.children.append(new_element("script", "", new_element("name", material.name)))
                return
            material = defined
        if material.color is not None and look.first("diffuse") is None:
            look.children.append(new_element("diffuse", _numbers(*material.color)))
        if material.texture and look.first("pbr") is None:
            texture = new_element("albedo_map", material.texture)
            look.children.append(new_element("pbr", "", new_element("metal", "", texture)))

    def _add_surface(self, collision: Element, owner: str) -> None:
        friction, contact = new_element("ode"), new_element("ode")
        own: Element | None = None
        for child in self._extensions.get(owner, ()):
            if child.tag in _FRICTION:
                _set(friction, _FRICTION[child.tag], child)
            elif child.tag in _CONTACT:
                _set(contact, _CONTACT[child.tag], child)
            elif child.tag == "collision":
                for part in child.children:
                    if part.tag == "surface":
                        own = part
                    else:
                        collision.children.append(copy_of(part))
        surface = copy_of(own) if own is not None else new_element("surface", line=collision.line)
        for tag, values in (("friction", friction), ("contact", contact)):
            _child(_child(surface, tag), "ode").children[:0] = values.children
        collision.children.append(surface)

    def _add_link_extensions(self, link: Element, owner: str, pose: Pose) -> None:
        """Copy the link's children from ``<gazebo reference="owner">``. Adjust poses of a merged link's sensors and lights."""
        children = self._extensions.get(owner, [])
        # As in sdformat, unknown tags come last, so <turnGravityOff> overrides <gravity>.
        for child in sorted(children, key=lambda child: child.tag not in _LINK_TAGS):
            tag = child.tag
            if tag == "turnGravityOff":
                _replace(link, "gravity", "true" if _value(child).lower() in _FALSE else "false", child.line)
            elif tag == "dampingFactor":
                if link.first("velocity_decay") is not None:
                    continue
                values = {"linear": _value(child), "angular": _value(child)}
                link.children.append(_record("velocity_decay", values, child.line))
            elif tag == "selfCollide":
                _replace(
                    link, "self_collide", "true" if _value(child).lower() in _TRUE else "false", child.line
                )
            elif tag not in _CONTACT and tag not in _FRICTION and tag not in _OWN_TAGS:
                blob = copy_of(child)
                if tag in _MOVED and pose != IDENTITY:
                    self._move(blob, pose)
                self._rename_collisions(blob, owner)
                link.children.append(blob)

    def _move(self, blob: Element, pose: Pose) -> None:
        old = blob.first("pose")
        if old is not None and old.attributes.get("relative_to"):
            return
        inner = self._source.pose(old) if old is not None else IDENTITY
        blob.children = [part for part in blob.children if part is not old]
        blob.children.append(_pose_element(compose(pose, inner)))

    def _rename_collisions(self, sensor: Element, owner: str) -> None:
        """Update the collision names in a contact sensor of a merged link."""
        contact = sensor.first("contact")
        for collision in contact.all("collision") if contact is not None else ():
            collision.text = self._names.get((owner, collision.text.strip()), collision.text)

    # ---- joints

    def _joint(self, joint: UrdfJoint) -> Element | None:
        """Return the ``<joint>``, or None, with a warning, if Gazebo does not know the type (floating or planar)."""
        kind = self._joint_kind(joint)
        if kind is None:
            what = f"joint [{joint.name}] is {joint.type.value}, which Gazebo does not know: link [{joint.child}] is free"
            self._source.warnings.append(f"{self._source.file}:{joint.line}: {what}")
            return None
        parent, _ = self._attachment(joint)
        element = new_element("joint", line=joint.line, attributes={"name": joint.name, "type": kind})
        element.children += [new_element("parent", parent or _WORLD), new_element("child", joint.child)]
        if kind != "fixed":
            element.children.append(self._axis(joint))
        for child in self._extensions.get(joint.name, ()):
            if child.tag in _DYNAMICS:
                _set(_child(_child(element, "axis"), "dynamics"), _DYNAMICS[child.tag], child)
            elif child.tag not in _WITHOUT_EFFECT:
                blob = copy_of(child)
                if child.tag == "initial_joint_position":
                    blob.text = _value(child)
                element.children.append(blob)
        return element

    def _joint_kind(self, joint: UrdfJoint) -> str | None:
        if joint.type in (JointType.FLOATING, JointType.PLANAR):
            return None
        if joint.type is JointType.FIXED and joint.name in self._revolute:
            return "revolute"
        return str(joint.type.value)

    def _axis(self, joint: UrdfJoint) -> Element:
        axis = new_element("axis", line=joint.line)
        if joint.type is JointType.FIXED:
            axis.children.append(_record("limit", {"lower": "0", "upper": "0"}, joint.line))
            return axis
        axis.children.append(new_element("xyz", _numbers(*joint.axis), line=joint.line))
        if joint.limit is not None:
            values = {"effort": joint.limit.effort, "velocity": joint.limit.velocity}
            if joint.type is not JointType.CONTINUOUS:
                values = {"lower": joint.limit.lower, "upper": joint.limit.upper, **values}
            axis.children.append(_record("limit", values, joint.line))
        if joint.dynamics is not None:
            values = {"damping": joint.dynamics.damping, "friction": joint.dynamics.friction}
            axis.children.append(_record("dynamics", values))
        if joint.mimic is not None:
            mimic = _record("mimic", {"multiplier": joint.mimic.multiplier, "offset": joint.mimic.offset})
            mimic.attributes["joint"] = joint.mimic.joint
            axis.children.append(mimic)
        return axis

    # ---- the robot

    def _add_robot_extensions(self, model: Element) -> None:
        for child in self._extensions.get("", ()):
            if child.tag == "static":
                _replace(model, "static", "true" if _value(child).lower() in _TRUE else "false", child.line)
                continue
            if child.tag in _WITHOUT_EFFECT:
                continue
            blob = copy_of(child)
            if child.tag == "joint":
                self._rename_links(blob)
            model.children.append(blob)

    def _rename_links(self, joint: Element) -> None:
        """Update the links of a joint in ``<gazebo>`` that were merged into other links. The joint stays at its child's pose."""
        child = joint.first("child")
        for tag in ("parent", "child"):
            part = joint.first(tag)
            if part is not None and part.text.strip() in self.lumped:
                old = part.text.strip()
                if part is child and joint.first("pose") is None:
                    joint.children.append(_pose_element(IDENTITY, old))
                part.text = self.lumped[old][0]


_LINK_TAGS = ("turnGravityOff", "dampingFactor", "selfCollide")
_OWN_TAGS = frozenset(("material", "visual", "collision", "static")) | _WITHOUT_EFFECT | frozenset(_DYNAMICS)


def _merged_links(body: _Body, robot: Robot) -> Iterator[tuple[str, Pose]]:
    """Yield a body's links in the order in which sdformat adds their parts: a link, then all of each merged child's links."""
    poses = dict(body.merged)
    stack = [body.link.name]
    while stack:
        name = stack.pop()
        yield name, poses[name]
        below = [joint.child for joint in robot.child_joints(name) if joint.child in poses]
        stack.extend(reversed(below))


def _part_name(link: str, name: str, kind: str, index: int) -> str:
    """Return a part's name in sdformat's form: ``LINK_collision``, or ``LINK_fixed_joint_lump__OTHER_collision_1``."""
    name = f"{name}_{kind}_{index}" if index else f"{name}_{kind}"
    return name if name.startswith(link) else f"{link}{_LUMP}{name}"


def _shape(tag: str, name: str, pose: Pose, origin: Origin, geometry: Geometry, line: int) -> Element:
    element = new_element(tag, attributes={"name": name}, line=line)
    element.children += [
        _pose_element(compose(pose, _pose(origin))),
        new_element("geometry", "", _geometry(geometry, line), line=line),
    ]
    return element


def _geometry(geometry: Geometry, line: int) -> Element:
    if isinstance(geometry, Box):
        return _record("box", {"size": _numbers(*geometry.size)}, line)
    if isinstance(geometry, Cylinder):
        return _record("cylinder", {"radius": geometry.radius, "length": geometry.length}, line)
    if isinstance(geometry, Mesh):
        return _record("mesh", {"uri": geometry.filename, "scale": _numbers(*geometry.scale)}, line)
    return _record("sphere", {"radius": geometry.radius}, line)


def _inertial(inertial: Inertial) -> Element:
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    inertia = _record("inertia", dict(zip(keys, inertial.inertia, strict=True)))
    mass = new_element("mass", _numbers(inertial.mass))
    return new_element("inertial", "", mass, _pose_element(inertial.pose), inertia)


def _frame(name: str, target: str, pose: Pose) -> Element:
    frame = new_element("frame", attributes={"name": name, "attached_to": target})
    frame.children.append(_pose_element(pose))
    return frame


def _pose(origin: Origin) -> Pose:
    return pose_from_rpy(origin.xyz, origin.rpy)


def _pose_element(pose: Pose, relative_to: str = "") -> Element:
    attributes = {"rotation_format": "quat_xyzw"}
    if relative_to:
        attributes["relative_to"] = relative_to
    return new_element("pose", _numbers(*pose.position, *pose.orientation), attributes=attributes)


def _record(tag: str, values: Mapping[str, float | str], line: int = 0) -> Element:
    """Return an element with a child for each value."""
    texts = {key: value if isinstance(value, str) else _numbers(value) for key, value in values.items()}
    return new_element(
        tag, "", *(new_element(key, text, line=line) for key, text in texts.items()), line=line
    )


def _numbers(*values: float) -> str:
    return " ".join(map(repr, values))


def _value(element: Element) -> str:
    """Return the attribute ``value``, or else the text."""
    return element.attributes.get("value", element.text).strip()


def _set(parent: Element, tag: str, value: Element) -> None:
    """Set a child to the value of a ``<gazebo>`` tag. If there are several tags, the last one is used."""
    _replace(parent, tag, _value(value), value.line)


def _replace(parent: Element, tag: str, text: str, line: int) -> None:
    first = parent.first(tag)
    parent.children = [child for child in parent.children if child is not first]
    parent.children.append(new_element(tag, text, line=line))


def _child(parent: Element, tag: str) -> Element:
    """Return the first child with this tag, after adding one if there is none."""
    child = parent.first(tag)
    if child is None:
        child = new_element(tag)
        parent.children.append(child)
    return child
