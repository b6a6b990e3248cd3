"use strict";

const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F"]; // Okabe and Ito
const REDRAWN = 100; // [ms] between two drawings of the outputs of a model that runs
const SVG = "http://www.w3.org/2000/svg";

function element(parent, name, values = {}, text = null) {
  const made = name === "svg" || parent.namespaceURI === SVG ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  parent.append(made);
  return made;
}

/** At most `count` round numbers from low to high. */
function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw * (1 - 1e-9));
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(10)));
  return found;
}

/**
 * Outputs over time as SVG, with a cursor; `seek` is called with the time that was pointed at. Those of a model that runs are drawn
 * over the recorded ones, in a window that goes with them.
 */
class Plots {
  constructor(place, panels, names, clock, seek) {
    this.place = place;
    this.clock = clock; // unit in which times are read, and its size [s]
    this.seek = seek;
    this.now = this.told = this.drawn = 0;
    this.running = false; // a model, beside whose outputs recorded ones are pale
    this.figures = panels.map((panel) => this.make(panel, names));
    this.width = place.clientWidth;
    this.draw();
    new ResizeObserver(() => {
      if (place.clientWidth !== this.width) this.draw(); // its height changes with the values that are shown
      this.width = place.clientWidth;
    }).observe(place);
  }

  make(panel, names) {
    const figure = element(this.place, "figure");
    const caption = element(figure, "figcaption");
    element(caption, "b", {}, panel.label);
    const labels = [...new Set(panel.curves.map((curve) => curve.name))];
    const several = names.length > 1;
    for (const curve of panel.curves) {
      curve.colour = COLOURS[labels.indexOf(curve.name) % COLOURS.length];
      curve.dash = ["", "6 3", "2 3", "8 3 2 3"][curve.film % 4];
      const entry = element(caption, "span");
      const sample = element(entry, "i");
      sample.style.borderTopColor = curve.colour;
      if (curve.film) sample.style.borderTopStyle = "dashed";
      const label = (labels.length > 1 || !several ? [curve.name] : []).concat(several ? [names[curve.film]] : []).join(", ");
      curve.shown = element(entry, "span");
      curve.label = panel.curves.length > 1 ? `${label} ` : "";
    }
    const place = element(figure, "div", { class: "plot" });
    const svg = element(place, "svg", { role: "img", "aria-label": panel.label });
    const point = (event) => {
      const box = svg.getBoundingClientRect(), { left, right, first, last } = panel;
      const part = (event.clientX - box.left - left) / (box.width - left - right);
      this.seek(first + Math.min(Math.max(part, 0), 1) * (last - first));
    };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); point(event); });
    svg.addEventListener("pointermove", (event) => { if (event.buttons) point(event); });
    panel.cursor = element(place, "div", { class: "now" }); // a layer of its own: the curves are not drawn again when it moves
    return { panel, svg };
  }

  /** All curves, for the width that there is. */
  draw() {
    for (const { panel, svg } of this.figures) {
      svg.replaceChildren();
      const width = svg.clientWidth || 400, height = svg.clientHeight || 130;
      const all = panel.curves.flatMap((curve) => [...curve.values, ...(curve.live?.values ?? [])].filter(Number.isFinite).flatMap((y) => [y - curve.band, y + curve.band]));
      let low = all.reduce((a, b) => Math.min(a, b), Infinity), high = all.reduce((a, b) => Math.max(a, b), -Infinity);
      if (!(low <= high)) [low, high] = [0, 1];
      if (!(high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high)))) [low, high] = [low - (Math.abs(low) || 1), high + (Math.abs(high) || 1)];
      const times = panel.curves.map((curve) => [...curve.times]);
      Object.assign(panel, { first: Math.min(...times.map((t) => Math.min(...t))), last: Math.max(...times.map((t) => Math.max(...t))) });
      const late = Math.max(...panel.curves.map((curve) => (curve.live ? curve.live.times.at(-1) - panel.last : 0)), 0);
      Object.assign(panel, { first: panel.first + late, last: panel.last + late });
      Object.assign(panel, { left: 52, right: 8, top: 7, bottom: 18, width, height });
      const x = (t) => panel.left + (t - panel.first) / (panel.last - panel.first || 1) * (width - panel.left - panel.right);
      const y = (v) => height - panel.bottom - (v - low) / (high - low) * (height - panel.top - panel.bottom);
      panel.x = x;
      for (const v of ticks(low, high, 4)) {
        element(svg, "line", { class: "frame", x1: panel.left, x2: width - panel.right, y1: y(v), y2: y(v) });
        element(svg, "text", { x: panel.left - 5, y: y(v) + 3.5, "text-anchor": "end" }, short(v, 6));
      }
      if (panel.last > panel.first) {
        const { unit, size } = this.clock;
        for (const read of ticks(panel.first / size, panel.last / size, Math.max(2, Math.floor(width / 90)))) {
          const t = read * size;
          element(svg, "line", { class: "frame", x1: x(t), x2: x(t), y1: panel.top, y2: height - panel.bottom });
          element(svg, "text", { x: Math.min(x(t), width - 22), y: height - 5, "text-anchor": "middle" }, `${short(read)} ${unit}`.trim());
        }
      }
      const trace = ({ times, values }, curve, look) => {
        const points = [...values].map((v, i) => [times[i], v]).filter(([t, v]) => Number.isFinite(v) && t >= panel.first && t <= panel.last);
        const place = (t, v) => `${x(t).toFixed(1)},${y(v).toFixed(1)}`;
        if (curve.band && !look.opacity) {
          const edge = (sign) => points.map(([t, v]) => place(t, v + sign * curve.band));
          element(svg, "polygon", { points: [...edge(1), ...edge(-1).reverse()].join(" "), fill: curve.colour, opacity: 0.2 });
        }
        const path = points.map(([t, v]) => place(t, v)).join(" ");
        element(svg, "polyline", { points: path, fill: "none", stroke: curve.colour, "stroke-width": 1.5, ...look });
      };
      for (const curve of panel.curves) {
        trace(curve, curve, { "stroke-dasharray": curve.dash, ...(this.running ? { opacity: 0.35 } : {}) });
        if (curve.live) trace(curve.live, curve, { class: "live" });
      }
      Object.assign(panel.cursor.style, { top: `${panel.top}px`, height: `${height - panel.top - panel.bottom}px` });
    }
    this.move(this.now);
  }

  get curves() { return this.figures.flatMap(({ panel }) => panel.curves); }

  /** Values of columns at a time of the model that runs. */
  record(time, columns, values) {
    this.running = true;
    for (const curve of this.curves) {
      const k = columns.indexOf(curve.column);
      if (k < 0) continue;
      const live = (curve.live ??= { times: [], values: [] }), span = curve.times.at(-1) - curve.times[0];
      if (live.times.length && live.times.at(-1) >= time) continue;
      live.times.push(time);
      live.values.push(values[k] / curve.size);
      while (live.times[0] < time - span) { live.times.shift(); live.values.shift(); }
    }
    if (performance.now() - this.drawn < REDRAWN) return;
    this.draw();
    this.drawn = performance.now();
  }

  /** Only what was recorded. */
  forget() {
    this.running = false;
    for (const curve of this.curves) curve.live = undefined;
    this.draw();
  }

  /** The cursor at a time, and the values there, which change `often` or ten times a second. */
  move(time, often = true) {
    this.now = time;
    for (const { panel } of this.figures) {
      panel.cursor.style.transform = `translateX(${panel.x(Math.min(Math.max(time, panel.first), panel.last)).toFixed(1)}px)`;
    }
    if (!often && performance.now() - this.told < 100) return;
    this.told = performance.now();
    for (const curve of this.curves) {
      if (curve.live) { curve.shown.textContent = `${curve.label}${short(curve.live.values.at(-1))}`; continue; }
      if (this.running) { curve.shown.textContent = `${curve.label}not in the model`; continue; }
      const [i, part] = locate(curve.times, time);
      const next = Math.min(i + 1, curve.values.length - 1);
      curve.shown.textContent = `${curve.label}${short(curve.values[i] + part * (curve.values[next] - curve.values[i]))}`;
    }
  }
}
