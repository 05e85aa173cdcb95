// Sliding equilibria and small motions about them: eigenvalues, mode shapes, verdict, thresholds,
// stability map. Loads, K and gaps come from the compiled functions.

import { coefficient, gapsAt, loadsAt, prepare, signalsAt, touching } from "./engine.js";

export const VERDICTS = ["marginal", "flutter", "divergence", "beyond a fold"];
const [MARGINAL, FLUTTER, DIVERGENCE, BEYOND] = [0, 1, 2, 3];
const EPS = Number.EPSILON;
// where the place of rest without friction is looked for, in units of the motion
const SEEDS = [0, -1, -10, 1, 10].flatMap((y) => [0, -1, 1].map((turn) => [0, y, turn]));

/** The body with another coefficient of friction. */
export function withFriction(engine, body, mu) {
  const coefficients = body.coefficients.slice();
  coefficients[engine.tables.coefficients.indexOf("mu")] = mu;
  return { ...body, coefficients };
}

/** M^-1 K (9, row by row) in x, y, w theta and natural units, from the loads' K. */
export function reduced(engine, body, loads) {
  const [m, I, w] = ["m", "I", "w"].map((name) => coefficient(engine, body, name));
  const unit = [1 / Math.sqrt(m), 1 / Math.sqrt(m), 1 / Math.sqrt(I)]; // symmetric K stays so
  const lever = [1, 1, w * Math.sqrt(m / I)];
  return { A: Array.from({ length: 9 }, (_, i) => {
    const [row, column] = [Math.floor(i / 3), i % 3];
    return loads[3 + i] * unit[row] * unit[column];
  }), lever };
}

/** Solution of J x = f (J row by row) by cofactors, and the determinant. */
function solve([a, b, c, d, e, f, g, h, i], [p, q, r]) {
  const [A, B, C] = [e * i - f * h, f * g - d * i, d * h - e * g];
  const determinant = a * A + b * B + c * C;
  const x = A * p + (c * h - b * i) * q + (b * f - c * e) * r;
  const y = B * p + (a * i - c * g) * q + (c * d - a * f) * r;
  const z = C * p + (b * g - a * h) * q + (a * e - b * d) * r;
  return { x: [x / determinant, y / determinant, z / determinant], determinant };
}

/** Newton's method for a place of rest at the body's mu; null where it does not converge. */
function rest(engine, body, z, passes) {
  const w = coefficient(engine, body, "w");
  const at = [...z.slice(0, 3), 0, 0, 0];
  for (let pass = 0; pass < passes; pass++) {
    const contact = touching(gapsAt(engine, body, at));
    const f = loadsAt(engine, body, at, contact || 3); // a separated pad is pulled back
    const J = [f[3], f[4], f[5] / w, f[6], f[7], f[8] / w, f[9] / w, f[10] / w, f[11] / w / w];
    const { x, determinant } = solve(J, [f[0], f[1], f[2] / w]);
    if (!x.every(Number.isFinite)) return null;
    for (let i = 0; i < 3; i++) at[i] += x[i];
    const size = Math.max(...x.map(Math.abs)) / (1 + Math.max(...at.slice(0, 3).map(Math.abs)));
    if (size < 1e-12) {
      const gaps = gapsAt(engine, body, at);
      const settled = touching(gaps);
      const tilt = Math.abs(body.pad.theta0 + at[2] / w);
      if (!settled || tilt > Math.PI / 2) return null;
      return { z: at, contact: settled, side: Math.sign(determinant) };
    }
  }
  return null;
}

/** What is known at a place of rest: loads with K, verdict and mu. */
function point(engine, body, mu, found) {
  const loads = loadsAt(engine, body, found.z, found.contact);
  const { A, lever } = reduced(engine, body, loads);
  return { ...found, mu, loads, A, lever, ...judge(A) };
}

/**
 * The branch of equilibria from mu = 0 up to muMax, or up to where it turns back or separates.
 * `shortest` is the share of muMax below which a step means that the branch has ended.
 */
export function branch(engine, body, muMax, longest = 1 / 64, shortest = 1e-5) {
  const start = withFriction(engine, body, 0);
  let first = null;
  for (const seed of SEEDS) first ??= rest(engine, start, seed, 40);
  if (!first) return [];
  const points = [point(engine, start, 0, first)];
  let step = muMax * longest;
  while (points.at(-1).mu < muMax && step > muMax * shortest) {
    const last = points.at(-1), mu = Math.min(last.mu + step, muMax);
    const next = follow(engine, body, last, mu, points.at(-2));
    if (next) points.push(next);
    step = next ? Math.min(1.5 * step, muMax * longest) : step / 2;
  }
  return points;
}

/** The equilibrium at mu on the branch of a point nearby, or null; `before` gives the direction. */
export function follow(engine, body, from, mu, before) {
  const here = withFriction(engine, body, mu);
  const ahead = before ? (mu - from.mu) / (from.mu - before.mu) : 0;
  const guess = before ? from.z.map((v, i) => v + ahead * (v - before.z[i])) : from.z;
  const found = rest(engine, here, guess, 8);
  if (!found || found.side !== from.side) return null;
  const size = Math.max(...from.z.map(Math.abs));
  const moved = Math.max(...found.z.map((v, i) => Math.abs(v - from.z[i])));
  return moved < 0.3 * (1 + size) ? point(engine, here, mu, found) : null;
}

/** The sliding equilibrium at mu on a branch, or null beyond its end. */
export function onBranch(engine, body, points, mu) {
  const below = points.findLast((p) => p.mu <= mu);
  if (!below || mu > points.at(-1).mu) return null;
  return below.mu === mu ? below : follow(engine, body, below, mu);
}

/** Every change of verdict along a branch: {mu, kind, hertz}. */
export function thresholds(engine, body, points) {
  const found = [];
  for (let i = 1; i < points.length; i++) {
    if (points[i].verdict === points[i - 1].verdict) continue;
    let [low, high] = [points[i - 1], points[i]];
    for (let k = 0; k < 60 && high.mu - low.mu > 2 * EPS * high.mu; k++) {
      const middle = follow(engine, body, low, (low.mu + high.mu) / 2);
      if (!middle) break;
      if (middle.verdict === points[i - 1].verdict) low = middle;
      else high = middle;
    }
    const kind = high.verdict === MARGINAL ? "restabilised" : VERDICTS[high.verdict];
    const values = eigenvalues(high.verdict === MARGINAL ? low : high, body.units.time);
    const fastest = values.reduce((a, b) => (b.re > a.re ? b : a)); // the mode that changes
    found.push({ mu: high.mu, kind, hertz: Math.abs(fastest.im) / (2 * Math.PI) });
  }
  return found;
}

/** Coefficients a, b, c of s^3 - a s^2 + b s - c of A, J2, J3 of its deviator, and their sizes. */
function invariants(A) {
  const [d1, d2, d3] = [A[0], A[4], A[8]];
  const [p12, p13, p23] = [A[1] * A[3], A[2] * A[6], A[5] * A[7]];
  const [t1, t2] = [A[1] * A[5] * A[6], A[2] * A[3] * A[7]];
  const a = d1 + d2 + d3;
  const b = d1 * d2 + (d1 + d2) * d3 - p12 - p13 - p23;
  const c = d1 * (d2 * d3 - p23) - d2 * p13 - d3 * p12 + t1 + t2;
  const [e1, e2, e3] = [d1 - a / 3, d2 - a / 3, d3 - a / 3];
  const J2 = (e1 * e1 + e2 * e2 + e3 * e3) / 2 + p12 + p13 + p23;
  const J3 = e1 * (e2 * e3 - p23) - e2 * p13 - e3 * p12 + t1 + t2;
  const q1 = Math.abs(d1) + Math.abs(d2) + Math.abs(d3);
  const q2 = q1 * q1 + Math.abs(p12) + Math.abs(p13) + Math.abs(p23);
  const q3 = q1 * q2 + Math.abs(t1) + Math.abs(t2);
  return { a, b, c, J2, J3, discriminant: 4 * J2 ** 3 - 27 * J3 ** 2, sizes: [q1, q2, q3] };
}

/** Roots of s^3 - a s^2 + b s - c as {re, im}; a pair stands last, positive part first. */
function roots(A) {
  const { a, J2, J3, discriminant } = invariants(A);
  if (discriminant >= 0) {
    const size = 2 * Math.sqrt(Math.max(J2, 0) / 3);
    const cosine = size ? Math.max(-1, Math.min(1, (3 * J3) / (J2 * size))) : 1;
    const angle = Math.acos(cosine) / 3;
    return [0, 1, 2]
      .map((k) => ({ re: a / 3 + size * Math.cos(angle - (2 * Math.PI * k) / 3), im: 0 }))
      .sort((p, q) => p.re - q.re);
  }
  const cube = Math.cbrt(Math.abs(J3) / 2 + Math.sqrt(-discriminant / 108));
  let y = J3 < 0 ? -(cube + J2 / (3 * cube)) : cube + J2 / (3 * cube);
  for (let k = 0; k < 3; k++) y -= ((y * y - J2) * y - J3) / (3 * y * y - J2 || Infinity);
  const im = Math.sqrt(Math.max(0.75 * y * y - J2, 0));
  return [{ re: a / 3 + y, im: 0 }, { re: a / 3 - y / 2, im }, { re: a / 3 - y / 2, im: -im }];
}

/** Square root of a complex number, real part not negative, without cancellation. */
function squareRoot({ re, im }) {
  const large = Math.sqrt((Math.hypot(re, im) + Math.abs(re)) / 2);
  const small = large ? Math.abs(im) / (2 * large) : 0;
  const [real, imaginary] = re < 0 ? [small, large] : [large, small];
  return { re: real, im: im < 0 ? -imaginary : imaginary };
}

/** The three modes: {re, im} of one eigenvalue in 1/s, im >= 0 (the other is its negative). */
function modes({ A, pair }, time) {
  return roots(A).map((s) => {
    const root = squareRoot({ re: -s.re, im: pair ? -s.im : 0 });
    const sign = root.im < 0 ? -1 : 1;
    return { s, re: (sign * root.re) / time, im: (sign * root.im) / time };
  });
}

/** All six eigenvalues in 1/s. */
export function eigenvalues(at, time) {
  return modes(at, time).flatMap(({ re, im }) => [{ re, im }, { re: 0 - re, im: 0 - im }]);
}

/** Verdict on the undamped A as an index, and whether a complex pair is there; rounding is zero. */
export function judge(A) {
  const { a, b, c, discriminant, sizes: [q1, q2, q3] } = invariants(A);
  const unit = 512 * EPS;
  const pair = discriminant < -8 * unit * (q2 ** 3 + q3 ** 2);
  const falling = c < -unit * q3 || b < -unit * q2 || a < -unit * q1;
  if (!pair) return { pair, verdict: falling ? DIVERGENCE : MARGINAL };
  const [real, ...others] = modes({ A, pair }, 1).map(({ re }) => re);
  return { pair, verdict: c < -unit * q3 && real > Math.max(...others) ? DIVERGENCE : FLUTTER };
}

const product = (p, q) => ({ re: p.re * q.re - p.im * q.im, im: p.re * q.im + p.im * q.re });
const minus = (p, q) => ({ re: p.re - q.re, im: p.im - q.im });

/** Null vector of the complex A - s: the longest product of two of its rows. */
function nullVector(A, s) {
  const row = (i) => [0, 1, 2].map((j) => ({
    re: A[3 * i + j] - (i === j ? s.re : 0), im: i === j ? -s.im : 0,
  }));
  const cross = (p, q) => [0, 1, 2].map((i) => {
    const [j, k] = [(i + 1) % 3, (i + 2) % 3];
    return minus(product(p[j], q[k]), product(p[k], q[j]));
  });
  const length = (v) => Math.hypot(...v.flatMap(({ re, im }) => [re, im]));
  return [[0, 1], [1, 2], [2, 0]]
    .map(([i, j]) => cross(row(i), row(j)))
    .reduce((best, v) => (length(v) > length(best) ? v : best));
}

/** Modes by rising frequency: eigenvalue and shape (x, y, w theta), the largest part 1. */
export function modeShapes(at, time) {
  return modes(at, time)
    .map((mode) => {
      const vector = nullVector(at.A, mode.s).map((v, i) => {
        return { re: v.re * at.lever[i], im: v.im * at.lever[i] };
      });
      const size = ({ re, im }) => re * re + im * im;
      const top = vector.reduce((best, v) => (size(v) > size(best) ? v : best));
      const inverse = { re: top.re / size(top), im: -top.im / size(top) };
      return { re: mode.re, im: mode.im, shape: vector.map((v) => product(v, inverse)) };
    })
    .sort((p, q) => Math.abs(p.im) - Math.abs(q.im) || q.re - p.re);
}

/** M, C, K (9 each, row by row) about a point in SI units. */
export function matrices(engine, body, at) {
  const { mass, length, time } = body.units;
  const turn = [1, 1, length];
  const si = (from, rate) => Array.from({ length: 9 }, (_, i) => {
    const unit = (mass / time ** rate) * turn[Math.floor(i / 3)] * turn[i % 3];
    return at.loads[from + i] * unit;
  });
  const { m, I } = body.pad;
  return { M: [m, 0, 0, 0, m, 0, 0, 0, I], C: si(12, 1), K: si(3, 2) };
}

/** Reaction in N and its place from the mass centre in m at a point of rest. */
export function reaction(engine, body, at) {
  const { mass, length, time } = body.units;
  const [, , force, place] = signalsAt(engine, withFriction(engine, body, at.mu), at.z, at.contact);
  return [(force * mass * length) / time ** 2, place * length];
}

/** Small motions about the origin in full contact, which the article's model B3 describes. */
export function aboutOrigin(engine, settings) {
  const parameters = { ...settings.parameters, x0: 0, y0: 0 };
  const body = prepare(engine, { ...settings, parameters });
  return { body, at: point(engine, body, body.pad.mu, { z: [0, 0, 0, 0, 0, 0], contact: 3 }) };
}

/** Verdict at angles of the map, about the origin or about the sliding equilibrium. */
export function mapCode(engine, settings, alpha1, alpha2, origin) {
  const there = { ...settings, parameters: { ...settings.parameters, alpha1, alpha2 } };
  if (origin) return aboutOrigin(engine, there).at.verdict;
  const body = prepare(engine, there);
  const points = branch(engine, body, body.pad.mu, 1 / 8, 1 / 2000);
  return points.length && points.at(-1).mu >= body.pad.mu ? points.at(-1).verdict : BEYOND;
}
