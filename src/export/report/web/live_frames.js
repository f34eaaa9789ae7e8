// Frames that a session sends, in the place of those that a report holds. The other half is src/live/conductor.rs.

export class LiveFrames {
  constructor(channels, count) {
    Object.assign(this, { channels, ready: 1 });
    this.values = new Map([["dx", new Float64Array(count)], ["dy", new Float64Array(count)]]);
  }

  has(name) {
    return name === "dx" || name === "dy" || this.channels.includes(name);
  }

  read(name, frame, out) {
    const values = this.values.get(name);
    if (values) out.set(values);
    else out.fill(NaN);
  }

  // Takes up a message; null if it has another count than the page.
  take(buffer) {
    const view = new DataView(buffer);
    const [count, present] = [view.getUint32(4, true), view.getUint32(8, true)];
    if (count !== this.values.get("dx").length) return null;
    const [clock, sent, stepTime, frameTime] = [16, 24, 32, 40].map((at) => view.getFloat64(at, true));
    const names = ["dx", "dy", ...this.channels.filter((_, k) => (present >> k) & 1)];
    names.forEach((name, k) => {
      const at = 48 + (8 + 4 * count) * k;
      const unit = view.getFloat64(at, true);
      const values = new Float64Array(new Float32Array(buffer, at + 8, count));
      for (let i = 0; i < count; i++) values[i] *= unit;
      this.values.set(name, values);
    });
    return { clock, sent, stepTime, frameTime };
  }
}

export function kindOf(buffer) {
  return ["", "frame", "roles", "broken"][new DataView(buffer).getUint32(0, true)] ?? "";
}

// Breaks the bonds of these pairs in a body: all anew, or more of them.
export function breakBonds(body, buffer) {
  const isAnew = new DataView(buffer).getUint32(4, true) === 1;
  const pairs = new Uint32Array(buffer, 8);
  body.bondOf ??= bondsByPair(body);
  if (isAnew) body.broken.fill(0);
  for (let n = 0; n < pairs.length; n += 2) {
    const bond = body.bondOf.get(pairKey(body, pairs[n], pairs[n + 1]));
    if (bond !== undefined) body.broken[bond] = 1;
  }
  body.orderBonds();
  body.orderCells();
}

function pairKey(body, a, b) {
  return Math.min(a, b) * body.count + Math.max(a, b);
}

function bondsByPair(body) {
  const bonds = new Map();
  const { pairs } = body;
  for (let n = 0; n < pairs.length; n += 2) bonds.set(pairKey(body, pairs[n], pairs[n + 1]), n / 2);
  return bonds;
}
