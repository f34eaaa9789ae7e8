// From text back to numbers: base64, deflate, differences. Its other half is encode.rs.

function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflated(id) {
  const element = document.getElementById(id);
  if (!element) return null;
  const stream = new Blob([bytesOf(element.textContent)]).stream().pipeThrough(new DecompressionStream("deflate"));
  element.remove();
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Numbers to the last bit; null where the page has none of this name.
export async function doubles(id) {
  const planes = await inflated(id);
  if (!planes) return null;
  const count = planes.length / 8;
  const bytes = new Uint8Array(planes.length);
  for (let plane = 0; plane < 8; plane++) {
    for (let i = 0; i < count; i++) bytes[8 * i + plane] = planes[plane * count + i];
  }
  return new Float64Array(bytes.buffer);
}

// Whole numbers, each written as the difference from the one `stride` before.
export async function integers(id, stride) {
  const planes = await inflated(id);
  if (!planes) return new Uint32Array(0);
  const count = planes.length / 4;
  const values = new Uint32Array(count);
  for (let i = 0; i < count; i++) {
    const z = planes[i] | (planes[count + i] << 8) | (planes[2 * count + i] << 16) | (planes[3 * count + i] << 24);
    const difference = (z >>> 1) ^ -(z & 1);
    values[i] = (i < stride ? 0 : values[i - stride]) + difference;
  }
  return values;
}

const TIME = 1;
const SPACE = 0;

// Codes of one channel of one frame from their differences, which stand in `bytes` from `at`.
function track(bytes, at, { count, bits, base, mode }, before) {
  const mask = 2 ** bits - 1;
  const planes = Math.ceil(bits / 8);
  const codes = bits > 16 ? new Uint32Array(count) : new Uint16Array(count);
  const past = mode === SPACE ? null : before.codes;
  const shift = past ? (before.base - base) % (mask + 1) : 0;
  let last = 0;
  for (let i = 0; i < count; i++) {
    let z = bytes[at + i];
    if (planes > 1) z |= bytes[at + count + i] << 8;
    if (planes > 2) z |= bytes[at + 2 * count + i] << 16;
    let moved = (z >>> 1) ^ (mask & -(z & 1));
    if (mode !== TIME) moved = (moved + last) & mask;
    last = moved;
    codes[i] = past ? (moved + past[i] + shift) & mask : moved;
  }
  return { codes, base };
}

// The frames of an animation, unpacked group by group.
export class Frames {
  constructor(animation, prefix) {
    this.animation = animation;
    this.prefix = prefix;
    this.count = animation.times.length;
    this.tracks = [];
    this.ready = 0;
  }

  // Unpacks everything; calls `ready` after each group with the number of frames that are ready.
  async load(ready) {
    const { animation } = this;
    const channels = animation.channels.length;
    for (let group = 0; group < animation.groups; group++) {
      const bytes = await inflated(`${this.prefix}group-${group}`);
      let at = 0;
      const end = Math.min(this.count, (group + 1) * animation.group);
      for (let frame = this.ready; frame < end; frame++) {
        for (let c = 0; c < channels; c++) {
          const n = frame * channels + c;
          const { bits } = animation.channels[c];
          const layout = { count: animation.count, bits, base: animation.bases[n], mode: animation.modes[n] };
          const step = 2 ** animation.exponents[n];
          const { codes, base } = track(bytes, at, layout, this.tracks[n - channels]);
          this.tracks[n] = { codes, base, step, low: base * step, none: 2 ** bits - 1 };
          at += animation.count * Math.ceil(bits / 8);
        }
      }
      this.ready = end;
      ready(end);
      // Lets the page draw and answer in between.
      await new Promise((resume) => setTimeout(resume));
    }
  }

  has(name) {
    return this.animation.channels.some((channel) => channel.name === name);
  }

  // Writes a channel's values at a frame into `out`; NaN where there are none.
  read(name, frame, out) {
    const c = this.animation.channels.findIndex((channel) => channel.name === name);
    const { codes, low, step, none } = this.tracks[frame * this.animation.channels.length + c];
    for (let i = 0; i < out.length; i++) out[i] = codes[i] === none ? NaN : low + step * codes[i];
  }
}
