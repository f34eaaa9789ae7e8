// Colours, ticks and numbers as text.

// Viridis, perceptually uniform, at every tenth; as in the figures.
const VIRIDIS = [
  [68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140],
  [34, 168, 132], [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37],
];

export const SHADES = 256;

// The value of a style sheet's variable, as [r, g, b].
export function themeColour(name) {
  const text = themeText(name);
  const short = text.length === 4;
  const part = (k) => (short ? text[k + 1] + text[k + 1] : text.slice(1 + 2 * k, 3 + 2 * k));
  return [0, 1, 2].map((k) => parseInt(part(k), 16));
}

export function themeText(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export function viridis(part) {
  const place = Math.min(Math.max(part, 0), 1) * 10;
  const below = Math.min(Math.floor(place), 9);
  return VIRIDIS[below].map((from, k) => Math.round(from + (place - below) * (VIRIDIS[below + 1][k] - from)));
}

// From blue over nearly white to red, as light at both ends.
export function diverging(part) {
  const ends = part < 0.5 ? [33, 102, 172] : [178, 24, 43];
  const away = Math.min(Math.abs(2 * part - 1), 1);
  return ends.map((end) => Math.round(240 + away * (end - 240)));
}

// A palette of SHADES colours, RGBA, and after them the colour of nothing.
export function palette(colourOf) {
  const bytes = new Uint8Array(4 * (SHADES + 1));
  for (let k = 0; k < SHADES; k++) bytes.set([...colourOf(k), 255], 4 * k);
  bytes.set([...themeColour("none"), 255], 4 * SHADES);
  return bytes;
}

// Up to `digits` digits, with a real minus sign.
export function words(value, digits = 6) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  // After rounding: 9999999.7 is 1e7.
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  if (size >= 1e-4 && size < 1e7) return String(rounded).replace("-", "−");
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  return `${Number(mantissa)}e${Number(exponent)}`.replaceAll("-", "−");
}

// A coordinate, to a part of a length: far from the origin that takes more digits.
export function placeWords(value, part) {
  const digits = Math.ceil(Math.log10(Math.abs(value) / part)) + 1;
  return words(value, Number.isFinite(digits) ? Math.min(Math.max(digits, 1), 17) : 6);
}

// Round values from low to high, about `most` of them.
export function ticks(low, high, most) {
  const raw = (high - low) / Math.max(most, 1);
  if (!(raw > 0) || !Number.isFinite(raw)) return [low];
  // Numbers of these digits cannot be distinguished any more.
  if (raw < 2 ** -48 * Math.max(Math.abs(low), Math.abs(high))) return [low];
  const decade = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * decade).find((s) => s >= raw * 0.999);
  return multiples(low, high, step);
}

// The multiples of a step from low to high.
export function multiples(low, high, step) {
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  // Beyond 2^53 a number and the next one are the same.
  const isCounted = count > 0 && Math.max(Math.abs(first), Math.abs(first + count)) < 2 ** 52;
  return Array.from({ length: isCounted ? count : 0 }, (_, k) => (first + k) * step || 0);
}

// Powers of ten from low to high, no more than `most`; round values where the range holds fewer than two.
export function logTicks(low, high, most) {
  const [from, to] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  if (to - from < 1) {
    const round = [1, 2, 5, 10, 20, 50].map((m) => m * 10 ** (from - 1)).filter((v) => v >= low && v <= high);
    return round.length > 1 ? round : ticks(low, high, most);
  }
  const every = Math.ceil((to - from + 1) / most);
  const values = [];
  for (let k = from; k <= to; k += every) values.push(10 ** k);
  return values;
}
