// A moving body or swarm: positions at a frame, and the quantities computed from them.

import { doubles, integers, Frames } from "./unpack.js";

export class Body {
  constructor(animation, number) {
    this.animation = animation;
    this.prefix = `s${number}-`;
    this.count = animation.count;
    this.frames = new Frames(animation, this.prefix);
    this.dx = new Float64Array(this.count);
    this.dy = new Float64Array(this.count);
    this.fields = new Map();
    this.known = new Set();
    this.at = -1;
    this.exact = new Map();
  }

  // Loads the arrays that stay the same in every frame.
  async open() {
    const named = (name) => this.prefix + name;
    this.X = await doubles(named("X"));
    this.Y = await doubles(named("Y"));
    this.ids = await integers(named("ids"), 1);
    this.firstRoles = Uint8Array.from(await integers(named("roles"), 1));
    this.roleChanges = await integers(named("role-changes"), 3);
    await this.openBonds(named);
    await this.openCells(named);
    for (const { key } of this.animation.exact) this.exact.set(key, await doubles(named(`exact-${key}`)));
  }

  async openBonds(named) {
    this.pairs = await integers(named("bonds"), 2);
    this.sees = await integers(named("bond-sees"), 1);
    this.broken = await integers(named("bond-broken"), 1);
    this.orderBonds();
  }

  // Bonds in the order in which they break, those that never do last: the living ones are the end of the list.
  orderBonds() {
    const { pairs, sees, broken } = this;
    const breakOf = (bond) => (broken[bond] === 0 ? Infinity : broken[bond] - 1);
    const order = Array.from(broken.keys());
    if (broken.some((step) => step > 0)) order.sort((a, b) => breakOf(a) - breakOf(b) || a - b);
    this.bonds = new Uint32Array(pairs.length);
    this.oneWay = new Uint8Array(broken.length);
    this.breaks = new Float64Array(broken.length);
    order.forEach((bond, n) => {
      this.bonds.set([pairs[2 * bond], pairs[2 * bond + 1]], 2 * n);
      this.oneWay[n] = sees[bond];
      this.breaks[n] = breakOf(bond);
    });
  }

  async openCells(named) {
    const { corners } = this.animation;
    const cells = corners ? await integers(named("cells"), corners) : new Uint32Array(0);
    // The frame is around the body, and no part of its surface: it has no stress of its own.
    const frame = this.animation.role_names.indexOf("frame");
    const isBody = (_, n) => {
      const first = n - (n % corners);
      for (let k = first; k < first + corners; k++) if (this.firstRoles[cells[k]] === frame) return false;
      return true;
    };
    this.cells = cells.filter(isBody);
    this.orderCells();
  }

  // Triangles in the order in which they are torn: a cell lasts as long as the bonds between its corners.
  orderCells() {
    const { corners } = this.animation;
    const index = this.cells;
    const count = corners ? index.length / corners : 0;
    const dead = new Map();
    for (let n = 0; n < this.breaks.length && this.breaks[n] < Infinity; n++) {
      const [a, b] = [this.bonds[2 * n], this.bonds[2 * n + 1]];
      dead.set(Math.min(a, b) * this.count + Math.max(a, b), this.breaks[n]);
    }
    const torn = new Float64Array(count).fill(Infinity);
    if (dead.size) {
      for (let cell = 0; cell < count; cell++) {
        for (let j = 0; j < corners; j++) {
          for (let k = 0; k < j; k++) {
            const [a, b] = [index[cell * corners + j], index[cell * corners + k]];
            const step = dead.get(Math.min(a, b) * this.count + Math.max(a, b));
            if (step !== undefined) torn[cell] = Math.min(torn[cell], step);
          }
        }
      }
    }
    this.tornAt = torn;
    const order = Array.from(torn.keys());
    if (dead.size) order.sort((a, b) => torn[a] - torn[b] || a - b);
    this.trianglesPerCell = Math.max(corners - 2, 0);
    this.triangles = new Uint32Array(3 * this.trianglesPerCell * count);
    this.torn = new Float64Array(count);
    let at = 0;
    order.forEach((cell, n) => {
      this.torn[n] = torn[cell];
      for (let k = 1; k + 1 < corners; k++) {
        const first = cell * corners;
        this.triangles.set([index[first], index[first + k], index[first + k + 1]], at);
        at += 3;
      }
    });
  }

  // Whether frames are even parts of one load, to which all is proportional.
  get isEvenLoad() {
    return this.animation.linear && this.animation.clock.quantity === "load";
  }

  get last() {
    return this.animation.times.length - 1;
  }

  name(particle) {
    return this.animation.names[particle] ?? String(this.ids[particle] ?? particle + 1);
  }

  find(name) {
    const named = this.animation.names.indexOf(name);
    if (named >= 0) return named;
    const id = Number(name);
    if (this.ids.length) return this.ids.indexOf(id);
    return Number.isInteger(id) && id >= 1 && id <= this.count ? id - 1 : -1;
  }

  // Takes up a frame's displacements.
  go(frame) {
    if (frame === this.at) return;
    this.frames.read("dx", frame, this.dx);
    this.frames.read("dy", frame, this.dy);
    this.at = frame;
    this.gradients = null;
    this.known.clear();
  }

  get step() {
    return this.animation.times[this.at];
  }

  // The number of entries of a list sorted by step that are over by now.
  over(steps) {
    let [low, high] = [0, steps.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (steps[middle] <= this.step) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  brokenBonds() {
    return this.over(this.breaks);
  }

  tornCells() {
    return this.over(this.torn);
  }

  roles() {
    const roles = this.firstRoles.slice();
    const changes = this.roleChanges;
    for (let n = 0; n < changes.length && changes[n] <= this.step; n += 3) roles[changes[n + 1]] = changes[n + 2];
    return roles;
  }

  // A quantity of every particle at this frame; NaN where there is none. The array is used again at the next frame.
  field(key) {
    if (!this.fields.has(key)) this.fields.set(key, new Float64Array(this.count));
    const out = this.fields.get(key);
    if (!this.known.has(key)) this.compute(key, out);
    this.known.add(key);
    return out;
  }

  compute(key, out) {
    const exact = this.exact.get(key);
    const isEven = key === "von_mises" && this.isEvenLoad;
    if (exact && (this.at === this.last || isEven)) {
      const part = this.at === this.last ? 1 : this.step / this.animation.times[this.last];
      exact.forEach((value, i) => (out[i] = part * value));
    }
    else if (key === "strain" && this.at === this.last && this.exact.has("strain_xx")) this.strain(out);
    else if (this.frames.has(key)) this.frames.read(key, this.at, out);
    else if (key === "displacement") for (let i = 0; i < this.count; i++) out[i] = Math.hypot(this.dx[i], this.dy[i]);
    else if (key === "pe1") this.pe1(out);
    else if (key === "strain") this.strain(out);
    else if (key === "von_mises" && this.animation.stress) this.vonMises(out);
    else out.fill(NaN);
  }

  // The principal strain largest in size: from what is exact, or from displacements.
  strain(out) {
    const largest = (xx, yy, xy) => Math.abs(xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy);
    const exact = ["xx", "yy", "xy"].map((component) => this.exact.get(`strain_${component}`));
    if (this.at === this.last && exact.every(Boolean)) for (let i = 0; i < this.count; i++) out[i] = largest(...exact.map((one) => one[i]));
    else this.eachStrain((i, xx, yy, xy) => (out[i] = largest(xx, yy, xy)), out);
  }

  // PE1(j) = sum over living bonds of (d - d0)^2.
  pe1(out) {
    const { bonds, oneWay, X, Y, dx, dy } = this;
    out.fill(0);
    for (let n = this.brokenBonds(); n < oneWay.length; n++) {
      const [a, b] = [bonds[2 * n], bonds[2 * n + 1]];
      const [x, y] = [X[b] - X[a], Y[b] - Y[a]];
      const [u, v] = [dx[b] - dx[a], dy[b] - dy[a]];
      // (d - d0) as (d^2 - d0^2) / (d + d0): small stretches keep their digits.
      const now = Math.sqrt((x + u) * (x + u) + (y + v) * (y + v));
      const change = (2 * (x * u + y * v) + u * u + v * v) / (now + Math.sqrt(x * x + y * y));
      out[a] += change * change;
      if (!oneWay[n]) out[b] += change * change;
    }
  }

  // Gradient of the displacement at every particle by least squares over living bonds, as flock/strain.rs has it;
  // four numbers each, NaN where neighbours lie on a line.
  gradient() {
    if (this.gradients) return this.gradients;
    const { bonds, oneWay, X, Y, dx, dy, count } = this;
    const sums = new Float64Array(7 * count);
    // Products of four distances stay in range in a unit of a bond's size: a power of two, which keeps the digits.
    const one = oneWay.length ? Math.hypot(X[bonds[1]] - X[bonds[0]], Y[bonds[1]] - Y[bonds[0]]) : 1;
    const unit = one > 0 ? 2 ** -Math.floor(Math.log2(one)) : 1;
    const add = (i, x, y, u, v) => {
      const at = 7 * i;
      sums[at] += x * x;
      sums[at + 1] += y * y;
      sums[at + 2] += x * y;
      sums[at + 3] += u * x;
      sums[at + 4] += u * y;
      sums[at + 5] += v * x;
      sums[at + 6] += v * y;
    };
    for (let n = this.brokenBonds(); n < oneWay.length; n++) {
      const [a, b] = [bonds[2 * n], bonds[2 * n + 1]];
      const [x, y] = [unit * (X[b] - X[a]), unit * (Y[b] - Y[a])];
      const [u, v] = [unit * (dx[b] - dx[a]), unit * (dy[b] - dy[a])];
      add(a, x, y, u, v);
      if (!oneWay[n]) add(b, x, y, u, v);
    }
    const gradients = new Float64Array(4 * count);
    for (let i = 0; i < count; i++) {
      const at = 7 * i;
      const [xx, yy, xy] = [sums[at], sums[at + 1], sums[at + 2]];
      const [ux, uy, vx, vy] = [sums[at + 3], sums[at + 4], sums[at + 5], sums[at + 6]];
      const det = xx * yy - xy * xy;
      const widest = Math.max(xx, yy);
      const known = det > 1e-13 * widest * widest;
      gradients[4 * i] = known ? (ux * yy - uy * xy) / det : NaN;
      gradients[4 * i + 1] = known ? (uy * xx - ux * xy) / det : NaN;
      gradients[4 * i + 2] = known ? (vx * yy - vy * xy) / det : NaN;
      gradients[4 * i + 3] = known ? (vy * xx - vx * xy) / det : NaN;
    }
    this.gradients = gradients;
    return gradients;
  }

  // Calls with the right stretch less one of every particle that has one.
  eachStrain(take, out) {
    const g = this.gradient();
    for (let i = 0; i < this.count; i++) {
      if (Number.isNaN(g[4 * i])) out[i] = NaN;
      else take(i, ...stretch(g[4 * i], g[4 * i + 1], g[4 * i + 2], g[4 * i + 3]));
    }
  }

  // Of the mean strain of the whole cells around a particle, each by its area, as material/stress.rs has it.
  vonMises(out) {
    const { cells, X, Y, dx, dy, count } = this;
    const { corners, stress: { stiffness, across, turns } } = this.animation;
    const sums = new Float64Array(4 * count);
    for (let cell = 0; cell < cells.length; cell += corners) {
      if (this.tornAt[cell / corners] <= this.step) continue;
      let [area, ux, uy, vx, vy] = [0, 0, 0, 0, 0];
      for (let k = 0; k < corners; k++) {
        const [a, b] = [cells[cell + k], cells[cell + (k + 1) % corners]];
        const [x, y] = [X[b] - X[a], Y[b] - Y[a]];
        const [u, v] = [dx[a] + dx[b] - 2 * dx[cells[cell]], dy[a] + dy[b] - 2 * dy[cells[cell]]];
        area += (X[a] - X[cells[cell]]) * y - (Y[a] - Y[cells[cell]]) * x;
        ux += u * y;
        uy -= u * x;
        vx += v * y;
        vy -= v * x;
      }
      const [a, b, c, d] = [ux, uy, vx, vy].map((sum) => sum / area);
      const strain = turns ? stretch(a, b, c, d) : [a, d, (b + c) / 2];
      // Corners that repeat the last one are of cells with fewer.
      for (let k = 0; k < corners && (k === 0 || cells[cell + k] !== cells[cell + k - 1]); k++) {
        const at = 4 * cells[cell + k];
        strain.forEach((component, c) => (sums[at + c] += area * component));
        sums[at + 3] += area;
      }
    }
    for (let i = 0; i < count; i++) {
      const [xx, yy, xy] = [0, 1, 2].map((c) => sums[4 * i + c] / sums[4 * i + 3]);
      const [p, q, s] = stiffness.map(([a, b, c]) => a * xx + b * yy + 2 * c * xy);
      const z = across * (p + q);
      out[i] = Math.sqrt(((p - q) ** 2 + (q - z) ** 2 + (z - p) ** 2) / 2 + 3 * s * s);
    }
  }

  // The quantities of one particle at this frame, as [{key, label, unit, value}]; at the last frame to the last bit.
  numbers(particle) {
    const { animation } = this;
    const list = [];
    const put = (key, label, unit, value) => list.push({ key, label, unit, value });
    const known = (key) => (this.at === this.last ? this.exact.get(key)?.[particle] : undefined);
    const [x, y] = [known("x") ?? this.X[particle] + this.dx[particle], known("y") ?? this.Y[particle] + this.dy[particle]];
    put("x", "x", animation.unit, x);
    put("y", "y", animation.unit, y);
    put("ux", "x displacement", animation.unit, known("ux") ?? x - this.X[particle]);
    put("uy", "y displacement", animation.unit, known("uy") ?? y - this.Y[particle]);
    for (const { key, label, unit } of animation.quantities) {
      put(key, label, unit, known(key) ?? this.field(key)[particle]);
    }
    const knownKeys = new Set(list.map((one) => one.key));
    if (this.at === this.last) {
      for (const { key, label, unit } of animation.exact) if (!knownKeys.has(key)) put(key, label, unit, known(key));
    }
    return list;
  }
}

// The stretch less one (xx, yy, xy) of a gradient of the displacement, which a turn leaves alone.
function stretch(ux, uy, vx, vy) {
  const [a, d] = [1 + ux, 1 + vy];
  const turn = Math.atan2(vx - uy, a + d);
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  return [cos * a + sin * vx - 1, cos * d - sin * uy - 1, (cos * uy + sin * d + cos * vx - sin * a) / 2];
}
