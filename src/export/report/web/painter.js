// Draws points, lines and triangles by WebGL2.

import { SHADES } from "./colour.js";

const COMMON = `#version 300 es
precision highp float;
precision highp int;
uniform sampler2D palette;
vec4 shade(float value) {
  int k = value < -0.5 ? ${SHADES} : int(clamp(value, 0.0, 1.0) * ${SHADES - 1}.0 + 0.5);
  return texelFetch(palette, ivec2(k, 0), 0);
}`;

const VERTEX = `${COMMON}
layout(location = 0) in vec2 place;
layout(location = 1) in float value;
layout(location = 2) in float radius;
layout(location = 3) in float mark;
uniform vec4 camera;
out float smoothValue;
flat out float flatValue;
flat out float size;
flat out int kind;
void main() {
  smoothValue = flatValue = value;
  size = max(radius * 2.0, 1.6);
  kind = int(mark + 0.5);
  gl_PointSize = size * (kind == 2 ? 1.25 : 1.0) + 1.0;
  gl_Position = vec4((place - camera.xy) * camera.zw, 0.0, 1.0);
}`;

const POINT = `${COMMON}
flat in float flatValue;
flat in float size;
flat in int kind;
out vec4 colour;
// As beyondMark has it.
float beyond(vec2 away) {
  if (kind == 1) return max(away.x, away.y) - 0.45 * size;
  if (kind == 2) return (away.x + away.y - 0.625 * size) * 0.7071;
  return length(away) - 0.5 * size;
}
void main() {
  float beyondRim = beyond(abs(gl_PointCoord - 0.5) * (size * (kind == 2 ? 1.25 : 1.0) + 1.0));
  float cover = clamp(0.5 - beyondRim, 0.0, 1.0);
  if (cover <= 0.0) discard;
  float rim = size > 9.0 ? clamp(beyondRim + 1.6, 0.0, 1.0) * 0.35 : 0.0;
  colour = vec4(shade(flatValue).rgb * (1.0 - rim), 1.0) * cover;
}`;

const FILL = `${COMMON}
in float smoothValue;
flat in float flatValue;
uniform bool isFlat;
uniform vec4 plain;
out vec4 colour;
void main() {
  vec4 own = plain.a > 0.0 ? plain : shade(isFlat ? flatValue : smoothValue);
  colour = vec4(own.rgb * own.a, own.a);
}`;

// Asked once, of a canvas of its own: one that has had a context takes no other.
let standsIn;
function isStandIn() {
  if (standsIn === undefined) {
    const gl = document.createElement("canvas").getContext("webgl2");
    const info = gl?.getExtension("WEBGL_debug_renderer_info");
    const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    standsIn = /swiftshader|llvmpipe|software|basic render/i.test(name);
  }
  return standsIn;
}

export class Painter {
  // Null where the browser has no WebGL2, or, unless asked for, a processor stands in for the graphics card.
  static on(canvas, isAskedFor) {
    if (!isAskedFor && isStandIn()) return null;
    const gl = canvas.getContext("webgl2", { premultipliedAlpha: true, preserveDrawingBuffer: true });
    return gl && new Painter(canvas, gl);
  }

  constructor(canvas, gl) {
    this.canvas = canvas;
    this.gl = gl;
    this.points = this.program(VERTEX, POINT);
    this.fill = this.program(VERTEX, FILL);
    this.buffers = [0, 1, 2, 3].map(() => gl.createBuffer());
    this.index = { bonds: gl.createBuffer(), triangles: gl.createBuffer() };
    [2, 1, 1, 1].forEach((size, location) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[location]);
      gl.enableVertexAttribArray(location);
      // Marks are bytes.
      gl.vertexAttribPointer(location, size, location === 3 ? gl.UNSIGNED_BYTE : gl.FLOAT, false, 0, 0);
    });
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(vertex, fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "shader");
    return program;
  }

  setMesh({ bonds, triangles }) {
    const { gl } = this;
    for (const [name, data] of [["bonds", bonds], ["triangles", triangles]]) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.index[name]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.STATIC_DRAW);
    }
  }

  // `places` are pairs about the origin of the camera, `values` from 0 to 1 or -1 for nothing, `radii` in device pixels,
  // `marks` the numbers of the shapes.
  draw({ places, values, radii, marks, palette, camera, layers, isFlat, bondsFrom, trianglesFrom, bondCount, triangleCount, bondColour }) {
    const { gl, canvas } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    [places, values, radii, marks].forEach((data, location) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[location]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    });
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, SHADES + 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, palette);
    const lens = [camera.x, camera.y, (2 * camera.scale) / canvas.width, (2 * camera.scale) / canvas.height];
    const use = (program) => {
      gl.useProgram(program);
      gl.uniform4fv(gl.getUniformLocation(program, "camera"), lens);
    };
    if (layers.surface || layers.bonds) {
      use(this.fill);
      const plain = gl.getUniformLocation(this.fill, "plain");
      if (layers.surface) {
        gl.uniform4f(plain, 0, 0, 0, 0);
        gl.uniform1i(gl.getUniformLocation(this.fill, "isFlat"), isFlat ? 1 : 0);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.index.triangles);
        gl.drawElements(gl.TRIANGLES, triangleCount, gl.UNSIGNED_INT, 4 * trianglesFrom);
      }
      if (layers.bonds) {
        gl.uniform4f(plain, ...bondColour.map((part) => part / 255), layers.surface ? 0.35 : 0.9);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.index.bonds);
        gl.drawElements(gl.LINES, bondCount, gl.UNSIGNED_INT, 4 * bondsFrom);
      }
    }
    if (layers.points) {
      use(this.points);
      gl.drawArrays(gl.POINTS, 0, values.length);
    }
  }
}
