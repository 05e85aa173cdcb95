// Modes of z'' + A z = 0 in three freedoms: by the roots of the cubic in s = -lambda^2.

export const VERDICTS = ["marginal", "flutter", "divergence", "beyond a fold", "stable"];
export const MARGINAL = 0;
export const FLUTTER = 1;
export const DIVERGENCE = 2;
export const BEYOND = 3;
export const STABLE = 4;
const EPS = Number.EPSILON;

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

/** One eigenvalue of each of the three modes, im >= 0 (the other is its negative). */
export function upper(A, pair) {
  return roots(A).map((s) => {
    const root = squareRoot({ re: -s.re, im: pair ? -s.im : 0 });
    const sign = root.im < 0 ? -1 : 1;
    return { re: sign * root.re, im: sign * root.im };
  });
}

/** Verdict on the undamped A as an index, and whether a complex pair is there; rounding is zero. */
export function judge(A) {
  const { a, b, c, discriminant, sizes: [q1, q2, q3] } = invariants(A);
  const unit = 512 * EPS;
  const pair = discriminant < -8 * unit * (q2 ** 3 + q3 ** 2);
  const falling = c < -unit * q3 || b < -unit * q2 || a < -unit * q1;
  if (!pair) return { pair, verdict: falling ? DIVERGENCE : MARGINAL };
  const [real, ...others] = upper(A, pair).map(({ re }) => re);
  return { pair, verdict: c < -unit * q3 && real > Math.max(...others) ? DIVERGENCE : FLUTTER };
}

