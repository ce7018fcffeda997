// The view: one camera over picture, materials, boundaries and quads, in WebGL 2. Positions are pixels of the picture, y down.

const BLOCK = 2048; // quads that are drawn, or left out, together
const SLOW = 25; // ms of a drawing from which moves show the last one shifted
const REST = 140; // ms after the last move when it is drawn anew
const WIDE = 4096; // texels in a row of a table
export const LARGEST = 4096; // side of a picture that is shown, as in packing.py
const HOLE = 0.25; // square pixels of the picture that are none: what is rounded in the areas of a million quads is less
const NEAR = 0.01; // pixels of the picture from its border that are on it
const VOID = [0, 0, 0, 0];

// Lines and quads are four vertices each, drawn block by block; lines are a table of four numbers in a texture, fetched by
// the number of the vertex: instances would be simpler, but without a graphics card each one costs as much as a drawing.
const CAMERA = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D; precision highp usampler2D;
uniform vec4 camera; // centre, and clip units a pixel of the picture
vec4 seen(vec2 p) { return vec4((p - camera.xy) * vec2(camera.z, -camera.w), 0., 1.); }`;
const PICTURE = {
  vertex: `${CAMERA} uniform vec4 rect; out vec2 at;
    void main() { at = rect.xy + rect.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1); gl_Position = seen(at); }`,
  // labels: of the whole picture, and after noise removal, of `part` of it; right of `split` is after
  fragment: `#version 300 es
    precision highp float; precision highp int; precision highp usampler2D;
    in vec2 at; out vec4 color;
    uniform sampler2D picture, palette; uniform usampler2D before, after;
    uniform vec4 rect, part; uniform float opacity, split;
    vec4 tint(uint place) { return texelFetch(palette, ivec2(int(place & 255u), int(place >> 8)), 0); }
    uint place(usampler2D labels, vec2 uv) {
      ivec2 size = textureSize(labels, 0);
      return texelFetch(labels, clamp(ivec2(uv * vec2(size)), ivec2(0), size - 1), 0).r;
    }
    void main() {
      vec2 uv = (at - rect.xy) / rect.zw, own = (at - part.xy) / part.zw;
      vec4 base = texture(picture, uv);
      bool right = gl_FragCoord.x > split, inside = all(greaterThanEqual(own, vec2(0))) && all(lessThan(own, vec2(1)));
      vec4 over = right ? (inside ? tint(place(after, own)) : vec4(0)) : tint(place(before, uv));
      float hatch = step(.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 14.));
      vec3 bare = mix(base.rgb, vec3(.5), .35 + .3 * hatch); // no material
      color = vec4(mix(base.rgb, over.a > .5 ? over.rgb : bare, opacity), 1);
    }`,
};
const LINES = {
  vertex: `${CAMERA} uniform sampler2D table; uniform vec2 screen; uniform float width; uniform int first;
    void main() {
      int line = first + (gl_VertexID >> 2), corner = gl_VertexID & 3;
      vec4 ends = texelFetch(table, ivec2(line % ${WIDE}, line / ${WIDE}), 0);
      vec2 a = seen(ends.xy).xy * screen, b = seen(ends.zw).xy * screen, along = b - a;
      along /= max(length(along), 1e-6);
      vec2 side = vec2(-along.y, along.x) * width;
      bool far = corner == 1 || corner == 2, up = corner > 1;
      vec2 p = (far ? b + along * width * .5 : a - along * width * .5) + (up ? side : -side);
      gl_Position = vec4(p / screen, 0, 1);
    }`,
  fragment: `#version 300 es
    precision highp float; uniform vec4 ink; out vec4 color; void main() { color = ink; }`,
};
const QUADS = {
  // ink: of the quad, the same at its four corners
  vertex: `${CAMERA} layout(location = 0) in vec2 corner; layout(location = 1) in vec4 ink;
    out vec2 uv; flat out vec3 fill;
    void main() {
      int k = gl_VertexID & 3;
      gl_Position = seen(corner);
      uv = vec2(k == 1 || k == 2, k > 1);
      fill = ink.rgb;
    }`,
  fragment: `#version 300 es
    precision highp float; in vec2 uv; flat in vec3 fill; out vec4 color;
    void main() {
      vec2 size = fwidth(uv), off = min(uv, 1. - uv) / size; // pixels to the nearest edges
      float edge = 1. - smoothstep(.4, 1.3, min(off.x, off.y));
      float fade = smoothstep(3., 9., 1. / max(size.x, size.y)); // small quads would be all edge
      color = vec4(mix(fill, vec3(.08), edge * fade * .75), 1);
    }`,
};

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = (this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true }));
    if (!gl) throw new Error("this browser has no WebGL 2: update it, or allow it hardware acceleration. Files can be made all the same");
    this.programs = { picture: program(gl, PICTURE), lines: program(gl, LINES), quads: program(gl, QUADS) };
    this.textures = {};
    for (const name of ["picture", "palette"]) this.textures[name] = this._texture(gl.RGBA8, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    for (const name of ["before", "after"]) this.textures[name] = this._texture(gl.R8UI, 1, 1, gl.RED_INTEGER, gl.UNSIGNED_BYTE, new Uint8Array(1));
    this.size = [1, 1];
    this.part = null;
    this.labels = { before: null, after: false };
    this.colors = [];
    this.halves = this._buffer(gl.ELEMENT_ARRAY_BUFFER, halvesOf(BLOCK));
    this.camera = { x: 0.5, y: 0.5, scale: 1 };
    this.shown = { picture: true, lines: false, quads: false };
    this.opacity = 0.6;
    this.split = 0;
    this.shaded = false;
    this.fitted = false;
    this.range = [-9, 9];
    this.cost = 0;
    this.frames = 0;
    this.listeners = [];
    new ResizeObserver(() => this._resized() && (this.fitted && this.fit(), this.draw())).observe(canvas.parentElement);
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => location.reload());
  }

  _texture(inner, width, height, form, type, data, smooth = false) {
    const gl = this.gl, made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, form, type, data);
    const filter = smooth ? gl.LINEAR : gl.NEAREST;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    return made;
  }

  _put(name, texture) {
    this.gl.deleteTexture(this.textures[name]);
    this.textures[name] = texture;
  }

  // An image that the browser has decoded, of sides of LARGEST at most; `size` is that of the picture.
  setPicture(image, size) {
    const gl = this.gl;
    this._put("picture", this._texture(gl.RGBA8, image.width, image.height, gl.RGBA, gl.UNSIGNED_BYTE, image));
    this.size = size;
    for (const name of ["lines", "quads", "mark"]) this[name] = void this._drop(this[name]);
    this.labels = { before: null, after: false };
    this.part = null;
  }

  setLabels(which, places, part = null) {
    const gl = this.gl, [rows, columns] = places.shape, wide = places.BYTES_PER_ELEMENT > 1;
    this._put(which, this._texture(wide ? gl.R16UI : gl.R8UI, columns, rows, gl.RED_INTEGER, wide ? gl.UNSIGNED_SHORT : gl.UNSIGNED_BYTE, places));
    if (which === "before") this.labels.before = places;
    else [this.labels.after, this.part] = [true, part];
  }

  // Colours of the materials, in the order of their places; null is one that is not meshed.
  setPalette(colors) {
    const data = new Uint8Array(4 * 256 * Math.ceil((colors.length + 1) / 256));
    colors.forEach((color, k) => data.set(color ? [...rgb(color), 255] : VOID, 4 * k));
    const gl = this.gl;
    this.colors = colors;
    this._put("palette", this._texture(gl.RGBA8, 256, data.length / 1024, gl.RGBA, gl.UNSIGNED_BYTE, data));
  }

  setLines(lines) {
    this._drop(this.lines);
    this.lines = { table: this._table(lines), n: lines.length / 4 };
  }

  setQuads({ corners, jacobians, places }) {
    this._drop(this.quads);
    const gl = this.gl, buffers = [this._buffer(gl.ARRAY_BUFFER, corners), gl.createBuffer()];
    const boxes = boxesOf(corners);
    this.quads = { corners, jacobians, places, buffers, n: jacobians.length, boxes, filled: filledBox(corners, boxes) };
  }

  // Gives the corners of all quads their colours, if these are others than before: grey outside `range`.
  _ink() {
    const { jacobians, places, n, buffers, inked } = this.quads, gl = this.gl, [low, high] = this.range;
    const key = [this.shaded, low, high, ...this.colors].join();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[1]);
    if (key === inked) return;
    const [full, pale] = inksOf(this.shaded ? SHADES : this.colors), inks = new Uint32Array(4 * n);
    for (let q = 0; q < n; q++) {
      const value = jacobians[q], from = value < low || value > high ? pale : full;
      const ink = from[this.shaded ? Math.floor(Math.min(Math.max(value, 0), 0.9999) * SHADES.length) : places[q]];
      for (let k = 4 * q; k < 4 * q + 4; k++) inks[k] = ink;
    }
    gl.bufferData(gl.ARRAY_BUFFER, inks, gl.STATIC_DRAW);
    this.quads.inked = key;
  }

  // A texture whose texels are fours of an array, in rows of WIDE.
  _table(data) {
    const gl = this.gl, rows = Math.max(1, Math.ceil(data.length / 4 / WIDE)), whole = new Float32Array(4 * WIDE * rows);
    whole.set(data);
    return this._texture(gl.RGBA32F, WIDE, rows, gl.RGBA, gl.FLOAT, whole);
  }

  _buffer(kind, data) {
    const gl = this.gl, made = gl.createBuffer();
    gl.bindBuffer(kind, made);
    gl.bufferData(kind, data, gl.STATIC_DRAW);
    return made;
  }

  _drop(drawn) {
    this.gl.deleteTexture(drawn?.table ?? null);
    drawn?.buffers?.forEach((buffer) => this.gl.deleteBuffer(buffer));
  }

  // Camera

  fit() {
    this._resized();
    const { width, height } = this.canvas, scale = 0.96 * Math.min(width / this.size[0], height / this.size[1]);
    this.look({ x: this.size[0] / 2, y: this.size[1] / 2, scale });
    this.fitted = true; // until it is moved, and so at another size of the window
  }

  look(camera) {
    const least = 0.2 * Math.min(this.canvas.width / this.size[0], this.canvas.height / this.size[1]);
    const within = (value, most) => Math.min(Math.max(value, 0), most);
    this.fitted = false;
    this.camera = { x: within(camera.x, this.size[0]), y: within(camera.y, this.size[1]), scale: Math.min(Math.max(camera.scale, least), 200) };
    this.moved();
  }

  zoom(factor, x = this.canvas.clientWidth / 2, y = this.canvas.clientHeight / 2) {
    const [px, py] = this.toPicture(x, y);
    const scale = Math.min(this.camera.scale * factor, 200);
    const grow = this.camera.scale / scale;
    this.look({ x: px + (this.camera.x - px) * grow, y: py + (this.camera.y - py) * grow, scale });
  }

  pan(dx, dy) {
    const scale = this.camera.scale / this.ratio;
    this.look({ ...this.camera, x: this.camera.x - dx / scale, y: this.camera.y - dy / scale });
  }

  get ratio() {
    return this.canvas.width / Math.max(1, this.canvas.clientWidth);
  }

  toPicture(x, y) {
    const { x: cx, y: cy, scale } = this.camera;
    return [cx + (x * this.ratio - this.canvas.width / 2) / scale, cy + (y * this.ratio - this.canvas.height / 2) / scale];
  }

  toScreen(x, y) {
    const { x: cx, y: cy, scale } = this.camera;
    return [((x - cx) * scale + this.canvas.width / 2) / this.ratio, ((y - cy) * scale + this.canvas.height / 2) / this.ratio];
  }

  // Where a drawing costs much, a move shifts the last one, and the new one comes when the hand rests.
  moved() {
    this.listeners.forEach((listener) => listener());
    if (this.cost < SLOW || !this.drawn) return this.soon();
    const { x, y, scale } = this.drawn, factor = this.camera.scale / scale, { width, height } = this.canvas;
    const dx = ((x - this.camera.x) * this.camera.scale + width / 2 - (width / 2) * factor) / this.ratio;
    const dy = ((y - this.camera.y) * this.camera.scale + height / 2 - (height / 2) * factor) / this.ratio;
    this.canvas.style.transform = `translate(${dx}px, ${dy}px) scale(${factor})`;
    this.frames++;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.draw(), REST);
  }

  soon() {
    this.asked ??= requestAnimationFrame(() => this.draw());
  }

  // Drawing

  // Gives the canvas the size of its place; tells whether it had another.
  _resized() {
    const box = this.canvas.parentElement.getBoundingClientRect(), ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [Math.max(1, Math.round(box.width * ratio)), Math.max(1, Math.round(box.height * ratio))];
    if (this.canvas.width === width && this.canvas.height === height) return false;
    return Boolean(Object.assign(this.canvas, { width, height }));
  }

  draw() {
    cancelAnimationFrame(this.asked);
    this.asked = undefined;
    clearTimeout(this.timer);
    this._resized();
    const start = performance.now(), gl = this.gl, { width, height } = this.canvas;
    this.canvas.style.transform = "";
    gl.viewport(0, 0, width, height);
    gl.clearColor(...rgb(getComputedStyle(this.canvas.parentElement).backgroundColor).map((c) => c / 255), 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (this.shown.picture && !this._isHidden()) this._drawPicture();
    if (this.shown.quads && this.quads) this._drawQuads();
    if (this.shown.lines && this.lines) this._drawLines(this.lines, 1.5 * this.ratio, [0.85, 0.1, 0.35, 1]);
    if (this.shown.quads && this.mark) for (const [width, ink] of [[4, [1, 1, 1, 1]], [2, [0.8, 0, 0.5, 1]]]) this._drawLines(this.mark, width * this.ratio, ink);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits, so that the time is the drawing's
    this.cost = performance.now() - start;
    this.drawn = { ...this.camera };
    this.frames++;
    this.listeners.forEach((listener) => listener());
  }

  _use(made) {
    const gl = this.gl, { x, y, scale } = this.camera, places = (made.places ??= placesOf(gl, made.program));
    gl.useProgram(made.program);
    gl.uniform4f(places.camera, x, y, (2 * scale) / this.canvas.width, (2 * scale) / this.canvas.height);
    return places;
  }

  // Whether quads lie over all of the picture that is in view: without a graphics card it costs more than they do.
  _isHidden() {
    if (!this.shown.quads || !this.quads?.filled) return false;
    const [left, top, right, bottom] = this.quads.filled, [width, height] = this.size;
    const [x0, y0] = this.toPicture(0, 0), [x1, y1] = this.toPicture(this.canvas.clientWidth, this.canvas.clientHeight);
    return left <= Math.max(x0, 0) + NEAR && top <= Math.max(y0, 0) + NEAR && right >= Math.min(x1, width) - NEAR && bottom >= Math.min(y1, height) - NEAR;
  }

  _drawPicture() {
    const gl = this.gl, places = this._use(this.programs.picture), whole = [0, 0, ...this.size];
    this._give(places, this.textures);
    gl.uniform4f(places.rect, ...whole);
    gl.uniform4f(places.part, ...(this.part ?? whole));
    gl.uniform1f(places.opacity, this.labels.before ? this.opacity : 0);
    gl.uniform1f(places.split, this.labels.after ? this.split * this.canvas.width : 1e9);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  _drawLines({ table, n }, width, ink) {
    const gl = this.gl, places = this._use(this.programs.lines);
    this._give(places, { table });
    gl.uniform2f(places.screen, this.canvas.width / 2, this.canvas.height / 2);
    gl.uniform1f(places.width, width / 2);
    gl.uniform4f(places.ink, ...ink);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.halves);
    for (let first = 0; first < n; first += BLOCK) {
      gl.uniform1i(places.first, first);
      gl.drawElements(gl.TRIANGLES, 6 * Math.min(BLOCK, n - first), gl.UNSIGNED_SHORT, 0);
    }
  }

  _give(places, textures) {
    const gl = this.gl;
    Object.entries(textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(places[name], unit);
    });
  }

  _drawQuads() {
    const gl = this.gl, { boxes, buffers, n } = this.quads;
    const [x0, y0] = this.toPicture(0, 0), [x1, y1] = this.toPicture(this.canvas.clientWidth, this.canvas.clientHeight);
    this._use(this.programs.quads);
    this._ink();
    for (const place of [0, 1]) gl.enableVertexAttribArray(place);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.halves);
    boxes.forEach(([left, top, right, bottom], block) => {
      if (right < x0 || left > x1 || bottom < y0 || top > y1) return; // out of view
      const first = block * BLOCK;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
      gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 32 * first);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[1]);
      gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 0, 16 * first);
      gl.drawElements(gl.TRIANGLES, 6 * Math.min(BLOCK, n - first), gl.UNSIGNED_SHORT, 0);
    });
    for (const place of [0, 1]) gl.disableVertexAttribArray(place);
  }

  // What is where

  // Place in the arrays of the quad at a point of the picture, -1 for none.
  quadAt(x, y) {
    for (const [block, [left, top, right, bottom]] of (this.quads?.boxes ?? []).entries()) {
      if (x < left || x > right || y < top || y > bottom) continue;
      const end = Math.min((block + 1) * BLOCK, this.quads.n);
      for (let q = block * BLOCK; q < end; q++) if (holds(this.quads.corners, 8 * q, x, y)) return q;
    }
    return -1;
  }

  placeAt(x, y) {
    const places = this.labels?.before;
    if (!places || x < 0 || y < 0 || x >= this.size[0] || y >= this.size[1]) return -1;
    const [rows, columns] = places.shape;
    return places[Math.floor((y / this.size[1]) * rows) * columns + Math.floor((x / this.size[0]) * columns)];
  }

  // Outlines a quad, and goes there so near that it can be seen.
  goTo(q) {
    const c = this.quads.corners.subarray(8 * q, 8 * q + 8);
    const sides = new Float32Array([0, 1, 2, 3].flatMap((k) => [c[2 * k], c[2 * k + 1], c[(2 * k + 2) % 8], c[(2 * k + 3) % 8]]));
    this._drop(this.mark);
    this.mark = { table: this._table(sides), n: 4 };
    const xs = [c[0], c[2], c[4], c[6]], ys = [c[1], c[3], c[5], c[7]];
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const scale = Math.min(this.canvas.width, this.canvas.height) / (6 * Math.max(x1 - x0, y1 - y0, 0.05));
    this.look({ x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale });
    this.draw();
  }
}

// Begins to compile a program: to ask whether it is done would be to wait.
function program(gl, { vertex, fragment }) {
  const made = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return { program: made, places: null };
}

// Where the values of a program go, by name.
function placesOf(gl, made) {
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error([gl.getProgramInfoLog(made), ...gl.getAttachedShaders(made).map((shader) => gl.getShaderInfoLog(shader))].join("\n"));
  const n = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
  const names = Array.from({ length: n }, (_, k) => gl.getActiveUniform(made, k).name);
  return Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(made, name)]));
}

// The two triangles of each of n quads.
function halvesOf(n) {
  const order = [0, 1, 2, 0, 2, 3];
  return Uint16Array.from({ length: 6 * n }, (_, k) => 4 * Math.floor(k / 6) + order[k % 6]);
}

// Colours as four bytes each: as they are, and paled.
function inksOf(colors) {
  const bytes = colors.map((color) => rgb(color ?? "#000000"));
  const packed = (change) => new Uint32Array(Uint8Array.from(bytes.flatMap((color) => [...color.map(change), 255])).buffer);
  return [packed((c) => c), packed((c) => 0.15 * c + 0.85 * 128)];
}

function boxesOf(corners) {
  const boxes = [];
  for (let first = 0; first < corners.length; first += 8 * BLOCK) {
    const box = [Infinity, Infinity, -Infinity, -Infinity], end = Math.min(first + 8 * BLOCK, corners.length);
    for (let k = first; k < end; k += 2) {
      const x = corners[k], y = corners[k + 1];
      if (x < box[0]) box[0] = x;
      if (y < box[1]) box[1] = y;
      if (x > box[2]) box[2] = x;
      if (y > box[3]) box[3] = y;
    }
    boxes.push(box);
  }
  return boxes;
}

// The box around all quads, if they leave no hole in it.
function filledBox(corners, boxes) {
  const [left, top, right, bottom] = [0, 1, 2, 3].map((k) => Math[k < 2 ? "min" : "max"](...boxes.map((box) => box[k])));
  let area = 0;
  for (let at = 0; at < corners.length; at += 8) {
    const across = (corners[at + 4] - corners[at]) * (corners[at + 7] - corners[at + 3]);
    area += 0.5 * Math.abs(across - (corners[at + 5] - corners[at + 1]) * (corners[at + 6] - corners[at + 2]));
  }
  return area > (right - left) * (bottom - top) - HOLE ? [left, top, right, bottom] : null;
}

function holds(corners, at, x, y) {
  let left = 0;
  for (let k = 0; k < 4; k++) {
    const a = at + 2 * k, b = at + 2 * ((k + 1) % 4);
    left += (corners[b] - corners[a]) * (y - corners[a + 1]) - (corners[b + 1] - corners[a + 1]) * (x - corners[a]) > 0 ? 1 : 0;
  }
  return left === 0 || left === 4;
}

export function rgb(color) {
  if (color[0] === "#") return [1, 3, 5].map((k) => parseInt(color.slice(k, k + 2), 16));
  return color.match(/\d+/g).slice(0, 3).map(Number);
}

export const RAMP = ["#d73027", "#fc8d59", "#fee090", "#91bfdb", "#4575b4"]; // Brewer's RdYlBu: told apart by colour-blind eyes, too
const SHADES = Array.from({ length: 256 }, (_, k) => shadeOf((k / 255) * (RAMP.length - 1)));

function shadeOf(at) {
  const k = Math.min(Math.floor(at), RAMP.length - 2), [a, b] = [rgb(RAMP[k]), rgb(RAMP[k + 1])];
  return `rgb(${a.map((c, i) => Math.round(c + (at - k) * (b[i] - c)))})`;
}
