"use strict";

/**
 * A model that runs in the page. Whoever has one calls `fmbs.attach(model)`; it has
 *
 *     parameters, inputs        lists of {name, unit, size, low, high, value}: each gets a slider; read value / size in unit;
 *                               the page says where a value is not from low to high, where the model was trained
 *     stepSize                  [s]
 *     set(parameters, inputs)   both as objects from name to value; the next step uses them
 *     reset()                   back to the state at the start, bit for bit
 *     step(n)                   n steps, 0 for none; returns the unknowns x (n,) of the reduced model as an array of numbers
 *     columns, outputs()        names of its outputs and their values now, where it has some: the plots draw them
 *     status                    not 0 where a step has failed: it stands still, and the page says so
 *     stopped                   whether that is an event which stops the motion
 *
 * The page knows how bodies and joints follow from the unknowns: `live` of the first film that has one holds for every body a
 * matrix (12 + modes, 1 + unknowns), whose first column is that of x = 0, and for every joint one (3, 1 + unknowns). Loads are shown
 * where they keep their direction; strains and curvatures of lines follow from their slopes and bends (6 points, 1 + unknowns).
 */
class Live {
  constructor(model, content, scene, plots, place, changed) {
    Object.assign(this, { model, content, scene, plots, changed, time: 0, values: { parameters: {}, inputs: {} } });
    const film = scene.films.find((one) => one.live);
    if (!film) throw new Error("no motion of this page is linear in the unknowns of a model");
    this.targets = [
      ...film.bodies.map((body, k) => ({ map: film.live.bodies[k], out: body.now, mark: (x) => { body.live = x; } })),
      ...film.marks.flatMap((mark, k) => {
        const map = film.live.marks[k];
        mark.still = !map;
        return map && map.shape[0] ? [{ map, out: new Float32Array(3), mark: (x) => { mark.places.live = x; } }] : [];
      }),
      ...film.bodies.flatMap((body, k) => {
        const map = film.live.lines[k];
        return map ? [{ map, out: new Float32Array(map.shape[0]), mark: (x) => { body.derivatives = x; } }] : [];
      }),
    ];
    place.hidden = false;
    for (const kind of ["parameters", "inputs"]) for (const one of model[kind] || []) this.slider(place, kind, one);
    const again = element(place, "button", {}, "start again");
    again.addEventListener("click", () => this.reset());
    this.beyond = element(place, "p", { role: "status", hidden: "" });
    this.stopped = element(place, "p", { role: "alert", hidden: "" });
    this.set();
    this.reset();
  }

  slider(place, kind, one) {
    this.values[kind][one.name] = one.value;
    const told = (value) => `${short(value / (one.size ?? 1))} ${one.unit}`;
    const label = element(place, "label", {}, `${one.name} `);
    const bar = element(label, "input", { type: "range", min: one.low, max: one.high, step: "any", value: one.value });
    const shown = element(label, "output", {}, told(one.value));
    bar.addEventListener("input", () => {
      this.values[kind][one.name] = Number(bar.value);
      shown.textContent = told(Number(bar.value));
      this.set();
      if (kind === "parameters") this.reset();
    });
  }

  /** Tell the model what was chosen, and the reader what of it no training knows. */
  set() {
    this.model.set(this.values.parameters, this.values.inputs);
    const read = (one, value) => short(value / (one.size ?? 1));
    const told = (one, value) => `${one.name} = ${read(one, value)} (trained from ${read(one, one.low)} to ${read(one, one.high)} ${one.unit})`;
    const outside = ["parameters", "inputs"].flatMap((kind) => (this.model[kind] || [])
      .map((one) => [one, this.values[kind][one.name]]).filter(([one, value]) => !(value >= one.low && value <= one.high)));
    this.beyond.hidden = !outside.length;
    this.beyond.textContent = `No error is known: ${outside.map(([one, value]) => told(one, value)).join(", ")}.`;
  }

  reset() {
    this.model.reset();
    this.time = this.model.time ?? 0;
    this.plots.forget();
    this.put(this.model.step(0));
    this.tellStopped();
    this.changed();
  }

  tellStopped() {
    this.stopped.hidden = !this.model.status;
    const failed = this.time || this.beyond.hidden ? `A step at t = ${short(this.time)} s failed` : "It does not start there";
    this.stopped.textContent = this.model.stopped ? `An event stops the motion at t = ${short(this.time)} s.`
      : `${failed}, and the model stands still: start again, with smaller inputs.`;
  }

  /** Go on by a time [s], in whole steps of the model. */
  advance(time) {
    const count = Math.max(1, Math.round(time / this.model.stepSize));
    const x = this.model.step(count);
    this.time = this.model.time ?? this.time + count * this.model.stepSize;
    this.put(x);
    if (this.model.status) this.tellStopped();
  }

  /** Back to the motion that was recorded. */
  end() {
    this.plots.forget();
    for (const film of this.scene.films) {
      for (const body of film.bodies) body.live = body.derivatives = undefined;
      for (const mark of film.marks) mark.still = mark.places.live = undefined;
    }
  }

  put(x) {
    for (const { map, out, mark } of this.targets) {
      const width = map.shape[1];
      for (let i = 0; i < out.length; i++) {
        let sum = map[i * width];
        for (let k = 1; k < width; k++) sum += map[i * width + k] * x[k - 1];
        out[i] = sum;
      }
      mark(out);
    }
    if (this.model.outputs) this.plots.record(this.time, this.model.columns, this.model.outputs());
  }
}

/** Strain (r'.r' - 1) / 2 or curvature |r' x r''| / |r'|^3 at the points of a line, from r' and r'' (2, x, 3). */
function ofLine(shade, derivatives, out) {
  const count = derivatives.length / 6;
  for (let i = 0; i < count; i++) {
    const r = derivatives.subarray(3 * i, 3 * i + 3), b = derivatives.subarray(3 * (count + i), 3 * (count + i) + 3);
    const square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    out[i] = shade === "strain" ? 0.5 * (square - 1) : Math.hypot(...cross(r, b)) / square ** 1.5;
  }
  return out;
}
