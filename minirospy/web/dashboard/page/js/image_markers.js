// Markers over an image: circles, lines, polygons and points of visualization_msgs/ImageMarker, until they are removed
// or their lifetime ends.
// A position is in pixels of the image, (0, 0) the center of the first one; a width or diameter, too.

import { t } from "./texts.js";

const [CIRCLE, LINE_STRIP, , POLYGON, POINTS] = [0, 1, 2, 3, 4]; // 2 is LINE_LIST
const [ADD, REMOVE] = [0, 1];
const MOST = 5000;

export class ImageMarkers {
  constructor() {
    this.markers = new Map();
  }

  /** Take a message over. `now` in milliseconds. Throws Error on a marker that cannot be shown. */
  process(marker, now) {
    const key = `${marker.id}/${marker.ns}`;
    if (marker.action === REMOVE) {
      this.markers.delete(key);
      return;
    }
    if (marker.action !== ADD) throw new Error(t("the action {action} is not known", { action: marker.action }));
    if (marker.type > POINTS || marker.type < CIRCLE)
      throw new Error(t("the marker type {type} is not known", { type: marker.type }));
    if (!this.markers.has(key) && this.markers.size >= MOST)
      throw new Error(t("more than {count} markers", { count: MOST }));
    const lifetime = marker.lifetime.secs * 1000 + marker.lifetime.nsecs / 1e6;
    this.markers.set(key, { marker, until: lifetime > 0 ? now + lifetime : Infinity });
  }

  /** Remove those whose lifetime has ended; return whether there were any. */
  expire(now) {
    const { size } = this.markers;
    for (const [key, { until }] of this.markers) if (until <= now) this.markers.delete(key);
    return this.markers.size < size;
  }

  /** Draw them all, the oldest first. */
  draw(context) {
    context.save();
    context.translate(0.5, 0.5);
    context.lineCap = context.lineJoin = "round";
    for (const { marker } of this.markers.values()) drawMarker(context, marker);
    context.restore();
  }
}

function drawMarker(context, marker) {
  const { type, points, scale } = marker;
  const width = scale > 0 ? scale : 1;
  const colorOf = (index) => css(marker.outline_colors[index] ?? marker.outline_color);
  context.lineWidth = type === CIRCLE ? 1 : width;
  if (type === CIRCLE || type === POLYGON) {
    context.beginPath();
    if (type === CIRCLE) context.arc(marker.position.x, marker.position.y, width / 2, 0, 2 * Math.PI);
    else for (const { x, y } of points) context.lineTo(x, y);
    context.closePath();
    if (marker.filled) {
      context.fillStyle = css(marker.fill_color);
      context.fill();
    }
    context.strokeStyle = css(marker.outline_color);
    context.stroke();
    return;
  }
  for (const [index, { x, y }] of points.entries()) {
    context.beginPath();
    if (type === POINTS) {
      context.fillStyle = colorOf(index);
      context.arc(x, y, width / 2, 0, 2 * Math.PI);
      context.fill();
    } else if (index > 0 && (type === LINE_STRIP || index % 2)) {
      context.strokeStyle = colorOf(type === LINE_STRIP ? index - 1 : (index - 1) / 2);
      context.moveTo(points[index - 1].x, points[index - 1].y);
      context.lineTo(x, y);
      context.stroke();
    }
  }
}

/**
 * Return a color of std_msgs/ColorRGBA; without opacity it is opaque: image_view2, for which programs leave it out,
 * ignores it.
 */
function css({ r, g, b, a }) {
  const [red, green, blue] = [r, g, b].map((value) => Math.round(value * 255));
  return `rgba(${red}, ${green}, ${blue}, ${a || 1})`;
}
