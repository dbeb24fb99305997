// Shapes that several displays draw: arrows, axes, lines, points. All are made of few kinds of geometry, which are
// shared.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  InstancedBufferAttribute,
  InstancedMesh,
  LineBasicMaterial,
  LineMaterial,
  LineSegments,
  LineSegments2,
  LineSegmentsGeometry,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  Points,
  Quaternion,
  ShaderMaterial,
  SphereGeometry,
  Vector3,
} from "../../vendor/three/three.min.js";

const FADED = 0.3; // of the opacity of what nobody publishes any more
const X_AXIS = new Vector3(1, 0, 0);
// Cylinder and cone along x from 0 to 1, of diameter 1: an arrow's parts, scaled.
const SHAFT = new CylinderGeometry(0.5, 0.5, 1, 16).rotateZ(-Math.PI / 2).translate(0.5, 0, 0);
const HEAD = new ConeGeometry(0.5, 1, 20).rotateZ(-Math.PI / 2).translate(0.5, 0, 0);
export const BOX = new BoxGeometry(1, 1, 1);
export const BALL = new SphereGeometry(0.5, 24, 16);
export const ROLL = new CylinderGeometry(0.5, 0.5, 1, 28).rotateX(Math.PI / 2); // along z
// Boxes of lists and clouds have the same light from everywhere: by their sides, +x, -x, +y, -y, +z, -z, as measured in
// RViz.
const CRATE = new BoxGeometry(1, 1, 1);
CRATE.setAttribute(
  "color",
  new BufferAttribute(Float32Array.from([0.6, 0.6, 0.4, 1, 0.9, 0.5].flatMap((light) => Array(12).fill(light))), 3),
);
const SHARED = new Set([SHAFT, HEAD, BOX, BALL, ROLL, CRATE]);

// As in RViz, light is computed at the vertices, and interpolated between them. With interpolated normals, large faces
// of smooth bodies would be brighter, such as the sides of a PR2's base.
const LIT_VERTICES = `
#if NUM_DIR_LIGHTS > 0
struct DirectionalLight {
  vec3 direction;
  vec3 color;
};
uniform DirectionalLight directionalLights[NUM_DIR_LIGHTS];
#endif
varying vec3 frontLight;
varying vec3 backLight;
void main() {
  frontLight = vec3(0.0);
  backLight = vec3(0.0);`;
const LIGHT_OF_VERTEX = `#include <normal_vertex>
#if NUM_DIR_LIGHTS > 0
  for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
    float cosine = dot(normalize(transformedNormal), directionalLights[i].direction);
    frontLight += max(cosine, 0.0) * directionalLights[i].color;
    backLight += max(-cosine, 0.0) * directionalLights[i].color;
  }
#endif`;
const LIGHT_OF_FRAGMENT = `#include <lights_fragment_begin>
  vec3 directLightOfFace = frontLight;
#ifdef DOUBLE_SIDED
  if (!gl_FrontFacing) directLightOfFace = backLight;
#endif
  reflectedLight.directDiffuse = directLightOfFace * BRDF_Lambert(material.diffuseColor);`;

/** A material of bodies. Directional and ambient lights shine on it. */
export class BodyMaterial extends MeshLambertMaterial {
  /** Code for the fragment shader: each inserted after a chunk of three's. */
  edits = /** @type {[string, string][]} */ ([]);

  onBeforeCompile(shader) {
    shader.vertexShader = shader.vertexShader
      .replace("void main() {", LIT_VERTICES)
      .replace("#include <normal_vertex>", LIGHT_OF_VERTEX);
    shader.fragmentShader = shader.fragmentShader
      .replace("void main() {", "varying vec3 frontLight;\nvarying vec3 backLight;\nvoid main() {")
      .replace("#include <lights_fragment_begin>", LIGHT_OF_FRAGMENT);
    for (const [chunk, code] of this.edits) {
      const include = `#include <${chunk}>`;
      shader.fragmentShader = shader.fragmentShader.replace(include, `${include}\n  ${code}`);
    }
  }

  /** Return the key by which materials share a compiled program. */
  customProgramCacheKey() {
    return `body ${JSON.stringify(this.edits)}`;
  }
}

/**
 * Return the material of a body.
 * @param {number[]} rgb from 0 to 255
 */
export function bodyMaterial([r, g, b], alpha = 1, options = {}) {
  const material = new BodyMaterial({
    transparent: alpha < 0.9998,
    opacity: alpha,
    depthWrite: alpha >= 0.9998,
    ...options,
  });
  material.color.setRGB(r / 255, g / 255, b / 255);
  return material;
}

/**
 * Return the material of what no light changes.
 * @param {number[]} rgb from 0 to 255
 */
export function plainMaterial([r, g, b], alpha = 1, options = {}) {
  const material = new MeshBasicMaterial({
    transparent: alpha < 0.9998,
    opacity: alpha,
    depthWrite: alpha >= 0.9998,
    ...options,
  });
  material.color.setRGB(r / 255, g / 255, b / 255);
  return material;
}

/** Return an arrow along x: lengths and diameters in metres. */
export function arrow(material, { shaft, shaftWidth, head, headWidth }) {
  const body = new Mesh(SHAFT, material);
  body.scale.set(shaft, shaftWidth, shaftWidth);
  const point = new Mesh(HEAD, material);
  point.position.x = shaft;
  point.scale.set(head, headWidth, headWidth);
  const group = new Group();
  group.add(body, point);
  return group;
}

/** Turn an object that is along x so that it leads from one point to another. */
export function directed(object, from, to) {
  object.position.copy(from);
  object.quaternion.copy(new Quaternion().setFromUnitVectors(X_AXIS, to.clone().sub(from).normalize()));
  return object;
}

const AXES = [
  [255, 0, 0],
  [0, 255, 0],
  [0, 0, 255],
].map((rgb) => Object.assign(bodyMaterial(rgb), { userData: { isShared: true } }));

/**
 * Return axes as RViz's: x red, y green, z blue. What RViz calls a radius is the diameter of what it draws; so it is
 * here.
 */
export function axes(length, radius) {
  const group = new Group();
  AXES.forEach((material, index) => {
    const bar = new Mesh(SHAFT, material);
    bar.scale.set(length, radius, radius);
    if (index === 1) bar.rotation.z = Math.PI / 2;
    if (index === 2) bar.rotation.y = -Math.PI / 2;
    group.add(bar);
  });
  return group;
}

/**
 * Return lines, two points each (numbers in a row): of a width in pixels, or metres. Colors are those of points, three
 * numbers of 0 to 1 each.
 */
export function segments(
  positions,
  { rgb = [255, 255, 255], colors = null, alpha = 1, pixels = 1.5, metres = null } = {},
) {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(positions);
  const material = new LineMaterial({
    linewidth: metres ?? pixels,
    worldUnits: metres !== null,
    transparent: alpha < 0.9998,
    opacity: alpha,
  });
  if (colors) {
    geometry.setColors(colors);
    material.vertexColors = true;
  } else material.color.setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255);
  return new LineSegments2(geometry, material);
}

/** Return the points of a chain as pairs, for segments. */
export function chain(points, size = 3) {
  const pairs = new Float32Array(Math.max(0, points.length / size - 1) * size * 2);
  for (let index = 0; index + size < points.length; index += size) {
    for (let part = 0; part < size * 2; part++) pairs[index * 2 + part] = points[index + part];
  }
  return pairs;
}

/** Return lines of one pixel, for grids. */
export function hairlines(positions, rgb, alpha) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  const material = new LineBasicMaterial({ transparent: alpha < 0.9998, opacity: alpha, depthWrite: false });
  material.color.setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255);
  const lines = new LineSegments(geometry, material);
  lines.userData.isUnpicked = true;
  return lines;
}

const POINT_VERTEX = `
uniform float size; uniform float pixels; uniform float isMetres; uniform float grows; uniform vec3 flatColor; uniform float isFlat;
attribute vec3 rgb; varying vec3 shade;
void main() {
  shade = isFlat > 0.5 ? flatColor : rgb;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = isMetres > 0.5 ? clamp(size * (grows > 0.5 ? position.z : 1.0) * pixels / gl_Position.w, 1.0, 128.0) : size;
}`;
const POINT_FRAGMENT = `
uniform float opacity; uniform float isRound; varying vec3 shade;
void main() {
  float light = 1.0;
  if (isRound > 0.5) {
    vec2 at = gl_PointCoord * 2.0 - 1.0;
    float square = dot(at, at);
    if (square > 1.0) discard;
    light = 0.78 + 0.22 * sqrt(1.0 - square); // as measured in RViz
  }
  gl_FragColor = vec4(shade * light, opacity);
}`;

/**
 * Return points: positions (Float32Array), colors (RGB bytes) or null for `rgb`; size in metres (`grows`: times z) or
 * pixels.
 */
export function points(
  positions,
  colors,
  { rgb = [255, 255, 255], alpha = 1, size, isMetres, grows = false, isRound = false },
) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("rgb", new BufferAttribute(colors ?? new Uint8Array(positions.length), 3, true));
  const material = new ShaderMaterial({
    vertexShader: POINT_VERTEX,
    fragmentShader: POINT_FRAGMENT,
    transparent: alpha < 0.9998,
    depthWrite: alpha >= 0.9998,
    uniforms: {
      size: { value: size },
      isMetres: { value: isMetres ? 1 : 0 },
      grows: { value: grows ? 1 : 0 },
      pixels: { value: 1 },
      opacity: { value: alpha },
      isRound: { value: isRound ? 1 : 0 },
      isFlat: { value: colors ? 0 : 1 },
      flatColor: { value: new Vector3(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255) },
    },
  });
  const found = new Points(geometry, material);
  /** @type {any} */
  const viewport = {
    copy({ w }) {
      this.height = w;
      return this;
    },
  };
  found.onBeforeRender = (renderer, scene, camera) => {
    // Half the height of the picture, times the projection: pixels of a metre at w = 1.
    material.uniforms.pixels.value =
      renderer.getCurrentViewport(viewport).height * 0.5 * camera.projectionMatrix.elements[5];
    material.uniformsNeedUpdate = true;
  };
  return found;
}

/** Return boxes or balls of one size [x, y, z]: positions in a row, colors (RGB bytes) or null for `rgb`. */
export function solids(positions, colors, { rgb = [255, 255, 255], alpha = 1, size, isRound = false }) {
  const material = plainMaterial(colors ? [255, 255, 255] : rgb, alpha, { vertexColors: !isRound });
  if (isRound) material.onBeforeCompile = shadeBalls;
  const count = positions.length / 3;
  const mesh = new InstancedMesh(isRound ? BALL : CRATE, material, count);
  const matrix = new Matrix4().makeScale(size[0], size[1], size[2]);
  for (let index = 0; index < count; index++)
    mesh.setMatrixAt(
      index,
      matrix.setPosition(positions[index * 3], positions[index * 3 + 1], positions[index * 3 + 2]),
    );
  if (colors) mesh.instanceColor = new InstancedBufferAttribute(colors, 3, true);
  return mesh;
}

/** Let balls be a little darker at their edges, like the points that are drawn as spheres. */
function shadeBalls(shader) {
  shader.vertexShader = shader.vertexShader.replace(
    "void main() {",
    "varying float facing;\nvoid main() {\n  facing = normalize(normalMatrix * mat3(instanceMatrix) * normal).z;",
  );
  shader.fragmentShader = shader.fragmentShader
    .replace("void main() {", "varying float facing;\nvoid main() {")
    .replace(
      "#include <opaque_fragment>",
      "outgoingLight *= 0.78 + 0.22 * max(facing, 0.0);\n#include <opaque_fragment>",
    );
}

/** Return triangles: positions in a row, colors (RGB of 0 to 1) or null. */
export function triangles(positions, colors, rgb, alpha) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  if (colors) geometry.setAttribute("color", new BufferAttribute(colors, 3));
  // Light does not change colors of their own, as in RViz.
  if (colors)
    return new Mesh(geometry, plainMaterial([255, 255, 255], alpha, { side: DoubleSide, vertexColors: true }));
  geometry.computeVertexNormals();
  return new Mesh(geometry, bodyMaterial(rgb, alpha, { side: DoubleSide }));
}

/**
 * Return the ellipsoid of a covariance's upper left three by three (row by row, `width` numbers a row), one standard
 * deviation.
 */
export function ellipse(covariance, width = 6) {
  // In the plane, exactly: what robots on floors have; its height is that of z alone.
  const [a, b, d] = [covariance[0], covariance[1], covariance[width + 1]];
  const middle = (a + d) / 2;
  const part = Math.hypot((a - d) / 2, b);
  const size = (variance) => 2 * Math.sqrt(Math.max(variance, 1e-8));
  const ball = new Mesh(BALL, bodyMaterial([204, 51, 204], 0.3));
  ball.scale.set(size(middle + part), size(middle - part), size(covariance[2 * width + 2]));
  ball.rotation.z = 0.5 * Math.atan2(2 * b, a - d);
  return ball;
}

/**
 * Remove an object with all that the graphics card keeps of it. `release` disposes of a material: Stage.release does so
 * after the next picture, so that the next message's material uses the same compiled program.
 */
export function discard(object, release = (material) => material.dispose()) {
  object.removeFromParent();
  object.traverse((each) => {
    if (each.geometry && !SHARED.has(each.geometry)) each.geometry.dispose();
    for (const material of [each.material ?? []].flat()) {
      if (AXES.includes(material)) continue;
      material.map?.dispose();
      release(material);
    }
    if (each.isInstancedMesh) each.dispose();
  });
}

/** Let what an object shows fade, or show it in full again. Materials that other objects use keep their colors. */
export function fade(object, isFaded) {
  object.traverse((/** @type {any} */ each) => {
    for (const material of each.material ? [each.material].flat() : []) {
      if (material.userData.isShared) continue;
      const full = (material.userData.full ??= {
        opacity: material.uniforms?.opacity?.value ?? material.opacity,
        transparent: material.transparent,
      });
      const opacity = full.opacity * (isFaded ? FADED : 1);
      if (material.uniforms?.opacity) material.uniforms.opacity.value = opacity;
      else material.opacity = opacity;
      if (material.transparent !== (isFaded || full.transparent)) material.needsUpdate = true;
      material.transparent = isFaded || full.transparent;
    }
  });
}
