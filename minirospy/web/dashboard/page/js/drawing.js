// What the drawings of graphs, frames and state machines have in common: lines, loops, and names that are too long for
// a box. Pure.

const MAX_NAME_LENGTH = 60; // characters of a name in a drawing
const SPREAD = 9; // pixels from the middle of a side to the ends of a loop

/** Return a name that fits a box; what is left out is in the middle, as names differ at their ends. */
export function brief(name, most = MAX_NAME_LENGTH) {
  const letters = [
    ...name.slice(0, 4 * most),
    ...(name.length > 8 * most ? name.slice(-4 * most) : name.slice(4 * most)),
  ];
  if (letters.length <= most) return name;
  const end = Math.floor((most - 1) / 2);
  return `${letters.slice(0, most - 1 - end).join("")}…${letters.slice(-end).join("")}`;
}

/** Return the path of a line along these points, as SVG's. */
export function pathOf(points) {
  return points.map(({ x, y }, index) => `${index ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
}

/**
 * Return a line's points so that the line does not cross its label, which is at one of the points: from left to right
 * it runs level between the label's lines of text, downwards it runs straight past the label's left side.
 */
export function aroundLabel(points, { x, y, width, height }, isLevel) {
  const distance = (point) => Math.hypot(point.x - x, point.y - y);
  const at = points.reduce((best, point, index) => (distance(point) < distance(points[best]) ? index : best), 0);
  const [from, to] = [points[0], points.at(-1)];
  const [along, half] = isLevel ? ["x", width / 2] : ["y", height / 2];
  const sign = to[along] < from[along] ? -1 : 1;
  const ends = [-half, half].map((far) => ({ x, y, [along]: (isLevel ? x : y) + sign * far }));
  return [...points.slice(0, Math.max(1, at)), ...ends, ...points.slice(Math.min(at + 1, points.length - 1))];
}

/** Return the path of a loop from a box to itself around the place of its label: at the right side, or below. */
export function loopOf({ x, y, width, height }, label) {
  const isRight = Math.abs(label.x - x) / width >= Math.abs(label.y - y) / height;
  const side = isRight ? x + width / 2 : y + height / 2;
  // A cubic curve reaches three quarters of the way to its control points.
  const far = side + ((isRight ? label.x : label.y) - side) * (4 / 3);
  const [at, middle] = [
    isRight
      ? (along, across) => `${along.toFixed(1)} ${across.toFixed(1)}`
      : (along, across) => `${across.toFixed(1)} ${along.toFixed(1)}`,
    isRight ? y : x,
  ];
  return `M${at(side, middle - SPREAD)}C${at(far, middle - 2 * SPREAD)} ${at(far, middle + 2 * SPREAD)} ${at(side, middle + SPREAD)}`;
}
