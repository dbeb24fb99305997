// Robot descriptions: the text of a URDF becomes links with their shapes, and joints. Pure. Source:
// http://wiki.ros.org/urdf/XML.

import { t } from "../texts.js";
import { compose, fromRpy, IDENTITY, normalized } from "./transforms.js";
import { parseXml } from "./xml.js";

export class UrdfError extends Error {}

/**
 * Return {name, root, links: Map of name -> {name, visuals, collisions}, joints: Map of name -> joint, notes: faults of
 * the text that were passed over}.
 * Throws UrdfError or XmlError.
 *
 * A visual is {origin, geometry: {kind, size | radius, length | uri, scale}, color: [r, g, b, a] | null}; a joint
 * {name, type, parent, child,
 * origin, axis, mimic: {joint, multiplier, offset} | null}. */
export function parseUrdf(text) {
  const robot = parseXml(text);
  if (robot.name !== "robot") throw new UrdfError(t("<{name}>, where <robot> is expected", { name: robot.name }));
  const colors = new Map();
  for (const material of named(robot, "material")) {
    const color = colorOf(material);
    if (color) colors.set(material.attributes.name, color);
  }
  // Materials within links count for all links, too.
  for (const link of named(robot, "link")) {
    for (const visual of named(link, "visual")) {
      const material = first(visual, "material");
      if (material?.attributes.name && colorOf(material)) colors.set(material.attributes.name, colorOf(material));
    }
  }

  const links = new Map();
  for (const link of named(robot, "link")) {
    const shapes = (kind) =>
      named(link, kind)
        .map((each) => shapeOf(each, colors, link.attributes.name))
        .filter(Boolean);
    links.set(link.attributes.name, {
      name: link.attributes.name,
      visuals: shapes("visual"),
      collisions: shapes("collision"),
    });
  }
  const joints = new Map();
  for (const joint of named(robot, "joint")) {
    const found = jointOf(joint);
    for (const link of [found.parent, found.child]) {
      if (!links.has(link))
        throw new UrdfError(t('joint "{name}": there is no link "{link}"', { name: found.name, link }));
    }
    joints.set(found.name, found);
  }

  const children = new Set([...joints.values()].map(({ child }) => child));
  const roots = [...links.keys()].filter((name) => !children.has(name));
  if (roots.length !== 1)
    throw new UrdfError(
      roots.length ? t("two root links: {names}", { names: roots.join(", ") }) : t("there is no root link"),
    );
  return { name: robot.attributes.name ?? "", root: roots[0], links, joints, notes: robot.notes };
}

/**
 * Return the transforms of all links to the root link, for positions of joints by name; a joint that is not named is at
 * 0.
 */
export function linkPoses({ root, joints }, positions) {
  const byParent = new Map();
  for (const joint of joints.values()) byParent.set(joint.parent, [...(byParent.get(joint.parent) ?? []), joint]);
  const poses = new Map([[root, IDENTITY]]);
  const waiting = [root];
  while (waiting.length) {
    const parent = waiting.pop();
    for (const joint of byParent.get(parent) ?? []) {
      if (poses.has(joint.child)) continue;
      poses.set(
        joint.child,
        compose(poses.get(parent), compose(joint.origin, motion(joint, positionOf(joint, positions)))),
      );
      waiting.push(joint.child);
    }
  }
  return poses;
}

function positionOf({ name, mimic }, positions) {
  if (mimic && !positions.has(name)) return (positions.get(mimic.joint) ?? 0) * mimic.multiplier + mimic.offset;
  return positions.get(name) ?? 0;
}

function motion({ type, axis }, position) {
  if (type === "prismatic") return { p: axis.map((part) => part * position), q: [0, 0, 0, 1] };
  if (type !== "revolute" && type !== "continuous") return IDENTITY;
  const half = Math.sin(position / 2);
  return { p: [0, 0, 0], q: normalized([axis[0] * half, axis[1] * half, axis[2] * half, Math.cos(position / 2)]) };
}

const named = (element, name) => element.children.filter((child) => child.name === name);
const first = (element, name) => element?.children.find((child) => child.name === name);

function numbers(text, usual) {
  const found = (text ?? "").trim().split(/\s+/).filter(Boolean).map(Number);
  if (!found.length) return usual;
  if (found.length !== usual.length || !found.every(Number.isFinite))
    throw new UrdfError(t('"{text}", where {count} numbers are expected', { text, count: usual.length }));
  return found;
}

function originOf(element) {
  const origin = first(element, "origin")?.attributes ?? {};
  return { p: numbers(origin.xyz, [0, 0, 0]), q: fromRpy(numbers(origin.rpy, [0, 0, 0])) };
}

function colorOf(material) {
  const color = first(material, "color");
  return color ? numbers(color.attributes.rgba, [1, 1, 1, 1]) : null;
}

function shapeOf(element, colors, link) {
  const geometry = first(element, "geometry")?.children[0];
  if (!geometry) return null;
  const { attributes } = geometry;
  const material = first(element, "material");
  const color = material ? (colorOf(material) ?? colors.get(material.attributes.name) ?? null) : null;
  const size = (name) => numbers(attributes[name], [NaN])[0];
  const kinds = {
    box: () => ({ kind: "box", size: numbers(attributes.size, [1, 1, 1]) }),
    sphere: () => ({ kind: "sphere", radius: size("radius") }),
    cylinder: () => ({ kind: "cylinder", radius: size("radius"), length: size("length") }),
    mesh: () => ({ kind: "mesh", uri: attributes.filename ?? "", scale: numbers(attributes.scale, [1, 1, 1]) }),
  };
  if (!Object.hasOwn(kinds, geometry.name))
    throw new UrdfError(t('link "{link}": the shape <{name}> is not known', { link, name: geometry.name }));
  const made = kinds[geometry.name]();
  if ([made.radius ?? 0, made.length ?? 0].includes(NaN))
    throw new UrdfError(t('link "{link}": <{name}> without radius or length', { link, name: geometry.name }));
  return { origin: originOf(element), geometry: made, color };
}

function jointOf(element) {
  const { name, type } = element.attributes;
  const mimic = first(element, "mimic")?.attributes;
  const axis = numbers(first(element, "axis")?.attributes.xyz, [1, 0, 0]);
  const length = Math.hypot(...axis) || 1;
  return {
    name,
    type,
    parent: first(element, "parent")?.attributes.link,
    child: first(element, "child")?.attributes.link,
    origin: originOf(element),
    axis: axis.map((part) => part / length),
    mimic: mimic
      ? { joint: mimic.joint, multiplier: Number(mimic.multiplier ?? 1), offset: Number(mimic.offset ?? 0) }
      : null,
  };
}
