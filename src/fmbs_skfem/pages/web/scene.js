"use strict";

const STOPS = { // of matplotlib, CC0
  viridis: "44015448186a472d7b4240863b528b33638d2c728e26828e21918c1fa08828ae803fbc735ec96284d44baddc30d8e219fde725",
  cividis: "00224e002e6a1a386f32436d434e6c535a6d61656f6f70737d7c788c88789b9476aba072bcae6ccdbb63dec958f0d846fee838",
  coolwarm: "3b4cc04e68d86282ea779af78db0fea3c2feb9d0f9ccd9eddddcdcecd3c5f5c4acf7b093f4987aeb7d62dd5f4bca3b37b40426",
};
const SIDES = 8; // of a tube
const LIVE = ["strain", "curvature"]; // fields of lines that follow from the unknowns of a model in the page
const SHORTEST = 5, COARSEST = 16; // pixels of a segment that is drawn, and segments of a line, at least

function rgb(text) {
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
}

/** Colours of a scale; on a dark ground without its darkest end. */
function stops(name, dark = matchMedia("(prefers-color-scheme: dark)").matches) {
  return STOPS[name].match(/.{6}/g).map((one) => `#${one}`).slice(dark && name !== "coolwarm" ? 3 : 0);
}

/** Corners and normals of the triangles of all forms of joints, in sizes of their own, and of arrows of length 1. */
const SHAPES = {
  box(a, b, c) {
    const found = [];
    for (let axis = 0; axis < 3; axis++) {
      for (const sign of [-1, 1]) {
        const normal = [0, 0, 0];
        normal[axis] = sign;
        for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
          const p = [0, 0, 0];
          p[axis] = sign;
          p[(axis + 1) % 3] = u;
          p[(axis + 2) % 3] = v;
          found.push(p[0] * a, p[1] * b, p[2] * c, ...normal);
        }
      }
    }
    return found;
  },
  /** A body of revolution about z, through [radius, height] from below to above. */
  turned(profile, sides = 20) {
    const found = [];
    for (let i = 0; i + 1 < profile.length; i++) {
      const [[r, z], [s, w]] = [profile[i], profile[i + 1]], slope = Math.hypot(w - z, r - s) || 1;
      for (let k = 0; k < sides; k++) {
        const ring = (n) => [Math.cos(2 * Math.PI * n / sides), Math.sin(2 * Math.PI * n / sides)];
        const corner = (radius, height, n) => {
          const [c, d] = ring(n);
          found.push(radius * c, radius * d, height, (w - z) / slope * c, (w - z) / slope * d, (r - s) / slope);
        };
        for (const [one, n] of [[0, k], [0, k + 1], [1, k + 1], [0, k], [1, k + 1], [1, k]]) corner(one ? s : r, one ? w : z, n);
      }
    }
    return found;
  },
  ball: (radius) => SHAPES.turned(Array.from({ length: 11 }, (_, i) => [radius * Math.sin(Math.PI * i / 10), -radius * Math.cos(Math.PI * i / 10)])),
  cone: (radius, height) => SHAPES.turned([[0, -height / 2], [radius, -height / 2], [0, height / 2]]),
  rod: (radius, low, high, sides) => SHAPES.turned([[0, low], [radius, low], [radius, high], [0, high]], sides),
  arrow: () => [...SHAPES.rod(0.03, -1, -0.28), ...SHAPES.turned([[0, -0.3], [0.1, -0.3], [0, 0]])],
  axis: () => SHAPES.rod(0.012, -0.6, 0.6),
  prism: (radius, half, sides) => SHAPES.rod(radius, -half, half, sides),
  cross: (a, b) => [...SHAPES.box(a, b, b), ...SHAPES.box(b, a, b), ...SHAPES.box(b, b, a)],
  /** Three quarters of a ring about z, and a head. */
  ring() {
    const found = [], count = 30, radius = 0.45;
    const point = (k, j) => {
      const a = 1.5 * Math.PI * k / count, b = 2 * Math.PI * j / 8, thick = 0.03;
      const n = [Math.cos(a) * Math.cos(b), Math.sin(a) * Math.cos(b), Math.sin(b)];
      found.push(radius * Math.cos(a) + thick * n[0], radius * Math.sin(a) + thick * n[1], thick * n[2], ...n);
    };
    for (let k = 0; k < count; k++) for (let j = 0; j < 8; j++) for (const [p, q] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]) point(k + p, j + q);
    const head = SHAPES.cone(0.1, 0.3); // at the end of the ring, where it goes along +x
    for (let i = 0; i < head.length; i += 6) found.push(head[i + 2] + 0.1, head[i] - radius, head[i + 1], head[i + 5], head[i + 3], head[i + 4]);
    return found;
  },
};
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

/** Columns of the rotation that takes z to a direction, times a size. */
function turnTo(direction, size) {
  const w = unit(direction), u = unit(cross(Math.abs(w[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0], w));
  return [...u, ...cross(w, u), ...w].map((x) => size * x);
}

/** The eye: turns about the upright axis of the scene, parallel projection. */
class Eye {
  constructor(planar, half) {
    this.planar = planar;
    this.half = half;
    this.reset();
  }

  reset(view = "home") {
    const [x, y, z, quarter] = ["x", "y", "z", Math.PI / 2];
    this.focus = [0, 0, 0];
    this.zoom = 1;
    [this.around, this.up] = this.planar
      ? { home: [0, 0], [x]: [quarter, 0], [y]: [0, -quarter], [z]: [0, 0] }[view]
      : { home: [-Math.PI / 4, Math.atan(Math.SQRT1_2)], [x]: [0, 0], [y]: [-quarter, 0], [z]: [-quarter, quarter] }[view];
  }

  /** Unit vectors to the right, up, and towards the eye. */
  axes() {
    const [c, s, d, t] = [Math.cos(this.around), Math.sin(this.around), Math.cos(this.up), Math.sin(this.up)];
    const towards = this.planar ? [d * s, t, d * c] : [d * c, d * s, t];
    const right = this.planar ? [c, 0, -s] : [-s, c, 0];
    return [right, cross(towards, right), towards];
  }

  /** Metres of a pixel, so that the box around the scene is seen whole in a window. */
  scale(width, height) {
    const [right, up] = this.axes();
    const reach = (axis) => this.half.reduce((sum, h, k) => sum + Math.abs(axis[k]) * h, 0);
    return Math.max(reach(right) / (0.46 * width), reach(up) / (0.46 * height), 1e-300) / this.zoom;
  }

  matrix(width, height) {
    const axes = this.axes(), metres = this.scale(width, height), depth = 3 * Math.hypot(...this.half) + Math.hypot(...this.focus);
    const by = [2 / (metres * width), 2 / (metres * height), -1 / depth];
    const found = new Float32Array(16);
    for (let row = 0; row < 3; row++) {
      for (let k = 0; k < 3; k++) found[4 * k + row] = by[row] * axes[row][k];
      found[12 + row] = -by[row] * axes[row].reduce((sum, a, k) => sum + a * this.focus[k], 0);
    }
    found[15] = 1;
    return found;
  }

  turn(dx, dy) {
    this.around -= 0.008 * dx;
    this.up = Math.min(Math.max(this.up + 0.008 * dy, -Math.PI / 2), Math.PI / 2);
  }

  move(dx, dy, metres) {
    const [right, up] = this.axes();
    this.focus = this.focus.map((f, k) => f - metres * (dx * right[k] - dy * up[k]));
  }
}

/** All motions of the page on one canvas; an Error where there is no WebGL2. */
class Scene {
  constructor(canvas, content) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!gl) throw new Error("no WebGL2");
    Object.assign(this, { canvas, content, gl, direct: !gl.getExtension("EXT_color_buffer_float") });
    this.eye = new Eye(content.planar, content.box.half);
    this.programs = {
      fill: this.link(COVER, FILL),
      tube: this.link(TUBE(this.direct), PAINT),
      facet: this.link(FACET(this.direct), PAINT),
      mesh: this.link(MESH, PAINT),
    };
    this.scales = [false, true].map((dark) => Object.fromEntries(Object.keys(STOPS).map((name) => [name, this.colours(name, dark)])));
    this.films = content.films.map((film) => ({ ...film, bodies: film.bodies.map((body) => this.body(body)) }));
    this.meshes = new Map();
    this.grid = this.mesh(this.gridLines());
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  }

  link(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`${gl.getProgramInfoLog(program)} ${logs.join(" ")}`);
    }
    const places = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const name = gl.getActiveUniform(program, i).name;
      places[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, places };
  }

  texture(target = this.gl.TEXTURE_2D) {
    const gl = this.gl, made = gl.createTexture();
    gl.bindTexture(target, made);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, key, gl.NEAREST);
    for (const key of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, key, gl.CLAMP_TO_EDGE);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    return made;
  }

  colours(name, dark) {
    const gl = this.gl, made = this.texture();
    const bytes = Uint8Array.from(stops(name, dark).flatMap((one) => rgb(one).map((part) => Math.round(255 * part))));
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, bytes.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytes);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, key, gl.LINEAR);
    return made;
  }

  /** Half floats (m, x, ...) as layers of an array of textures. */
  layers(modes, parts, width, height) {
    const gl = this.gl, count = modes.shape[0], points = modes.shape[1], kind = gl.TEXTURE_2D_ARRAY;
    const [inside, format] = parts === 3 ? [gl.RGB16F, gl.RGB] : [gl.R16F, gl.RED];
    const made = this.texture(kind), padded = new Uint16Array(width * height * parts);
    gl.texStorage3D(kind, 1, inside, width, height, Math.max(count, 1));
    for (let m = 0; m < count; m++) {
      padded.set(modes.subarray(m * points * parts, (m + 1) * points * parts));
      gl.texSubImage3D(kind, 0, 0, 0, m, width, height, 1, format, gl.HALF_FLOAT, padded);
    }
    return made;
  }

  buffer(values) {
    const gl = this.gl, made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    return made;
  }

  /** Everything of a body that stays on the card. */
  body(data) {
    const gl = this.gl, points = data.reference.shape[0], width = Math.min(points, 1024), height = Math.ceil(points / width);
    const padded = new Float32Array(3 * width * height);
    padded.set(data.reference);
    const reference = this.texture();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB32F, width, height, 0, gl.RGB, gl.FLOAT, padded);
    const made = { ...data, width, height, textures: { reference, modes: this.layers(data.modes, 3, width, height) } };
    made.now = new Float32Array(data.coordinates.shape[1]);
    made.fields = Object.fromEntries(Object.entries(data.fields).map(([name, field]) => [
      name, { ...field, texture: this.layers(field.modes, 1, width, height), now: new Float32Array(field.coordinates.shape[1]) },
    ]));
    made.none = this.layers(Object.assign(new Uint16Array(0), { shape: [0, 0] }), 1, 1, 1);
    if (!this.direct) {
      made.places = this.texture();
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
      made.target = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, made.target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, made.places, 0);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    }
    return data.kind === "line" ? this.tube(made) : this.surface(made);
  }

  /** A tube, and coarser ones of every second, fourth and eighth point, for segments that are shorter than some pixels. */
  tube(made) {
    const count = made.cells.shape[0], along = made.cells.every((point, k) => point === (k + 1) >> 1), r = made.reference;
    const length = (a, b) => Math.hypot(...[0, 1, 2].map((k) => r[3 * a + k] - r[3 * b + k]));
    made.segment = Array.from({ length: count }, (_, e) => length(made.cells[2 * e], made.cells[2 * e + 1])).reduce((a, b) => a + b, 0) / count;
    made.levels = [this.strips(made.cells)];
    for (let every = 2; along && every <= 8 && count / every >= COARSEST; every *= 2) {
      const cells = [];
      for (let k = 0; k < count; k += every) cells.push(k, Math.min(k + every, count));
      made.levels.push(this.strips(cells));
    }
    return made;
  }

  /** Prisms around all segments and discs on both ends, as strips of triangles: one call, since software draws every call for itself. */
  strips(cells) {
    const gl = this.gl, count = cells.length / 2, runs = [], corners = [], strips = [];
    const strip = (run, corner) => {
      for (let k = 0; k <= SIDES; k++) {
        for (const one of corner) {
          strips.push(runs.length / 4);
          runs.push(...run);
          corners.push(2 * Math.PI * k / SIDES, ...one);
        }
      }
      strips.push(0xffffffff); // a new strip
    };
    for (let e = 0; e < count; e++) {
      const [a, b] = [cells[2 * e], cells[2 * e + 1]];
      const before = e > 0 && cells[2 * e - 1] === a ? cells[2 * e - 2] : a, behind = e + 1 < count && cells[2 * e + 2] === b ? cells[2 * e + 3] : b;
      strip([before, a, b, behind], [[0, 0], [1, 0]]);
      if (before === a) strip([a, a, b, behind], [[0, 1], [0, 2]]);
      if (behind === b) strip([before, a, b, b], [[1, 1], [1, 2]]);
    }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.buffer(Uint32Array.from(runs));
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 4, gl.UNSIGNED_INT, 0, 0);
    this.buffer(Float32Array.from(corners));
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(strips), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: strips.length };
  }

  surface(made) {
    const gl = this.gl;
    const draw = (points) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      this.buffer(points);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
      gl.bindVertexArray(null);
      return { array, count: points.length };
    };
    const triangles = new Uint32Array(6 * made.cells.shape[0]);
    for (let f = 0; f < made.cells.shape[0]; f++) [0, 1, 2, 0, 2, 3].forEach((k, i) => { triangles[6 * f + i] = made.cells[4 * f + k]; });
    made.facets = draw(triangles);
    made.lines = draw(made.edges);
    return made;
  }

  mesh(values) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.buffer(Float32Array.from(values));
    for (const place of [0, 1]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, 12 * place);
    }
    gl.bindVertexArray(null);
    return { array, count: values.length / 6 };
  }

  glyph({ kind, form, sizes }) {
    if (!this.meshes.has(kind)) this.meshes.set(kind, this.mesh(SHAPES[form](...sizes)));
    return this.meshes.get(kind);
  }

  /** Squares behind a planar scene, below a spatial one. */
  gridLines() {
    const { half, step } = this.content.box, found = [], [a, b, c] = this.content.planar ? [0, 1, 2] : [0, 1, 2];
    const line = (p, q) => found.push(...p, 0, 0, 0, ...q, 0, 0, 0);
    const level = -half[c] - (this.content.planar ? 0.02 * Math.max(...half) : 0);
    for (const [one, other] of [[a, b], [b, a]]) {
      for (let k = 0; k <= Math.round(2 * half[one] / step); k++) {
        const p = [0, 0, 0], q = [0, 0, 0];
        p[c] = q[c] = level;
        p[one] = q[one] = k * step - half[one];
        [p[other], q[other]] = [-half[other], half[other]];
        line(p, q);
      }
    }
    return found;
  }

  /** Coordinates of a body at an instant, and places of its points on the card. */
  place(film, body, time, shade) {
    const gl = this.gl;
    if (!body.live) rowAt(body.coordinates, film.times, time, body.now);
    body.field = body.live ? this.liveField(body, shade) : body.fields[shade];
    if (body.field && !body.live) rowAt(body.field.coordinates, film.times, time, body.field.now);
    if (this.direct) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, body.target);
    gl.viewport(0, 0, body.width, body.height);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.useProgram(this.programs.fill.program);
    this.give(this.programs.fill.places, body);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** The field of a line that a model in the page moves: one mode, which is made anew; none of others. */
  liveField(body, shade) {
    if (!body.derivatives || !LIVE.includes(shade)) return undefined;
    const gl = this.gl, kind = gl.TEXTURE_2D_ARRAY, size = body.width * body.height;
    body.mode ??= { texture: this.layers(Object.assign(new Uint16Array(size), { shape: [1, size] }), 1, body.width, body.height), now: new Float32Array(1), values: new Float32Array(size) };
    const { values, now, texture } = body.mode;
    const { size: unit } = this.content.shades.find((one) => one.name === shade);
    ofLine(shade, body.derivatives, values).forEach((value, i) => { values[i] = value / unit; });
    now[0] = values.reduce((a, b) => Math.max(a, Math.abs(b)), 0) || 1;
    for (let i = 0; i < size; i++) values[i] /= now[0]; // half floats have few digits of small numbers
    gl.bindTexture(kind, texture);
    gl.texSubImage3D(kind, 0, 0, 0, 0, body.width, body.height, 1, gl.RED, gl.FLOAT, values);
    return body.mode;
  }

  /** What `told` of the shaders reads. */
  give(places, body) {
    const gl = this.gl, now = body.now, [modes, levels] = [now.length - 12, body.field ? body.field.now.length : 0];
    const bind = (number, kind, texture, name) => {
      gl.activeTexture(gl.TEXTURE0 + number);
      gl.bindTexture(kind, texture);
      gl.uniform1i(places[name], number);
    };
    bind(1, gl.TEXTURE_2D, body.textures.reference, "reference");
    bind(2, gl.TEXTURE_2D_ARRAY, body.textures.modes, "modes");
    bind(3, gl.TEXTURE_2D_ARRAY, body.field ? body.field.texture : body.none, "levels");
    const columns = new Float32Array(12); // of [A | shift], from rows [shift, A]
    for (let row = 0; row < 3; row++) {
      for (let k = 0; k < 3; k++) columns[3 * k + row] = now[4 * row + 1 + k];
      columns[9 + row] = now[4 * row];
    }
    gl.uniformMatrix4x3fv(places.affine, false, columns);
    gl.uniform1i(places.modeCount, modes);
    gl.uniform1i(places.levelCount, levels);
    if (modes) gl.uniform1fv(places.amplitude, now.subarray(12));
    if (levels) gl.uniform1fv(places.level, body.field.now);
  }

  /** Where the card has put the points of a body: four numbers each, the last one the value of the field. */
  read(film, number) {
    const gl = this.gl, body = this.films[film].bodies[number];
    const found = new Float32Array(4 * body.width * body.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, body.target);
    gl.readPixels(0, 0, body.width, body.height, gl.RGBA, gl.FLOAT, found);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const middle = this.content.middle;
    return Array.from({ length: body.reference.shape[0] }, (_, i) => [0, 1, 2].map((k) => found[4 * i + k] + middle[k]).concat(found[4 * i + 3]));
  }

  /** Draw all motions at a time; `look` has the shade, layout, and whether marks and grid are wanted. */
  draw(time, look) {
    const gl = this.gl, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [Math.max(1, Math.round(this.canvas.clientWidth * ratio)), Math.max(1, Math.round(this.canvas.clientHeight * ratio))];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    for (const film of this.films) for (const body of film.bodies) this.place(film, body, time, look.shade);
    const style = getComputedStyle(document.documentElement), colour = (name) => rgb(style.getPropertyValue(name).trim());
    gl.clearColor(...colour("--ground"), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const panes = look.side ? this.films.length : 1, across = Math.floor(width / panes);
    for (let pane = 0; pane < panes; pane++) {
      gl.viewport(pane * across, 0, across, height);
      this.pane(time, look, across, height, ratio, look.side ? [this.films[pane]] : this.films, colour);
    }
    gl.bindVertexArray(null);
  }

  pane(time, look, width, height, ratio, films, colour) {
    const gl = this.gl, view = this.eye.matrix(width, height), [, up, towards] = this.eye.axes();
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const metres = this.eye.scale(width, height), thin = Math.min(this.content.thin, 6 * ratio * metres);
    const begin = (name) => {
      const { program, places } = this.programs[name];
      gl.useProgram(program);
      gl.uniformMatrix4fv(places.view, false, view);
      gl.uniform3fv(places.towards, towards);
      gl.uniform3fv(places.above, unit(towards.map((t, k) => t + 1.2 * up[k])));
      gl.uniform1i(places.shaded, 0);
      gl.uniform1i(places.colours, 0);
      return places;
    };
    if (look.grid) {
      const places = begin("mesh");
      this.show(places, this.grid, [0, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1], colour("--grid"), false, 0, gl.LINES);
    }
    films.forEach((film) => {
      const number = this.films.indexOf(film), one = this.films.length > 1 && !look.shade ? COLOURS[number % COLOURS.length] : null;
      film.bodies.forEach((body, place) => {
        const line = body.kind === "line", places = begin(line ? "tube" : "facet");
        const lift = this.content.planar && !line ? [0, 0, 0.25 * thin * (place + 1)] : [0, 0, 0];
        gl.uniform3fv(places.lift, lift);
        gl.uniform1i(places.width, body.width);
        if (this.direct) this.give(places, body);
        else {
          gl.activeTexture(gl.TEXTURE4);
          gl.bindTexture(gl.TEXTURE_2D, body.places);
          gl.uniform1i(places.places, 4);
        }
        const scale = look.shade && body.field ? this.content.shades.find((each) => each.name === look.shade) : null;
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, this.scales[Number(dark)][scale && scale.diverging ? "coolwarm" : look.map]);
        gl.uniform1i(places.shaded, scale ? 1 : 0);
        if (scale) gl.uniform2fv(places.limits, scale.limits);
        const paint = rgb(one || (look.shade ? "#999999" : body.colour));
        gl.uniform4f(places.paint, ...paint, 1);
        gl.uniform1i(places.lit, body.lit ? 1 : 0);
        if (line) {
          gl.uniform1f(places.radius, body.size > 0 ? Math.max(body.size, thin) : 0.5 * thin);
          const level = Math.floor(Math.log2(Math.max(SHORTEST * ratio * metres / body.segment, 1)));
          const strips = body.levels[Math.min(level, body.levels.length - 1)];
          gl.bindVertexArray(strips.array);
          gl.drawElements(gl.TRIANGLE_STRIP, strips.count, gl.UNSIGNED_INT, 0);
          return;
        }
        gl.uniform1f(places.nearer, 0);
        gl.bindVertexArray(body.facets.array);
        gl.drawArrays(gl.TRIANGLES, 0, body.facets.count);
        gl.uniform1f(places.nearer, 1e-3);
        gl.uniform1i(places.shaded, 0);
        gl.uniform1i(places.lit, 0);
        gl.uniform4f(places.paint, ...(one ? rgb(one) : colour("--ink")).map((part) => 0.8 * part), 1);
        gl.bindVertexArray(body.lines.array);
        gl.drawArrays(gl.LINES, 0, body.lines.count);
      });
      if (look.marks) this.marks(film, time, begin("mesh"), thin);
    });
  }

  marks(film, time, places, thin) {
    const gl = this.gl, { planar, glyph, reach } = this.content, size = glyph * thin;
    const at = (array) => array.live || rowAt(array, film.times, time, new Float32Array(3));
    for (const mark of film.marks.filter((one) => !one.still)) { // a model in the page does not tell where loads turn to
      const joint = !mark.directions, direction = joint ? [0, 1, 2].map((k) => Number(k === mark.axis)) : at(mark.directions);
      if (!mark.places.shape[1] || !Math.hypot(...direction)) continue; // gravity is in the key
      const turn = turnTo(direction, joint ? size : reach * thin), nearer = planar ? (joint ? 0.02 : 0.03) : 0;
      this.show(places, this.glyph(mark), at(mark.places), turn, rgb(mark.colour), true, nearer);
    }
    gl.bindVertexArray(null);
  }

  show(places, mesh, place, turn, paint, lit, nearer, kind = this.gl.TRIANGLES) {
    const gl = this.gl;
    gl.uniform3fv(places.lift, place);
    gl.uniformMatrix3fv(places.turn, false, turn);
    gl.uniform4f(places.paint, ...paint, 1);
    gl.uniform1i(places.lit, lit ? 1 : 0);
    gl.uniform1f(places.nearer, nearer);
    gl.bindVertexArray(mesh.array);
    gl.drawArrays(kind, 0, mesh.count);
  }
}
