// The clock: which frame is shown, and how it goes on.

// Seconds in which an animation is shown whole at speed 1, and the most frames in a second.
const WHOLE = 12;
const FASTEST = 60;

export class Player {
  // `times` are the clock's values at the frames; `shown` is called at each new frame.
  constructor(times, shown) {
    Object.assign(this, { times, shown, frame: 0, ready: 0, speed: 1, playing: false, carry: 0 });
  }

  get last() {
    return this.times.length - 1;
  }

  go(frame) {
    const wanted = Math.min(Math.max(Math.round(frame), 0), Math.max(this.ready - 1, 0));
    if (wanted === this.frame) return;
    this.frame = wanted;
    this.shown(wanted);
  }

  // To the frame nearest to a value of the clock.
  seek(time) {
    let best = 0;
    this.times.forEach((at, frame) => {
      if (Math.abs(at - time) < Math.abs(this.times[best] - time)) best = frame;
    });
    this.pause();
    this.go(best);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.frame >= this.last) this.go(0);
    Object.assign(this, { playing: true, carry: 0, before: performance.now() });
    this.changed?.();
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.changed?.();
  }

  tick(now) {
    if (!this.playing) return;
    const rate = Math.min(Math.max(this.last / WHOLE, 4), FASTEST) * this.speed;
    this.carry += (Math.max(now - this.before, 0) / 1000) * rate;
    this.before = now;
    const whole = Math.floor(this.carry);
    this.carry -= whole;
    // Frames that are not unpacked yet are waited for.
    if (whole) this.go(this.frame + whole);
    if (this.frame >= this.last) this.pause();
    else requestAnimationFrame((next) => this.tick(next));
  }
}
