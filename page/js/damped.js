// Damping: the pad with one damping ratio in all modes, and the roots of z'' + B z' + A z = 0.

import { coefficient, fullContact, loadsAt, prepare } from "./engine.js";
import { smoothRest, withFriction } from "./rest.js";
import { DIVERGENCE, FLUTTER, MARGINAL, STABLE } from "./undamped.js";

const ERROR = 1e-13; // of a root, relative to the largest
const K = 3, C = 12; // where they begin in the loads

/** M^-1 K and M^-1 C (9 each, row by row) from the loads, in natural units and in coordinates that
 * make M one; `lever` turns these into x, y, w theta. */
export function reduced(engine, body, loads) {
  const [m, I, w] = ["m", "I", "w"].map((name) => coefficient(engine, body, name));
  const unit = [1 / Math.sqrt(m), 1 / Math.sqrt(m), 1 / Math.sqrt(I)]; // symmetric K stays so
  const lever = [1, 1, w * Math.sqrt(m / I)];
  const normalised = (from) => Array.from({ length: 9 }, (_, i) => {
    return loads[from + i] * unit[Math.floor(i / 3)] * unit[i % 3];
  });
  return { A: normalised(K), B: body.damped ? normalised(C) : null, lever };
}

/** Eigenvalues and unit eigenvectors of a symmetric matrix (9), by Jacobi's rotations. */
function symmetricModes(S) {
  const a = S.slice(), v = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  for (let sweep = 0; sweep < 12; sweep++) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (a[3 * p + q] === 0) continue;
      const cot = (a[4 * q] - a[4 * p]) / (2 * a[3 * p + q]);
      const t = (cot < 0 ? -1 : 1) / (Math.abs(cot) + Math.hypot(cot, 1));
      const c = 1 / Math.hypot(t, 1), s = t * c;
      const turn = (m, i, j) => ([m[i], m[j]] = [c * m[i] - s * m[j], s * m[i] + c * m[j]]);
      for (let k = 0; k < 3; k++) turn(a, 3 * k + p, 3 * k + q);
      for (let k = 0; k < 3; k++) turn(a, 3 * p + k, 3 * q + k);
      for (let k = 0; k < 3; k++) turn(v, 3 * k + p, 3 * k + q);
    }
  }
  return [0, 1, 2].map((i) => ({ value: a[4 * i], vector: [v[i], v[3 + i], v[6 + i]] }));
}

/** The damping of one ratio in all modes of the symmetric part of A, or null if one is unstable. */
function equalRatios(A, ratio) {
  const modes = symmetricModes(A.map((e, i) => (e + A[3 * (i % 3) + Math.floor(i / 3)]) / 2));
  const values = modes.map(({ value }) => value);
  if (Math.min(...values) < -1e-12 * Math.max(...values)) return null;
  const B = new Array(9).fill(0);
  for (const { value, vector } of modes) {
    const rate = 2 * ratio * Math.sqrt(Math.max(value, 0));
    for (let i = 0; i < 9; i++) B[i] += rate * vector[Math.floor(i / 3)] * vector[i % 3];
  }
  return B;
}

/**
 * The body of settings with their damping. Its matrix comes from the pad at rest without friction,
 * or about the origin in full contact; `refusal` says why it has none although it is asked for.
 */
export function bodyOf(engine, settings, origin = false) {
  const body = prepare(engine, settings);
  if (!settings.damping) return body;
  const smooth = withFriction(engine, body, 0);
  const at = origin ? { z: [0, 0, 0, 0, 0, 0], contact: fullContact(body) } : smoothRest(engine, smooth);
  if (!at) return { ...body, refusal: "without friction no equilibrium in contact is near" };
  const { A, lever } = reduced(engine, body, loadsAt(engine, smooth, at.z, at.contact));
  const B = equalRatios(A, settings.damping);
  if (!B) return { ...body, refusal: engine.tables.damping.unstable };
  const D = B.map((e, i) => (e * lever[Math.floor(i / 3)]) / lever[i % 3]);
  body.coefficients.set(D, engine.tables.coefficients.length + body.points);
  return { ...body, damped: true };
}

const TERMS = [[0, 4, 8, 1], [0, 5, 7, -1], [1, 5, 6, 1], [1, 3, 8, -1], [2, 3, 7, 1], [2, 4, 6, -1]];

/** Coefficients of det(s^2 + s B + A), those of low powers first. */
function characteristic(A, B) {
  const p = new Float64Array(7);
  for (const [i, j, k, sign] of TERMS) {
    for (let a = 0; a < 3; a++) {
      const first = sign * (a === 0 ? A[i] : a === 1 ? B[i] : i % 4 ? 0 : 1);
      if (first === 0) continue;
      for (let b = 0; b < 3; b++) {
        const both = first * (b === 0 ? A[j] : b === 1 ? B[j] : j % 4 ? 0 : 1);
        p[a + b] += both * A[k];
        p[a + b + 1] += both * B[k];
        if (k % 4 === 0) p[a + b + 2] += both;
      }
    }
  }
  return p;
}

/** The six roots {re, im}, by Ehrlich's and Aberth's iteration from roots nearby. */
export function dampedRoots(A, B, near) {
  const p = characteristic(A, B), n = 6;
  const top = near.reduce((most, r) => Math.max(most, Math.hypot(r.re, r.im)), 0) || 1;
  // apart from each other and not symmetric to the real axis, where pairs may become real roots
  const re = near.map((r, k) => r.re + 1e-3 * top * Math.cos(1 + k));
  const im = near.map((r, k) => r.im + 1e-3 * top * Math.sin(1 + k));
  // to rounding: until the steps are tiny, or small and no longer shrink
  for (let pass = 0, moved = 1, last = 1; pass < 60; pass++, last = moved) {
    if (moved < 1e-14 || (moved < 3e-8 && moved > 0.7 * last)) break;
    moved = 0;
    for (let k = 0; k < n; k++) {
      const [x, y] = [re[k], im[k]];
      let [a, b, c, d] = [p[n], 0, 0, 0]; // value a + i b and slope c + i d
      for (let i = n - 1; i >= 0; i--) {
        [c, d] = [c * x - d * y + a, c * y + d * x + b];
        [a, b] = [a * x - b * y + p[i], a * y + b * x];
      }
      const size = a * a + b * b;
      if (size === 0) continue;
      let [u, v] = [(c * a + d * b) / size, (d * a - c * b) / size]; // slope over value
      for (let j = 0; j < n; j++) {
        if (j === k) continue;
        const [e, f] = [x - re[j], y - im[j]], far = e * e + f * f || Number.MIN_VALUE;
        u -= e / far;
        v += f / far;
      }
      const inverse = u * u + v * v;
      if (!(inverse > 0)) continue;
      re[k] = x - u / inverse;
      im[k] = y + v / inverse;
      moved = Math.max(moved, 1 / Math.sqrt(inverse) / top);
    }
  }
  return re.map((x, k) => ({ re: x, im: im[k] }));
}

/** Verdict on damped roots as an index; how far rounding may move a root counts as zero. */
export function judgeDamped(six) {
  const size = (x, y) => Math.sqrt(x * x + y * y);
  const norm = Math.max(...six.map(({ re, im }) => size(re, im))) || 1;
  let fastest = null, onAxis = false;
  six.forEach((root, k) => {
    const apart = six.map((r, i) => (i === k ? Infinity : size(r.re - root.re, r.im - root.im)));
    const cluster = Math.max(2, 1 + apart.filter((d) => d <= 4 * Math.cbrt(ERROR) * norm).length);
    const noise = norm * Math.min((ERROR * norm) / Math.min(...apart), ERROR ** (1 / cluster));
    if (Math.abs(root.im) <= noise) root.im = 0;
    if (root.re > noise && !(fastest?.re >= root.re)) fastest = root;
    onAxis ||= Math.abs(root.re) <= noise;
  });
  if (fastest) return fastest.im ? FLUTTER : DIVERGENCE;
  return onAxis ? MARGINAL : STABLE;
}
