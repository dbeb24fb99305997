// What a camera's sensor_msgs/CameraInfo says of its picture. Pure.

import { t } from "../texts.js";

const [NEAR, FAR] = [0.01, 100]; // metres, as in RViz

/** Return the topic of the camera info that belongs to an image's topic. */
export const infoTopicOf = (topic) => `${topic.slice(0, topic.lastIndexOf("/"))}/camera_info`;

/** Return {matrix (of the projection, column by column), offset (of the camera in its frame, metres)}. Throws Error. */
export function projectionOf({ width, height, P }, zoom = 1) {
  const [fx, , cx, tx, , fy, cy, ty] = P;
  if (![...P].every(Number.isFinite)) throw new Error(t("Contains invalid floating point values (nans or infs)"));
  if (!width || !height)
    throw new Error(
      t("Could not determine width/height of image due to malformed CameraInfo (either width or height is 0)"),
    );
  if (!fx || !fy) throw new Error(t("the camera is not calibrated: P of its CameraInfo has no focal length"));
  const matrix = [
    ((2 * fx) / width) * zoom,
    0,
    0,
    0,
    0,
    ((2 * fy) / height) * zoom,
    0,
    0,
    (1 - (2 * cx) / width) * zoom,
    ((2 * cy) / height - 1) * zoom,
    -(FAR + NEAR) / (FAR - NEAR),
    -1,
    0,
    0,
    (-2 * FAR * NEAR) / (FAR - NEAR),
    0,
  ];
  return { matrix, offset: [-tx / fx, -ty / fy, 0] };
}
