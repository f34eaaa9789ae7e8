// The part of a canvas's pen that the page paints with, as an SVG. Circles are circles there.

const round = (value) => String(Math.round(100 * value) / 100);
const escape = (text) => text.replace(/[&<>"]/g, (sign) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[sign]);

export class SvgPen {
  constructor(width, height, title) {
    Object.assign(this, { fillStyle: "#000", strokeStyle: "#000", lineWidth: 1, font: "", dash: [], path: [], clips: 0, depths: [0] });
    // Letters are as wide as on a canvas.
    this.ruler = document.createElement("canvas").getContext("2d");
    this.parts = [
      `<svg xmlns="http://www.w3.org/2000/svg" width="${round(width)}" height="${round(height)}" viewBox="0 0 ${round(width)} ${round(height)}">`,
      `<title>${escape(title)}</title>`,
    ];
  }

  text() {
    return [...this.parts, "</svg>"].join("\n");
  }

  // Groups that are open end with the state that they began in.
  save() {
    this.depths.push(0);
  }

  restore() {
    this.parts.push("</g>".repeat(this.depths.pop()));
  }

  open(attributes) {
    this.parts.push(`<g ${attributes}>`);
    this.depths[this.depths.length - 1] += 1;
  }

  translate(x, y) {
    this.open(`transform="translate(${round(x)} ${round(y)})"`);
  }

  clip() {
    this.clips += 1;
    this.parts.push(`<clipPath id="c${this.clips}"><path d="${this.path.join("")}"/></clipPath>`);
    this.open(`clip-path="url(#c${this.clips})"`);
  }

  beginPath() {
    this.path = [];
  }

  moveTo(x, y) {
    this.path.push(`M${round(x)} ${round(y)}`);
  }

  // The first place of a path is where it begins, as on a canvas.
  lineTo(x, y) {
    this.path.push(`${this.path.length ? "L" : "M"}${round(x)} ${round(y)}`);
  }

  closePath() {
    this.path.push("Z");
  }

  rect(x, y, width, height) {
    this.path.push(`M${round(x)} ${round(y)}h${round(width)}v${round(height)}h${round(-width)}Z`);
  }

  // The page has whole circles alone.
  arc(x, y, radius) {
    const [r, d] = [round(radius), round(2 * radius)];
    this.path.push(`M${round(x - radius)} ${round(y)}a${r} ${r} 0 1 0 ${d} 0a${r} ${r} 0 1 0 -${d} 0Z`);
  }

  setLineDash(dash) {
    this.dash = dash;
  }

  stroke() {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.parts.push(`<path d="${this.path.join("")}" fill="none" stroke="${this.strokeStyle}" stroke-width="${round(this.lineWidth)}"${dash}/>`);
  }

  fill() {
    this.parts.push(`<path d="${this.path.join("")}" fill="${this.fillStyle}"/>`);
  }

  fillRect(x, y, width, height) {
    this.parts.push(`<rect x="${round(x)}" y="${round(y)}" width="${round(width)}" height="${round(height)}" fill="${this.fillStyle}"/>`);
  }

  strokeRect(x, y, width, height) {
    this.beginPath();
    this.rect(x, y, width, height);
    this.stroke();
  }

  measureText(text) {
    this.ruler.font = this.font;
    return this.ruler.measureText(text);
  }

  fillText(text, x, y) {
    if (!text) return;
    this.ruler.font = this.font;
    const [, weight, size, family] = /^(?:(\d+) )?([\d.]+px) (.*)$/.exec(this.ruler.font) ?? [null, null, "11px", "sans-serif"];
    const bold = weight ? ` font-weight="${weight}"` : "";
    this.parts.push(
      `<text x="${round(x)}" y="${round(y)}" font-family="${escape(family)}" font-size="${size}"${bold} fill="${this.fillStyle}">${escape(text)}</text>`,
    );
  }

  drawImage(canvas, x, y, width, height) {
    this.parts.push(
      `<image x="${round(x)}" y="${round(y)}" width="${round(width)}" height="${round(height)}" preserveAspectRatio="none" href="${canvas.toDataURL()}"/>`,
    );
  }
}
