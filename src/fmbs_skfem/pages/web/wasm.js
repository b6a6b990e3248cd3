"use strict";

/**
 * The model of a page as a WebAssembly module (see `Live` for what it has to have). It has no imports: all it can do is
 * to count. Steps of a picture end after BUDGET, so that a slow model is shown slowly and the page stays alive.
 */
const BUDGET = 40; // [ms]

async function loadModel(live) {
  const { instance } = await WebAssembly.instantiate(await unzip(live.module), {});
  const { memory, init, start, step, stopped, inputs, parameters, unknowns, outputs, now } = instance.exports;
  const numbers = (place, count) => new Float64Array(memory.buffer, place(), count);
  const put = (place, listed, values) => listed.forEach((one, k) => { numbers(place, listed.length)[k] = values[one.name] ?? one.value; });
  init();
  return {
    parameters: live.parameters, inputs: live.inputs, columns: live.columns, stepSize: live.stepSize, status: 0,
    get time() { return now(); },
    get stopped() { return stopped(this.status); },
    set(chosen, given) { put(parameters, live.parameters, chosen); put(inputs, live.inputs, given); },
    reset() { this.status = start(); },
    step(count) {
      const begin = performance.now();
      for (let k = 0; k < count && !this.status && performance.now() - begin < BUDGET; k++) this.status = step(live.stepSize);
      return numbers(unknowns, live.unknowns);
    },
    outputs() { return numbers(outputs, live.columns.length); },
  };
}
