// Small motions about sliding equilibria: eigenvalues, mode shapes, verdict, thresholds, stability
// map. Loads, K, C and gaps come from the compiled functions.

import { fullContact, loadsAt, signalsAt } from "./engine.js";
import { bodyOf, dampedRoots, judgeDamped, reduced } from "./damped.js";
import { rest, smoothRest, withFriction } from "./rest.js";
import { BEYOND, MARGINAL, STABLE, VERDICTS, judge, upper } from "./undamped.js";

const EPS = Number.EPSILON;

/** What is known at a place of rest: loads with K and C, verdict and mu; damped, the six roots. */
function point(engine, body, mu, found) {
  const loads = loadsAt(engine, body, found.z, found.contact);
  const { A, B, lever } = reduced(engine, body, loads);
  const all = { ...found, mu, loads, A, B, lever, ...judge(A) };
  if (!B) return all;
  const six = dampedRoots(A, B, bothSigns(upper(A, all.pair)));
  return { ...all, six, verdict: judgeDamped(six) };
}

/**
 * The branch of equilibria from mu = 0 up to muMax, or up to where it turns back or separates.
 * `shortest` is the share of muMax below which a step means that the branch has ended.
 */
export function branch(engine, body, muMax, longest = 1 / 64, shortest = 1e-5) {
  const start = withFriction(engine, body, 0);
  const first = smoothRest(engine, start);
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
  const found = [], calm = (at) => (at.verdict === STABLE ? MARGINAL : at.verdict);
  for (let i = 1; i < points.length; i++) {
    if (calm(points[i]) === calm(points[i - 1])) continue;
    let [low, high] = [points[i - 1], points[i]];
    for (let k = 0; k < 60 && high.mu - low.mu > 2 * EPS * high.mu; k++) {
      const middle = follow(engine, body, low, (low.mu + high.mu) / 2);
      if (!middle) break;
      if (calm(middle) === calm(points[i - 1])) low = middle;
      else high = middle;
    }
    const settles = calm(high) === MARGINAL;
    const kind = settles ? "restabilised" : VERDICTS[high.verdict];
    const values = eigenvalues(settles ? low : high, body.units.time);
    const fastest = values.reduce((a, b) => (b.re > a.re ? b : a)); // the mode that changes
    found.push({ mu: high.mu, kind, hertz: Math.abs(fastest.im) / (2 * Math.PI) });
  }
  return found;
}

const bothSigns = (three) => three.flatMap(({ re, im }) => [{ re, im }, { re: 0 - re, im: 0 - im }]);

/** The three modes: {re, im} of one eigenvalue each in 1/s, im >= 0. Of real ones, which come by
 * two, those that decay least. */
function modes({ A, pair, six }, time) {
  const half = (values) => values.slice(0, 3);
  const three = six
    ? half(six.filter(({ im }) => im >= 0).sort((p, q) => !!q.im - !!p.im || q.re - p.re))
    : upper(A, pair);
  return three.map(({ re, im }) => ({ re: re / time, im: im / time, root: { re, im } }));
}

/** All six eigenvalues in 1/s. */
export function eigenvalues({ A, pair, six }, time) {
  const all = six ?? bothSigns(upper(A, pair));
  return all.map(({ re, im }) => ({ re: re / time, im: im / time }));
}

const product = (p, q) => ({ re: p.re * q.re - p.im * q.im, im: p.re * q.im + p.im * q.re });
const minus = (p, q) => ({ re: p.re - q.re, im: p.im - q.im });

/** Null vector of s^2 + s B + A at the complex s: the longest product of two of its rows. */
function nullVector(A, B, s) {
  const square = product(s, s);
  const row = (i) => [0, 1, 2].map((j) => {
    const [k, b] = [3 * i + j, B ? B[3 * i + j] : 0], unit = i === j ? 1 : 0;
    return { re: A[k] + b * s.re + unit * square.re, im: b * s.im + unit * square.im };
  });
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
      const vector = nullVector(at.A, at.B, mode.root).map((v, i) => {
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

/** Small motions about the origin in full contact, which of a line contact is the model B3. */
export function aboutOrigin(engine, settings) {
  const parameters = { ...settings.parameters, x0: 0, y0: 0 };
  const body = bodyOf(engine, { ...settings, parameters }, true);
  const origin = { z: [0, 0, 0, 0, 0, 0], contact: fullContact(body) };
  return { body, at: point(engine, body, body.pad.mu, origin) };
}

/** Verdict at angles of the map, about the origin or about the sliding equilibrium. */
export function mapCode(engine, settings, alpha1, alpha2, origin) {
  const there = { ...settings, parameters: { ...settings.parameters, alpha1, alpha2 } };
  if (origin) {
    const { body, at } = aboutOrigin(engine, there);
    return body.refusal ? BEYOND : at.verdict;
  }
  const body = bodyOf(engine, there);
  if (body.refusal) return BEYOND;
  const points = branch(engine, body, body.pad.mu, 1 / 8, 1 / 2000);
  return points.length && points.at(-1).mu >= body.pad.mu ? points.at(-1).verdict : BEYOND;
}
