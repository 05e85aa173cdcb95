// Spectrum of the motion, sampled so finely that no line beyond what is shown folds into it.

import { sample } from "./engine.js";
import { heard } from "./sound.js";

/** Samples in a period of the highest frequency shown. The signals have kinks where contact changes:
 * their lines fall by 12 dB an octave, so that what folds stays below the FLOOR. */
const FINE = 32, LEAST = 1024;
export const FLOOR = -70; // dB below the highest line

/** In-place Fourier transform of 2^k samples. */
function transform(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [re[i], re[j]] = [re[j], re[i]];
      [im[i], im[j]] = [im[j], im[i]];
    }
  }
  for (let size = 2; size <= n; size *= 2) {
    for (let k = 0; k < size / 2; k++) {
      const angle = (-2 * Math.PI * k) / size, c = Math.cos(angle), s = Math.sin(angle);
      for (let i = k; i < n; i += size) {
        const j = i + size / 2;
        const [x, y] = [re[j] * c - im[j] * s, re[j] * s + im[j] * c];
        re[j] = re[i] - x;
        im[j] = im[i] - y;
        re[i] += x;
        im[i] += y;
      }
    }
  }
}

/** Amplitudes by frequency of 2^k samples `dt` apart: mean removed, Hann window. */
function amplitudes(values, dt) {
  const n = values.length;
  const mean = values.reduce((sum, v) => sum + v, 0) / n;
  const re = Float64Array.from(values, (v, i) => {
    return (v - mean) * (1 - Math.cos((2 * Math.PI * i) / n));
  });
  const im = new Float64Array(n);
  transform(re, im);
  const half = n / 2;
  return {
    hertz: Float64Array.from({ length: half }, (_, k) => k / (n * dt)),
    amplitude: Float64Array.from({ length: half }, (_, k) => (2 * Math.hypot(re[k], im[k])) / n),
  };
}

/** Spectrum up to `highest` Hz of a motion: {hertz, decibels}, zero at the highest line. */
export function spectrum(engine, body, motion, what, highest) {
  const seconds = motion.t * body.units.time;
  const n = 2 ** Math.ceil(Math.log2(Math.max(LEAST, FINE * highest * seconds)));
  const { states, contacts } = sample(engine, motion, Float64Array.from({ length: n }, (_, k) => (motion.t * k) / n));
  const { hertz, amplitude } = amplitudes(heard(engine, body, what, states, contacts), seconds / n);
  const shown = hertz.findLastIndex((f) => f <= highest) + 2; // one beyond, where the line leaves the chart
  const top = amplitude.subarray(0, shown).reduce((a, b) => Math.max(a, b), 0) || 1;
  return {
    hertz: hertz.subarray(0, shown),
    decibels: amplitude.subarray(0, shown).map((a) => Math.max(FLOOR, 20 * Math.log10(a / top))),
  };
}
