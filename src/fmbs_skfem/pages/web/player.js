"use strict";

/** The page: time, keys, choices; `window.fmbs` for models and tests. */
async function begin() {
  const content = await readContent(), find = (id) => document.getElementById(id), films = content.films;
  find("about").textContent = content.about.join("\n");
  if (!films.length) return plain(content);
  const look = { shade: content.shade, map: "viridis", side: false, marks: true, grid: true };
  const state = { time: 0, playing: false, speed: 1, frames: 0, dirty: true, live: null };
  const first = Math.min(...films.map((film) => film.times[0])), last = Math.max(...films.map((film) => film.times[film.times.length - 1]));
  const steady = films.every((film) => film.times[0] === film.shown[0] && film.times[film.times.length - 1] === film.shown[film.shown.length - 1]);
  const plots = new Plots(find("plots"), content.panels, films.map((film) => film.name), content.time, (time) => { pause(); seek(ofShown(time)); });

  let scene = null;
  try {
    scene = new Scene(find("scene"), content);
  } catch (error) {
    find("unable").textContent = `This browser shows no bodies (${error.message}): they need WebGL2. The outputs are shown all the same.`;
    find("unable").hidden = false;
    find("scene").hidden = true;
  }

  /** The time of a place on the axis of the plots, which is another one where a path of equilibria turns. */
  function ofShown(value) {
    return steady ? value : first + (last - first) * [...films[0].shown].reduce((best, one, i, all) => Math.abs(one - value) < Math.abs(all[best] - value) ? i : best, 0) / (films[0].shown.length - 1);
  }

  function shownTime() {
    return steady ? state.time : rowAt(films[0].shown, films[0].times, state.time, new Float32Array(1))[0];
  }

  function seek(time) {
    state.time = Math.min(Math.max(time, first), last);
    state.dirty = true;
    wake();
  }

  function pause() { play(false); }

  function play(on = !state.playing) {
    if (on && state.time >= last) state.time = first;
    state.playing = on && last > first;
    find("play").textContent = state.playing ? "\u275a\u275a" : "\u25b6";
    wake();
  }

  /** To the next instant of the first motion, or back. */
  function go(count) {
    pause();
    const times = films[0].times, [i, part] = locate(times, state.time);
    const near = part > 1 - 1e-6 ? i + 1 : i, inside = part > 1e-6 && part < 1 - 1e-6;
    seek(times[Math.min(Math.max(near + count + (inside && count < 0 ? 1 : 0), 0), times.length - 1)]);
  }

  let asked = false, before = null;
  function wake() {
    if (!asked) { asked = true; requestAnimationFrame(tick); }
  }

  function tick(now) {
    asked = false;
    const passed = before === null ? 0 : Math.min(now - before, 100) / 1000;
    before = state.playing ? now : null;
    if (state.playing) {
      if (state.live) state.live.advance(passed * state.speed);
      else state.time += passed * state.speed;
      if (!state.live && state.time >= last) { state.time = first + (state.time - last) % (last - first); }
      state.dirty = true;
    }
    if (state.dirty) draw();
    if (state.playing) wake();
  }

  function draw() {
    state.dirty = false;
    state.frames++;
    const time = state.live ? state.live.time : shownTime();
    if (scene) scene.draw(state.time, look);
    plots.move(time, !state.playing);
    find("scrub").value = (state.time - first) / (last - first || 1);
    find("time").textContent = content.clock === "s" ? `t = ${(time / content.time.size).toFixed(digits)} ${content.time.unit}` : `${content.clock} ${short(time)}`;
  }
  const digits = Math.min(Math.max(2 - Math.floor(Math.log10((last - first) / content.time.size / 100 || 1)) - 1, 2), 7);

  // speeds: as it was, or so that a motion takes some seconds
  const span = last - first, usual = content.clock === "s" && span >= 1.5 && span <= 30 ? 1 : Number((span / 8).toPrecision(1)) || 1;
  const speeds = [...new Set([0.001, 0.01, 0.1, 0.2, 0.5, 1, 2, 5].map((one) => (content.clock === "s" ? one : one * usual)).concat([usual, usual / 2, usual / 5, usual * 2]))].sort((a, b) => a - b);
  for (const one of speeds) element(find("speed"), "option", { value: one }, content.clock === "s" && one === 1 ? "real time" : `x ${short(one, 3)}`);
  const setSpeed = (one) => { state.speed = one; find("speed").value = String(one); };
  setSpeed(usual);
  find("speed").addEventListener("change", () => setSpeed(Number(find("speed").value)));

  const choices = [["", films.length > 1 ? "model" : "body"], ...content.shades.map((one) => [one.name, one.label])];
  for (const [value, label] of choices) element(find("shade"), "option", { value }, label);
  for (const map of ["cividis"]) if (content.shades.length) element(find("shade"), "option", { value: `map ${map}` }, `\u2192 scale ${map}`);
  const setShade = (value) => {
    if (value.startsWith("map ")) look.map = look.map === "viridis" ? "cividis" : "viridis";
    else look.shade = value || null;
    find("shade").value = look.shade || "";
    key();
    seek(state.time);
  };
  find("shade").addEventListener("change", () => setShade(find("shade").value));

  function key() {
    const place = find("key");
    place.replaceChildren();
    const shade = content.shades.find((one) => one.name === look.shade);
    const told = shade && (!state.live || (LIVE.includes(shade.name) && films.some((film) => film.live && film.live.lines.some(Boolean))));
    if (shade && !told) element(place, "span", {}, `${shade.label}: of the recorded run alone`);
    else if (shade) {
      element(place, "span", {}, shade.label);
      element(place, "span", { class: "scale" }).style.background = `linear-gradient(to right, ${stops(shade.diverging ? "coolwarm" : look.map).join(",")})`;
      const ends = element(place, "div", { class: "ends" });
      for (const end of shade.limits) element(ends, "span", {}, short(end, 3));
    } else {
      const named = films.length > 1 ? films.map((film, i) => [film.name, COLOURS[i % COLOURS.length]]) : films[0].bodies.map((body) => [body.name, body.colour]);
      if (named.length > 1) for (const [name, colour] of named.slice(0, 12)) entry(place, name, colour);
    }
    const kinds = look.marks ? films[0].marks : [];
    for (const [kind, colour] of new Map(kinds.map((one) => [one.kind, one.colour]))) entry(place, kind, colour);
    if (look.grid) element(place, "div", {}, `grid ${content.box.cell}`);
    find("panes").replaceChildren();
    if (look.side) for (const film of films) element(find("panes"), "span", {}, film.name);
  }

  function entry(place, name, colour) {
    const row = element(place, "div", { class: "entry" });
    element(row, "i").style.background = colour;
    element(row, "span", {}, name);
  }

  find("layout-label").hidden = films.length < 2;
  find("layout").addEventListener("change", () => { look.side = find("layout").value === "side"; key(); seek(state.time); });
  for (const [id, name] of [["marks", "marks"], ["ground", "grid"]]) {
    find(id).addEventListener("change", () => { look[name] = find(id).checked; key(); seek(state.time); });
  }
  find("play").addEventListener("click", () => play());
  find("scrub").addEventListener("input", () => { pause(); seek(first + Number(find("scrub").value) * (last - first)); });
  const setView = (name) => { if (scene) { scene.eye.reset(name); seek(state.time); } };
  for (const one of document.querySelectorAll("[data-view]")) one.addEventListener("click", () => setView(one.dataset.view));
  const help = () => { find("keys").hidden = !find("keys").hidden; };
  find("help").addEventListener("click", help);

  /** The scene as a PNG, with title, time and scale. */
  function picture() {
    draw();
    const source = find("scene"), made = document.createElement("canvas"), pen = made.getContext("2d");
    const ratio = source.width / Math.max(source.clientWidth, 1), style = getComputedStyle(document.documentElement);
    Object.assign(made, { width: source.width, height: source.height });
    pen.drawImage(source, 0, 0);
    pen.scale(ratio, ratio);
    pen.fillStyle = style.getPropertyValue("--ink");
    pen.font = "14px system-ui, sans-serif";
    pen.fillText(`${content.title}   ${find("time").textContent}`, 10, 20);
    const shade = content.shades.find((one) => one.name === look.shade);
    if (shade) {
      const paint = pen.createLinearGradient(10, 0, 190, 0), all = stops(shade.diverging ? "coolwarm" : look.map);
      all.forEach((one, i) => paint.addColorStop(i / (all.length - 1), one));
      pen.fillText(shade.label, 10, source.clientHeight - 42);
      pen.fillText(short(shade.limits[0], 3), 10, source.clientHeight - 8);
      pen.textAlign = "right";
      pen.fillText(short(shade.limits[1], 3), 190, source.clientHeight - 8);
      pen.fillStyle = paint;
      pen.fillRect(10, source.clientHeight - 36, 180, 12);
    }
    return made;
  }
  function save() {
    if (!scene) return;
    picture().toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${content.title.replace(/[^\w.-]+/g, "_")}_${find("time").textContent.replace(/[^\d.]+/g, "")}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }
  find("shot").addEventListener("click", save);

  const keys = {
    " ": () => play(), ArrowLeft: (event) => go(event.shiftKey ? -10 : -1), ArrowRight: (event) => go(event.shiftKey ? 10 : 1),
    Home: () => { pause(); seek(first); }, End: () => { pause(); seek(last); },
    r: () => setView("home"), x: () => setView("x"), y: () => setView("y"), z: () => setView("z"), s: save, "?": help,
    c: () => setShade(choices[(choices.findIndex(([name]) => name === (look.shade || "")) + 1) % choices.length][0]),
    "+": () => setSpeed(speeds[Math.min(speeds.indexOf(state.speed) + 1, speeds.length - 1)]),
    "-": () => setSpeed(speeds[Math.max(speeds.indexOf(state.speed) - 1, 0)]),
  };
  document.addEventListener("keydown", (event) => {
    const inside = event.target instanceof Element ? event.target : document.body, name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[name]) return;
    if (inside.matches("select, input:not(#scrub):not([type=checkbox])") || (name === " " && inside.matches("button, [type=checkbox]"))) return;
    event.preventDefault();
    keys[name](event);
  });

  if (scene) gestures(find("scene"), scene, () => seek(state.time));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { key(); seek(state.time); });
  new ResizeObserver(() => { if (scene) seek(state.time); }).observe(find("stage"));
  window.fmbs = {
    content, scene, plots, state, look, seek, play, go, setShade, draw, picture, first, last,
    attach(model) { find("sliders").replaceChildren(); state.live = new Live(model, content, scene, plots, find("sliders"), () => seek(state.time)); key(); },
    detach() {
      state.live.end();
      state.live = null;
      find("sliders").hidden = true;
      key();
      seek(state.time);
    },
  };
  if (content.live && content.live.module && scene) {
    const button = find("run");
    button.hidden = false;
    button.addEventListener("click", async () => {
      if (state.live) { window.fmbs.detach(); button.textContent = "run the model"; return; }
      window.fmbs.attach(await loadModel(content.live));
      button.textContent = "show the run";
      if (!state.playing) play();
    });
  }
  find("shade").value = look.shade || "";
  key();
  draw();
  document.body.dataset.ready = "true";
}

/** A page without bodies: the outputs alone, with a cursor. */
function plain(content) {
  for (const id of ["stage", "controls"]) document.getElementById(id).hidden = true;
  document.getElementById("motion").className = "plain";
  document.getElementById("motion").hidden = !content.panels.length;
  const plots = new Plots(document.getElementById("plots"), content.panels, [""], content.time, (time) => plots.move(time));
  document.body.dataset.ready = "true";
}

/** One pointer turns, with shift or another button it moves; two move and zoom. */
function gestures(canvas, scene, changed) {
  const held = new Map();
  const middle = () => [...held.values()].reduce(([x, y], p) => [x + p[0] / held.size, y + p[1] / held.size], [0, 0]);
  const apart = () => { const [p, q] = [...held.values()]; return q ? Math.hypot(p[0] - q[0], p[1] - q[1]) : 0; };
  const metres = () => scene.eye.scale(canvas.clientWidth, canvas.clientHeight);
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); held.set(event.pointerId, [event.clientX, event.clientY]); });
  canvas.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) return;
    const [x, y] = middle(), before = apart();
    held.set(event.pointerId, [event.clientX, event.clientY]);
    const [u, v] = middle();
    if (held.size === 1 && !event.shiftKey && event.buttons < 2) scene.eye.turn(u - x, v - y);
    else scene.eye.move(u - x, v - y, metres());
    if (before) scene.eye.zoom = Math.min(Math.max(scene.eye.zoom * apart() / before, 0.1), 1000);
    changed();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => held.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    scene.eye.zoom = Math.min(Math.max(scene.eye.zoom * Math.exp(-0.0015 * event.deltaY), 0.1), 1000);
    changed();
  }, { passive: false });
}

begin().catch((error) => {
  const place = document.getElementById("unable");
  place.textContent = `This page cannot be shown: ${error.message}`;
  place.hidden = false;
  throw error;
});
