// Meshes of packages: fetched through the bridge once, read by their kind, copied for each use. Their colors were
// measured in RViz: tests/interop/rviz_pictures.py, scene "meshes".

import {
  BufferAttribute,
  BufferGeometry,
  ColladaLoader,
  DataTexture,
  Group,
  LoadingManager,
  Mesh,
  RGBAFormat,
  STLLoader,
  UnsignedByteType,
} from "../../vendor/three/three.min.js";
import { t } from "../texts.js";
import { readMaterials, readObj } from "./obj.js";
import { BodyMaterial, bodyMaterial } from "./shapes.js";

const cache = new WeakMap(); // link -> Map of uri -> promise of an object
const EMPTY_PICTURE = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAA=";
const GRAY = [153, 153, 153]; // of a file without any material
const REPEATED = 1000; // three's RepeatWrapping
const NEAREST_MIPMAP = 1007; // three's LinearMipmapNearestFilter

/**
 * Return a promise of an object: a copy with its own materials.
 *
 * `paint` {rgb, alpha, map} is for meshes whose kind has no materials (STL), or instead of them (`isForced`). Of
 * others, `alpha` is their opacity, and `tint` a color that is mixed with theirs, as RViz does for markers.
 */
export async function loadMesh(link, uri, paint) {
  const { object } = await cached(link, uri, () => read(link, uri));
  const copy = object.clone(true);
  copy.traverse((each) => {
    if (!each.isMesh) return;
    const materials = [each.material]
      .flat()
      .map((material) =>
        paint?.rgb && (paint.isForced || material.userData.isPlain)
          ? bodyMaterial(paint.rgb, paint.alpha, paint.map ? { map: paint.map } : {})
          : own(material, paint),
      );
    each.material = Array.isArray(each.material) ? materials : materials[0];
    each.geometry = each.geometry.clone();
  });
  return copy;
}

/** Return a promise of the texture of a picture. */
export async function loadTexture(link, uri) {
  return cached(link, uri, async () => {
    const bitmap = await createImageBitmap(new Blob([await link.asset(checked(uri))]));
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    const texture = new DataTexture(data, bitmap.width, bitmap.height, RGBAFormat, UnsignedByteType);
    return Object.assign(texture, { flipY: true, wrapS: REPEATED, wrapT: REPEATED, needsUpdate: true });
  });
}

/** Return what was read of a file, which is read again if that fails: the package may come later. */
function cached(link, uri, load) {
  if (!cache.has(link)) cache.set(link, new Map());
  const known = cache.get(link);
  if (!known.has(uri)) {
    const loading = load();
    known.set(uri, loading);
    loading.catch(() => known.delete(uri));
  }
  return known.get(uri);
}

/**
 * Return a mesh's own material, mixed with a tint. As in RViz, it has the file's diffuse and emitted colors; specular
 * and ambient ones are not shown.
 */
function own(material, paint) {
  const copy = new BodyMaterial({
    map: material.map ?? null,
    side: material.side,
    vertexColors: material.vertexColors,
  });
  if (material.color) copy.color.copy(material.color);
  if (material.emissive) copy.emissive.copy(material.emissive);
  // RViz multiplies with the picture once more for each other picture of the material, such as that of bumps.
  const others = [material.normalMap, material.bumpMap].filter(Boolean).length;
  if (copy.map && others) copy.edits.push(["map_fragment", "diffuseColor *= sampledDiffuseColor;".repeat(others)]);
  let alpha = paint?.alpha ?? 1;
  if (paint?.tint) {
    // RViz draws the tint over the mesh: at most half of it.
    const over = Math.min(alpha, 0.5);
    alpha = 1 - (1 - over) * (1 - alpha);
    const part = alpha ? over / alpha : 0;
    mix(copy, paint.tint, part);
    copy.emissive.multiplyScalar(1 - part);
  }
  copy.userData.emission = copy.emissive.getHex();
  copy.opacity = (material.opacity ?? 1) * alpha;
  copy.transparent = copy.opacity < 0.9998;
  copy.depthWrite = !copy.transparent;
  return copy;
}

/** Mix the color of a material, also that of its texture, with another one: `part` of it. */
function mix(material, [r, g, b], part) {
  const color = [r, g, b].map((each) => (each / 255).toFixed(4)).join(", ");
  material.edits.push([
    "color_fragment",
    `diffuseColor.rgb = mix(diffuseColor.rgb, vec3(${color}), ${part.toFixed(4)});`,
  ]);
}

function checked(uri) {
  if (!/^(package|file):\/\//.test(uri))
    throw new Error(t("{name}: only files of package:// and file:// can be loaded", { name: uri || "?" }));
  return uri;
}

/** Return the address of a file that another file names. */
function beside(uri, name) {
  const [, scheme, path] = /^(package|file):\/\/(.*)$/.exec(uri);
  const root = scheme === "package" ? "http://x/" : "http://x";
  const { pathname } = new URL(name.replace(/^(package|file):\/\//, root), `${root}${path}`);
  return scheme === "package" ? `package:/${decodeURI(pathname)}` : `file://${decodeURI(pathname)}`;
}

async function read(link, uri) {
  const bytes = await link.asset(checked(uri));
  const kind = /\.(\w+)$/.exec(uri)?.[1].toLowerCase();
  if (kind === "stl") return { object: readStl(bytes) };
  if (kind === "obj") return { object: await objectOf(link, uri, bytes) };
  if (kind === "dae") return { object: await readDae(link, uri, bytes) };
  throw new Error(t("{name}: meshes are .stl, .dae or .obj", { name: uri }));
}

function readStl(bytes) {
  const geometry = new STLLoader().parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
  // Some programs write no normals, but zeros.
  const { array } = geometry.getAttribute("normal");
  for (let index = 0; index < array.length; index += 9) {
    if (Math.hypot(array[index], array[index + 1], array[index + 2]) > 0.03) continue;
    geometry.computeVertexNormals();
    break;
  }
  const material = bodyMaterial([200, 200, 200]);
  material.userData.isPlain = true;
  return new Mesh(geometry, material);
}

/** Read a file of Wavefront's format with the colors of its materials. */
async function objectOf(link, uri, bytes) {
  const { parts, libraries } = readObj(new TextDecoder().decode(bytes));
  const colors = new Map();
  for (const name of libraries) {
    try {
      const text = new TextDecoder().decode(await link.asset(beside(uri, name)));
      for (const [material, color] of readMaterials(text)) colors.set(material, color);
    } catch {
      // Without its file a material is gray, as in RViz.
    }
  }
  const group = new Group();
  for (const { material, positions, normals } of parts) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    if (normals) geometry.setAttribute("normal", new BufferAttribute(normals, 3));
    else geometry.computeVertexNormals();
    const { rgb = GRAY, emission = [0, 0, 0] } = colors.get(material) ?? {};
    const body = bodyMaterial(rgb);
    body.emissive.fromArray(emission);
    group.add(new Mesh(geometry, body));
  }
  return group;
}

async function readDae(link, uri, bytes) {
  // As in RViz, text after the end of the file is ignored.
  const whole = new TextDecoder().decode(bytes);
  const end = /<\/COLLADA\s*>/.exec(whole);
  const text = end ? whole.slice(0, end.index + end[0].length) : whole;
  // The pictures come through the bridge, too: fetched first, since the loader wants addresses.
  const pictures = new Map();
  for (const [, name] of text.matchAll(/<init_from>(?:<ref>)?([^<]+\.(?:png|jpe?g|webp))/gi)) {
    try {
      pictures.set(name, URL.createObjectURL(new Blob([await link.asset(beside(uri, name))])));
    } catch {
      pictures.set(name, EMPTY_PICTURE);
    }
  }
  const manager = new LoadingManager();
  manager.setURLModifier((url) => pictures.get(url) ?? EMPTY_PICTURE);
  let areLoading = false;
  manager.onStart = () => (areLoading = true);
  const loaded = new Promise((resolve) => (manager.onLoad = () => resolve(undefined)));
  let parsed;
  try {
    parsed = new ColladaLoader(manager).parse(text, "");
    // A texture is black until its picture is there, and nothing would draw the scene again then.
    if (areLoading) await loaded;
  } finally {
    for (const url of pictures.values()) if (url.startsWith("blob:")) URL.revokeObjectURL(url);
  }
  if (!parsed) throw new Error(t("{name}: this is not a Collada file", { name: uri }));
  // The loader turns the file so that y is up. Robots' descriptions mean the coordinates as they are in the file, and
  // so does RViz.
  parsed.scene.rotation.set(0, 0, 0);
  const others = []; // lamps and cameras, which are not part of a body
  let first = null;
  parsed.scene.traverse((/** @type {any} */ each) => {
    if (each.isLight || each.isCamera) others.push(each);
    for (const material of each.isMesh ? [each.material].flat() : []) if (!isMissing(material)) first ??= material;
  });
  for (const each of others) each.removeFromParent();
  // RViz gives the file's first material to a mesh without any.
  const replaced = first ?? bodyMaterial(GRAY);
  const known = (material) => (isMissing(material) ? replaced : material);
  const materials = new Set();
  parsed.scene.traverse((/** @type {any} */ each) => {
    if (!each.isMesh) return;
    // Light is computed at the vertices, from their normals. As in RViz, a file without normals has flat faces.
    if (!each.geometry.getAttribute("normal")) each.geometry.computeVertexNormals();
    each.material = Array.isArray(each.material) ? each.material.map(known) : known(each.material);
    for (const material of [each.material].flat()) materials.add(material);
  });
  // After the last call of isMissing, which looks at the map: meshes share materials.
  for (const material of materials) {
    setColors(material);
    // RViz ignores <transparency>: some programs write 0 for opaque materials.
    material.opacity = 1;
  }
  const group = new Group();
  group.add(parsed.scene);
  return group;
}

/** Show a texture as RViz does, with its picture's colors; without the picture, show the material's color. */
function setColors(material) {
  const { map } = material;
  if (!map) return;
  if (!map.image || map.image.src === EMPTY_PICTURE) material.map = null;
  else Object.assign(map, { colorSpace: "", minFilter: NEAREST_MIPMAP });
}

/** Return whether ColladaLoader made this material, for a mesh without one or with one that the file does not have. */
function isMissing({ name, type, map, color, specular, shininess }) {
  if (name === "__DEFAULT") return true;
  const isUnchanged = color?.getHex() === 0xffffff && specular?.getHex() === 0x111111 && shininess === 30;
  return type === "MeshPhongMaterial" && name === "" && !map && isUnchanged;
}
