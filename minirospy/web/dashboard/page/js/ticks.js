// Readable numbers on the axes of a plot: steps of 1, 2 and 5, and texts with the digits that tell them apart. Pure.

const SMALLEST = -32; // powers of ten of the steps, as uPlot's own
const LARGEST = 32;
const MAX_DIGITS = 7; // of a number; beyond them, all but the first are shown as what is added to the first
const MAX_PLAIN = 1e6; // from here on, and below its inverse, numbers have an exponent

/** The distances of the numbers on an axis. */
export const STEPS = Array.from({ length: (LARGEST - SMALLEST + 1) * 3 }, (_, index) =>
  Number(`${[1, 2, 5][index % 3]}e${SMALLEST + Math.floor(index / 3)}`),
);

/** Return the texts of the numbers of an axis, which are ``step`` apart; the same step for all: 0.1, 0.2, 0.3. */
export function tickTexts(values, step) {
  if (!values.length) return [];
  if (!(step > 0)) return values.map(String);
  const most = Math.max(...values.map(Math.abs));
  const power = Math.floor(Math.log10(step) + 1e-9);
  if (most > 0 && Math.floor(Math.log10(most)) - power >= MAX_DIGITS) {
    const [first, ...rest] = values;
    const digits = Math.max(0, -power);
    return [
      first.toFixed(digits),
      ...tickTexts(
        rest.map((each) => each - first),
        step,
      ).map((text) => `+${text}`),
    ];
  }
  if (most >= MAX_PLAIN || step < 1 / MAX_PLAIN) {
    const shared = Math.floor(Math.log10(most) + 1e-9);
    const digits = Math.max(0, shared - power);
    return values.map((each) =>
      Math.abs(each) < step / 2 ? "0" : `${(each / 10 ** shared).toFixed(digits)}e${shared}`,
    );
  }
  const digits = Math.max(0, -power);
  // Adding up steps leaves -0 and 5e-17.
  return values.map((each) => (Math.abs(each) < step / 2 ? (0).toFixed(digits) : each.toFixed(digits)));
}
