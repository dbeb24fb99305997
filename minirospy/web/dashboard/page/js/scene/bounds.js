// The place and size of what an object shows.

import { Vector3 } from "../../vendor/three/three.min.js";

/** Return {center: [x, y, z], diameter} of the visible meshes of an object in metres, null if it shows none. */
export function boundsOf(object) {
  const low = new Vector3(Infinity, Infinity, Infinity);
  const high = new Vector3(-Infinity, -Infinity, -Infinity);
  const corner = new Vector3();
  object.updateWorldMatrix(true, true);
  const visit = (each) => {
    if (!each.visible) return;
    if (each.isMesh) {
      each.geometry.computeBoundingBox();
      const { min, max } = each.geometry.boundingBox;
      for (let at = 0; at < 8; at++) {
        corner.set(at & 1 ? max.x : min.x, at & 2 ? max.y : min.y, at & 4 ? max.z : min.z);
        corner.applyMatrix4(each.matrixWorld);
        low.min(corner);
        high.max(corner);
      }
    }
    for (const child of each.children) visit(child);
  };
  visit(object);
  const diameter = low.distanceTo(high);
  if (!Number.isFinite(diameter)) return null;
  return { center: low.add(high).multiplyScalar(0.5).toArray(), diameter };
}
