"use strict";

/** Bytes of a text in Base64 (zlib). */
async function unzip(text) {
  const letters = atob(text), packed = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) packed[i] = letters.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

/** The content of the page, with a typed array for every place in its block; arrays know their `shape`. */
async function readContent() {
  const bytes = await unzip(document.getElementById("block").textContent);
  const kinds = { f2: Uint16Array, f4: Float32Array, u4: Uint32Array };
  const found = (key, value) => {
    if (value === null || typeof value !== "object" || !Object.hasOwn(value, "at")) return value;
    const array = new kinds[value.type](bytes, value.at, value.shape.reduce((a, b) => a * b, 1));
    array.shape = value.shape;
    return array;
  };
  return JSON.parse(document.getElementById("content").textContent, found);
}

/** The interval i of ascending `times` around an instant, and the part of it that has passed. */
function locate(times, at) {
  let low = 0, high = times.length - 1;
  if (high < 1) return [0, 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= at) low = middle; else high = middle;
  }
  return [low, Math.min(Math.max((at - times[low]) / (times[high] - times[low]), 0), 1)];
}

/**
 * A row of an array (s, ...) at an instant, by cubics through its rows: their slopes are those of parabolas, so that a wheel keeps
 * its size between two instants. At an instant of `times` it is the row itself.
 */
function rowAt(array, times, at, out) {
  const width = out.length, last = times.length - 1;
  const [i, part] = locate(times, at);
  if (part === 0 || part === 1 || last < 2) {
    const row = (i + (part === 1 ? 1 : 0)) * width, next = Math.min(row + width, last * width);
    for (let k = 0; k < width; k++) out[k] = array[row + k] + (part % 1) * (array[next + k] - array[row + k]);
    return out;
  }
  const h = times[i + 1] - times[i], s = part, r = 1 - part;
  const [a, b, c, d] = [r * r * (1 + 2 * s), s * r * r * h, s * s * (1 + 2 * r), -s * s * r * h];
  for (let k = 0; k < width; k++) {
    const y = (n) => array[n * width + k];
    const secant = (n) => (y(n + 1) - y(n)) / (times[n + 1] - times[n]);
    const slope = (n) => {
      if (n === 0) return 2 * secant(0) - slope(1);
      if (n === last) return 2 * secant(last - 1) - slope(last - 1);
      const before = times[n] - times[n - 1], behind = times[n + 1] - times[n];
      return (secant(n - 1) * behind + secant(n) * before) / (before + behind);
    };
    out[k] = a * y(i) + b * slope(i) + c * y(i + 1) + d * slope(i + 1);
  }
  return out;
}

/** A number with a few digits, never in more letters than fit below an axis. */
function short(value, digits = 4) {
  if (!Number.isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e-3 && size < 1e5 ? String(Number(value.toPrecision(digits))) : Number(value.toPrecision(digits - 1)).toExponential().replace("e+", "e");
}
