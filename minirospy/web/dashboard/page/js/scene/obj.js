// Files of Wavefront's format, and the colors of their materials. Pure. Source: http://paulbourke.net/dataformats/obj/.

import { t } from "../texts.js";

/**
 * Return {parts: [{material, positions, normals}], libraries}: the triangles by material, and the names of the files of
 * materials. `normals` is null if a corner has none. Throws Error.
 */
export function readObj(text) {
  const vertices = [];
  const directions = [];
  const parts = new Map();
  const libraries = [];
  let material = "";
  for (const line of text.replaceAll(/\\\r?\n/g, " ").split("\n")) {
    const [word, ...rest] = line.trim().split(/\s+/);
    if (word === "v") vertices.push(rest.slice(0, 3).map(Number));
    else if (word === "vn") directions.push(rest.slice(0, 3).map(Number));
    else if (word === "usemtl") material = rest.join(" ");
    else if (word === "mtllib") libraries.push(rest.join(" "));
    else if (word === "f") {
      if (!parts.has(material)) parts.set(material, { positions: [], normals: [] });
      addFace(parts.get(material), rest, vertices, directions);
    }
  }
  return {
    parts: [...parts].map(([name, { positions, normals }]) => ({
      material: name,
      positions: Float32Array.from(positions),
      normals: normals.length === positions.length ? Float32Array.from(normals) : null,
    })),
    libraries,
  };
}

function addFace({ positions, normals }, words, vertices, directions) {
  const at = (list, word) => list[Number(word) < 0 ? list.length + Number(word) : Number(word) - 1];
  const corners = words.map((word) => {
    const [vertex, , normal] = word.split("/");
    return { vertex: at(vertices, vertex), normal: normal ? at(directions, normal) : undefined };
  });
  if (corners.some(({ vertex }) => !vertex)) throw new Error(t("the mesh names a vertex that it does not have"));
  for (let corner = 2; corner < corners.length; corner++) {
    for (const { vertex, normal } of [corners[0], corners[corner - 1], corners[corner]]) {
      positions.push(...vertex);
      if (normal) normals.push(...normal);
    }
  }
}

/**
 * Return the colors of materials by name: {rgb (0 to 255), emission (if it has one; 0 to 1)}. As in RViz, all are
 * opaque.
 */
export function readMaterials(text) {
  const found = new Map();
  let color = null;
  for (const line of text.split("\n")) {
    const [word, ...rest] = line.trim().split(/\s+/);
    if (word === "newmtl") {
      color = { rgb: [153, 153, 153] };
      found.set(rest.join(" "), color);
    } else if (!color) continue;
    else if (word === "Kd" && rest.length >= 3) color.rgb = rest.slice(0, 3).map((part) => Number(part) * 255);
    else if (word === "Ke" && rest.length >= 3) color.emission = rest.slice(0, 3).map(Number);
  }
  return found;
}
