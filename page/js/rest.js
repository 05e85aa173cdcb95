// Places of rest: where the loads of the compiled functions balance.

import { coefficient, fullContact, gapsAt, loadsAt, touching } from "./engine.js";

// where the place of rest without friction is looked for, in units of the motion
const SEEDS = [0, -1, -10, 1, 10].flatMap((y) => [0, -1, 1].map((turn) => [0, y, turn]));
const POTENTIAL = 24; // its place among the loads

/** The body with another coefficient of friction. */
export function withFriction(engine, body, mu) {
  const coefficients = body.coefficients.slice();
  coefficients[engine.tables.coefficients.indexOf("mu")] = mu;
  return { ...body, coefficients };
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
export function rest(engine, body, z, passes) {
  const w = coefficient(engine, body, "w");
  const at = [...z.slice(0, 3), 0, 0, 0];
  for (let pass = 0; pass < passes; pass++) {
    const contact = touching(body, gapsAt(engine, body, at));
    const f = loadsAt(engine, body, at, contact || fullContact(body)); // a separated pad is pulled back
    const J = [f[3], f[4], f[5] / w, f[6], f[7], f[8] / w, f[9] / w, f[10] / w, f[11] / w / w];
    const { x, determinant } = solve(J, [f[0], f[1], f[2] / w]);
    if (!x.every(Number.isFinite)) return null;
    for (let i = 0; i < 3; i++) at[i] += x[i];
    const size = Math.max(...x.map(Math.abs)) / (1 + Math.max(...at.slice(0, 3).map(Math.abs)));
    if (size < 1e-12) {
      const gaps = gapsAt(engine, body, at);
      const settled = touching(body, gaps);
      const tilt = Math.abs(body.pad.theta0 + at[2] / w);
      if (!settled || tilt > Math.PI / 2) return null;
      return { z: at, contact: settled, side: Math.sign(determinant) };
    }
  }
  return null;
}

/** The place of rest without friction of least potential energy, or null. */
export function smoothRest(engine, smooth) {
  let best = null, least = Infinity;
  for (const seed of SEEDS) {
    const found = rest(engine, smooth, seed, 40);
    const potential = found ? loadsAt(engine, smooth, found.z, found.contact)[POTENTIAL] : Infinity;
    // the same place from another seed is equal to rounding
    if (potential < least - 1e-9 * Math.abs(least) || !best) [best, least] = [found, potential];
  }
  return best;
}
