// The motion as sound: the run goes on in portions until there is enough of it to hear.

import { run, sample, signalsAt } from "./engine.js";

const RATE = 44100, PORTION = 2205; // samples a second, and of one portion

/** Force on the surface over F_n, or velocity of the pad, at states of six numbers each. */
export function heard(engine, body, what, states, contacts) {
  const values = new Float64Array(contacts.length);
  for (let k = 0; k < contacts.length; k++) {
    const state = states.subarray(6 * k, 6 * k + 6);
    values[k] = what === "velocity" ? state[3] : signalsAt(engine, body, state, contacts[k])[2];
  }
  return values;
}

/**
 * Samples of `seconds` of sound, the motion slowed down by `slow`; shorter if the model ends.
 * `rest()` is awaited between portions and may return false to give up.
 */
export async function render(engine, body, initial, { what, seconds, slow, rest }) {
  const wanted = Math.round(seconds * RATE), values = [];
  let motion = null;
  while (values.length < wanted && !motion?.end) {
    const from = values.length, to = Math.min(from + PORTION, wanted);
    const at = (k) => k / RATE / slow;
    motion = run(engine, body, initial, at(to), { onward: motion });
    const times = [];
    for (let k = from; k < to && at(k) / body.units.time <= motion.t; k++) {
      times.push(at(k) / body.units.time);
    }
    const { states, contacts } = sample(engine, motion, times);
    for (const value of heard(engine, body, what, states, contacts)) values.push(value);
    if (!(await rest(values.length / wanted))) return null;
  }
  return softened(values);
}

/** Mean removed, loudest at 0.5, faded in and out over 10 ms. */
function softened(values) {
  const mean = values.reduce((sum, v) => sum + v, 0) / values.length;
  const top = values.reduce((most, v) => Math.max(most, Math.abs(v - mean)), 0) || 1;
  const fade = RATE / 100;
  return Float32Array.from(values, (v, k) => {
    const edge = Math.min(1, k / fade, (values.length - 1 - k) / fade);
    return (0.5 * edge * (v - mean)) / top;
  });
}

let context = null, playing = null;

/** Play samples; `ended` is called when they are over or stopped. */
export function play(samples, ended) {
  context ??= new AudioContext();
  context.resume();
  const buffer = context.createBuffer(1, samples.length, RATE);
  buffer.copyToChannel(samples, 0);
  playing = context.createBufferSource();
  playing.buffer = buffer;
  playing.connect(context.destination);
  playing.onended = ended;
  playing.start();
}

export const silence = () => playing?.stop();
