// Colors as RViz has them: "255; 85; 0" in its files, the rainbow of intensities, the palettes of maps. Pure.

/** Return [r, g, b] from 0 to 255 of "r; g; b"; white if it is none. */
export function rgbOf(text) {
  const found = String(text ?? "")
    .split(";")
    .map((part) => Number(part.trim()));
  return found.length === 3 && found.every((part) => part >= 0 && part <= 255) ? found : [255, 255, 255];
}

export const textOf = (rgb) => rgb.map(Math.round).join("; ");
export const hexOf = (text) =>
  `#${rgbOf(text)
    .map((part) => Math.round(part).toString(16).padStart(2, "0"))
    .join("")}`;
export const fromHex = (hex) => textOf([1, 3, 5].map((start) => parseInt(hex.slice(start, start + 2), 16)));

/** Write RViz's rainbow color of a value from 0 to 1 into three bytes. */
export function rainbow(value, into, at) {
  const clamped = Math.min(Math.max(value, 0), 1);
  const height = clamped * 5 + 1;
  const index = Math.floor(height);
  let rest = height - index;
  if (!(index & 1)) rest = 1 - rest;
  const n = Math.round((1 - rest) * 255);
  const [r, g, b] =
    index <= 1
      ? [n, 0, 255]
      : index === 2
        ? [0, n, 255]
        : index === 3
          ? [0, 255, n]
          : index === 4
            ? [n, 255, 0]
            : [255, n, 0];
  into[at] = r;
  into[at + 1] = g;
  into[at + 2] = b;
}

/** Return 256 colors (RGBA bytes) for the cells of a nav_msgs/OccupancyGrid, as RViz's "map", "costmap" and "raw". */
export function palette(scheme) {
  const colors = new Uint8Array(1024);
  const set = (index, r, g, b, a = 255) => colors.set([r, g, b, a], index * 4);
  for (let value = 0; value < 256; value++) {
    if (scheme === "raw") set(value, value, value, value);
    // Values that a map may not have: green above 100, red to yellow below -1.
    else if (value > 100 && value < 128) set(value, 0, 255, 0);
    else if (value >= 128) set(value, 255, Math.round((255 * (value - 128)) / (254 - 128)), 0);
    else if (scheme === "map") {
      const grey = 255 - Math.round((255 * value) / 100);
      set(value, grey, grey, grey);
    } else {
      const red = Math.round((255 * value) / 100);
      set(value, red, 0, 255 - red);
    }
  }
  if (scheme === "map") set(255, 0x70, 0x89, 0x86);
  if (scheme === "costmap") {
    set(0, 0, 0, 0, 0);
    set(99, 0, 255, 255);
    set(100, 255, 0, 255);
    set(255, 0x70, 0x89, 0x86);
  }
  return colors;
}
