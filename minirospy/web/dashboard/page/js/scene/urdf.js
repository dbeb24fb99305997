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
 * A visual is {origin, geometry: {kind, size | radius, length | uri, scale}, color: [r, g, b, a] | null,
 * texture: uri or ""}; a joint
 * {name, type, parent, child,
 * origin, axis, mimic: {joint, multiplier, offset} | null}. */
export function parseUrdf(text) {
  const robot = parseXml(text);
  if (robot.name !== "robot") throw new UrdfError(t("<{name}>, where <robot> is expected", { name: robot.name }));
  const notes = [...robot.notes];
  // Materials within links count for all links, too.
  const paints = new Map();
  const visuals = named(robot, "link").flatMap((link) => named(link, "visual"));
  for (const material of [
    ...named(robot, "material"),
    ...visuals.map((visual) => first(visual, "material")).filter((each) => each?.attributes.name),
  ]) {
    const paint = paintOf(material);
    if (paint.color || paint.texture) paints.set(material.attributes.name, paint);
  }

  const links = new Map();
  for (const link of named(robot, "link")) {
    const shapes = (kind) =>
      named(link, kind)
        .map((each) => {
          try {
            return shapeOf(each, paints);
          } catch (error) {
            if (!(error instanceof UrdfError)) throw error;
            // As in ROS, the fault costs this shape, not the robot.
            notes.push(
              t('link "{link}": a shape is left out: {why}', { link: link.attributes.name, why: error.message }),
            );
            return null;
          }
        })
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
  return { name: robot.attributes.name ?? "", root: roots[0], links, joints, notes };
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

/** Return {color, texture} of a material; a color that cannot be read is none. */
function paintOf(material) {
  const color = first(material, "color");
  const texture = first(material, "texture")?.attributes.filename ?? "";
  try {
    return { color: color ? numbers(color.attributes.rgba, [1, 1, 1, 1]) : null, texture };
  } catch {
    return { color: null, texture };
  }
}

function shapeOf(element, paints) {
  const geometry = first(element, "geometry")?.children[0];
  if (!geometry) return null;
  const { attributes } = geometry;
  const material = first(element, "material");
  let paint = material ? paintOf(material) : { color: null, texture: "" };
  if (material && !paint.color && !paint.texture) paint = paints.get(material.attributes.name) ?? paint;
  const size = (name) => numbers(attributes[name], [NaN])[0];
  const kinds = {
    box: () => ({ kind: "box", size: numbers(attributes.size, [1, 1, 1]) }),
    sphere: () => ({ kind: "sphere", radius: size("radius") }),
    cylinder: () => ({ kind: "cylinder", radius: size("radius"), length: size("length") }),
    mesh: () => ({ kind: "mesh", uri: attributes.filename ?? "", scale: numbers(attributes.scale, [1, 1, 1]) }),
  };
  if (!Object.hasOwn(kinds, geometry.name))
    throw new UrdfError(t("the shape <{name}> is not known", { name: geometry.name }));
  const made = kinds[geometry.name]();
  if ([made.radius ?? 0, made.length ?? 0].includes(NaN))
    throw new UrdfError(t("<{name}> without radius or length", { name: geometry.name }));
  return { origin: originOf(element), geometry: made, ...paint };
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
