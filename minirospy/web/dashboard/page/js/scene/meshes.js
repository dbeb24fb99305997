// Meshes of package://: fetched through the bridge once, read by their kind, copied for each use.

import {
  BufferAttribute,
  ColladaLoader,
  Group,
  LoadingManager,
  Mesh,
  MeshLambertMaterial,
  STLLoader,
} from "../../vendor/three/three.min.js";
import { t } from "../texts.js";
import { bodyMaterial } from "./shapes.js";

const cache = new WeakMap(); // link -> Map of uri -> promise of an object
const EMPTY_PICTURE = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAA=";

/**
 * Return a promise of an object: a copy with its own materials. `paint` {rgb, alpha} is for meshes without colors, or
 * instead of them.
 */
export async function loadMesh(link, uri, paint) {
  if (!cache.has(link)) cache.set(link, new Map());
  const known = cache.get(link);
  if (!known.has(uri)) {
    const loading = read(link, uri);
    known.set(uri, loading);
    // Not kept: the package may come later.
    loading.catch(() => known.delete(uri));
  }
  const { object, hasColors } = await known.get(uri);
  const copy = object.clone(true);
  copy.traverse((each) => {
    if (!each.isMesh) return;
    const materials = [each.material]
      .flat()
      .map((material) =>
        paint && (paint.isForced || !hasColors)
          ? bodyMaterial(paint.rgb, paint.alpha)
          : faded(material, paint?.alpha ?? 1),
      );
    each.material = Array.isArray(each.material) ? materials : materials[0];
    each.geometry = each.geometry.clone();
  });
  return copy;
}

function faded(material, alpha) {
  const copy = new MeshLambertMaterial({
    map: material.map ?? null,
    side: material.side,
    vertexColors: material.vertexColors,
  });
  if (material.color) copy.color.copy(material.color);
  copy.opacity = (material.opacity ?? 1) * alpha;
  copy.transparent = copy.opacity < 0.9998;
  return copy;
}

async function read(link, uri) {
  if (!uri.startsWith("package://"))
    throw new Error(t("{name}: only meshes of package:// can be loaded", { name: uri || "?" }));
  const bytes = await link.asset(uri);
  const kind = /\.(\w+)$/.exec(uri)?.[1].toLowerCase();
  if (kind === "stl") return { object: readStl(bytes), hasColors: false };
  if (kind === "obj") return { object: readObj(new TextDecoder().decode(bytes)), hasColors: false };
  if (kind === "dae") return { object: await readDae(link, uri, bytes), hasColors: true };
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
  return new Mesh(geometry, bodyMaterial([200, 200, 200]));
}

/** Read the triangles of Wavefront's format; its materials are left out. */
function readObj(text) {
  const vertices = [];
  const positions = [];
  for (const line of text.split("\n")) {
    const [word, ...rest] = line.trim().split(/\s+/);
    if (word === "v") vertices.push(rest.slice(0, 3).map(Number));
    else if (word === "f") {
      const corners = rest
        .map((part) => Number(part.split("/")[0]))
        .map((index) => vertices[index < 0 ? vertices.length + index : index - 1]);
      if (corners.includes(undefined)) throw new Error(t("the mesh names a vertex that it does not have"));
      for (let corner = 2; corner < corners.length; corner++)
        for (const each of [corners[0], corners[corner - 1], corners[corner]]) positions.push(...each);
    }
  }
  const mesh = new Mesh(new STLLoader().parse("solid x\nendsolid x"), bodyMaterial([200, 200, 200]));
  mesh.geometry.setAttribute("position", new BufferAttribute(Float32Array.from(positions), 3));
  mesh.geometry.deleteAttribute("normal");
  mesh.geometry.computeVertexNormals();
  return mesh;
}

async function readDae(link, uri, bytes) {
  const text = new TextDecoder().decode(bytes);
  // The pictures come through the bridge, too: fetched first, since the loader wants addresses.
  const pictures = new Map();
  for (const [, name] of text.matchAll(/<init_from>(?:<ref>)?([^<]+\.(?:png|jpe?g|webp))/gi)) {
    const { pathname } = new URL(name, uri.replace("package://", "http://x/"));
    try {
      pictures.set(name, URL.createObjectURL(new Blob([await link.asset(`package:/${decodeURI(pathname)}`)])));
    } catch {
      pictures.set(name, EMPTY_PICTURE);
    }
  }
  const manager = new LoadingManager();
  manager.setURLModifier((url) => pictures.get(url) ?? EMPTY_PICTURE);
  manager.onLoad = () => {
    for (const url of pictures.values()) if (url.startsWith("blob:")) URL.revokeObjectURL(url);
  };
  const parsed = new ColladaLoader(manager).parse(text, "");
  if (!parsed) throw new Error(t("{name}: this is not a Collada file", { name: uri }));
  // The loader turns the file so that y is up. Robots' descriptions mean the coordinates as they are in the file, and
  // so does RViz.
  parsed.scene.rotation.set(0, 0, 0);
  const group = new Group();
  group.add(parsed.scene);
  return group;
}
