// The compiled functions of the model, and the hybrid run: steps, first root of the event
// polynomials, change of the contact state. No force and no equation of motion stands here.

const LEAST_TURN = 1e-15;
const SIZE = 6; // x, y, w theta and rates, in natural units

/** The functions of the module: `call(name, input, coefficients, outputs)` gives an array. */
export async function load(bytes, tables) {
  const env = { sin: Math.sin, cos: Math.cos, pow: Math.pow };
  const { instance } = await WebAssembly.instantiate(bytes, { env });
  const { memory, __heap_base: base, ...functions } = instance.exports;
  const doubles = (at, n) => new Float64Array(memory.buffer, at, n);
  const most = Math.max(...Object.values(tables.laws).map(({ points }) => points));
  const events = most + tables.limits.length;
  const inputs = tables.coefficients.length + most + tables.decay;
  const wanted = base.value + 8 * (tables.tape + 1024);
  if (memory.buffer.byteLength < wanted) {
    memory.grow(Math.ceil((wanted - memory.buffer.byteLength) / 65536));
  }
  let end = Math.ceil(base.value / 8) * 8;
  const room = (n) => (end += 8 * n) - 8 * n;
  const [IN, PARS, H, TIME, TOP, OUT] = [64, inputs, 1, 1, 1, 2 * events].map(room);
  const JET = room((SIZE + events) * (tables.order + 1)), TAPE = room(tables.tape);
  const input = doubles(IN, 64), pars = doubles(PARS, inputs), h = doubles(H, 1);
  const out = doubles(OUT, 2 * events);
  const jet = doubles(JET, (SIZE + events) * (tables.order + 1));
  return {
    tables,
    call(name, values, coefficients, outputs) {
      input.set(values);
      if (coefficients) pars.set(coefficients);
      functions[name](OUT, IN, PARS, TIME);
      return out.slice(0, outputs);
    },
    /** One step of at most `longest`: its length; the polynomials stand in `jet`. */
    step(name, state, coefficients, longest) {
      input.set(state);
      pars.set(coefficients);
      h[0] = longest;
      functions[name](JET, IN, PARS, TIME, H, TOP, TAPE);
      return h[0];
    },
    jet,
  };
}

/** Value at t of the polynomial whose coefficients start at `from`. */
export function horner(a, from, order, t) {
  let value = a[from + order];
  for (let k = order - 1; k >= 0; k--) value = value * t + a[from + k];
  return value;
}

const bases = new Map();

/** C(j, i)/C(n, i), row by row: from powers to Bernstein's basis, whose coefficients bound the
 * polynomial; and room for one. */
function bernstein(n) {
  if (!bases.has(n)) {
    const ratios = new Float64Array((n + 1) ** 2);
    for (let j = 0; j <= n; j++) {
      ratios[j * (n + 1)] = 1;
      for (let i = 1; i <= j; i++) {
        ratios[j * (n + 1) + i] = (ratios[j * (n + 1) + i - 1] * (j - i + 1)) / (n - i + 1);
      }
    }
    bases.set(n, { ratios, powers: new Float64Array(n + 1), found: new Float64Array(n + 1) });
  }
  return bases.get(n);
}

/** First t in (0, h] where the polynomial passes zero upwards (or downwards), or Infinity. */
export function firstCrossing(a, from, order, h, rising) {
  let rest = 0, p = h;
  for (let i = 1; i <= order; i++, p *= h) rest += Math.abs(a[from + i]) * p;
  if (Math.abs(a[from]) > rest) return Infinity; // the usual case: far from the surface
  const { ratios, powers, found } = bernstein(order);
  p = 1;
  for (let i = 0; i <= order; i++, p *= h) powers[i] = a[from + i] * p;
  let above = false, below = false;
  for (let j = 0; j <= order; j++) {
    let sum = 0;
    for (let i = 0, row = j * (order + 1); i <= j; i++) sum += ratios[row + i] * powers[i];
    found[j] = sum;
    above ||= sum > 0;
    below ||= sum < 0;
  }
  return above && below ? crossing({ a, from, order, h, rising }, Array.from(found), 0, h) : Infinity;
}

/** The same in [low, high], where the polynomial has the Bernstein coefficients b. */
function crossing(of, b, low, high) {
  const { a, from, order, h, rising } = of;
  const signs = b.map(Math.sign).filter((s) => s !== 0);
  const changes = signs.filter((s, i) => i > 0 && s !== signs[i - 1]).length;
  if (changes === 0 || !(high - low > 1e-14 * h)) return Infinity;
  if (changes === 1) {
    if (rising !== signs[0] < 0) return Infinity;
    for (let middle; (middle = (low + high) / 2) > low && middle < high; ) {
      if (Math.sign(horner(a, from, order, middle)) === signs[0]) low = middle;
      else high = middle;
    }
    return high;
  }
  // de Casteljau; not at the middle, where symmetric motions may have a root
  const at = 0.4871, left = [], right = [];
  for (let row = b; row.length; ) {
    left.push(row[0]);
    right.unshift(row[row.length - 1]);
    row = row.slice(1).map((v, i) => (1 - at) * row[i] + at * v);
  }
  const middle = low + at * (high - low);
  return Math.min(crossing(of, left, low, middle), crossing(of, right, middle, high));
}

/** Name of an exported function in a contact state (bit i: point i touches); where one code serves
 * all states, the coefficients of the body tell it from here on. */
function within(engine, { law, own, points, coefficients }, what, contact) {
  if (own) return contact ? `${what}_${law}_${contact}` : `${what}_0`;
  const first = engine.tables.coefficients.length;
  for (let i = 0; i < points; i++) coefficients[first + i] = (contact >>> i) & 1;
  return `${what}_${law}`;
}

/** The law of a model in a formulation, as the exported functions are named. */
export const lawOf = (model, formulation) => [model, ...Object.values(formulation)].join("_");

/** Units in which a motion is of order one (Units of squeal.model.equations; compared with it in the tests). */
export function naturalUnits(pad, initial) {
  const stiffness = ["k1", "k2", "k3", "k4", "k_c"].reduce((sum, k) => sum + (pad[k] ?? 0), 0);
  const time = Math.sqrt(pad.m / stiffness);
  const [x, y, theta, u, v, turning] = initial;
  const height = pad.k_c ? Math.abs((pad.y0 ?? 0) + y) : Math.abs(y);
  const speed = time * Math.hypot(u, v, pad.w * turning);
  const size = [Math.abs(x), height, Math.abs(pad.w * theta), speed, pad.F_n / stiffness];
  return { mass: pad.m, length: Math.max(...size) || pad.w, time, lever: pad.w };
}

/** A pad in natural units, ready to run: coefficients, factors to SI units of the six states. */
export function prepare(engine, { model, formulation, parameters, initial }) {
  const pad = { x0: 0, y0: 0, theta0: 0, ...parameters };
  pad.I ??= (pad.m * (pad.w ** 2 + pad.h ** 2)) / 3;
  const units = naturalUnits(pad, initial);
  const scaled = engine.tables.inputs.map((name) => {
    const [mass, length, time] = engine.tables.parameters[name].dimension;
    return (pad[name] ?? 0) / (units.mass ** mass * units.length ** length * units.time ** time);
  });
  const law = lawOf(model, formulation), { coefficients: maker, ...described } = engine.tables.laws[law];
  const count = engine.tables.coefficients.length;
  const c = new Float64Array(count + described.points + engine.tables.decay); // see `damped`
  c.set(engine.call(maker, scaled, null, count));
  const turn = units.length / units.lever;
  const place = [units.length, units.length, turn];
  const factors = [...place, ...place.map((f) => f / units.time)];
  return { model, law, ...described, pad, units, coefficients: c, damped: false, factors };
}

/** A coefficient of the model by its name. */
export const coefficient = (engine, body, name) =>
  body.coefficients[engine.tables.coefficients.indexOf(name)];

/** [gaps..., rates..., limits...] of a state; a gap is positive where its point is off. */
export const gapsAt = (engine, body, state) =>
  engine.call(body.gaps, state, body.coefficients, 2 * body.points + engine.tables.limits.length);

/** The contact state that gaps tell. */
export function touching(body, gaps) {
  let contact = 0;
  for (let i = 0; i < body.points; i++) if (gaps[i] < 0) contact |= 1 << i;
  return contact >>> 0;
}

export const fullContact = ({ points }) => 2 ** points - 1;

/** The points that can change next: the face is straight, so these lie where contact ends, or at
 * both ends of the face. */
function nextPoints({ points }, contact) {
  let count = 0;
  for (let i = 0; i < points; i++) count += (contact >>> i) & 1;
  if (count === 0 || count === points) return [0, points - 1];
  return contact & 1 ? [count - 1, count] : [points - count - 1, points - count];
}

/** Which ends of the face touch: 1 the leading, 2 the trailing. The face is straight, so that is
 * full contact (3), partial contact on one side, or none. */
export const edges = ({ points }, contact) => (contact & 1) + 2 * ((contact >>> (points - 1)) & 1);

/** Net loads (3), K (9), C (9), the loads' derivative by mu (3) and the potential energy, in
 * natural units. */
export const loadsAt = (engine, body, state, contact) =>
  engine.call(within(engine, body, "loads", contact), state, body.coefficients, 25);

/** Two plotted signals, reaction and its place from the mass centre; zero and NaN without contact. */
export function signalsAt(engine, body, state, contact) {
  if (!contact) return [0, body.model === "B1" ? 0 : NaN, 0, NaN];
  return engine.call(within(engine, body, "signals", contact), state, body.coefficients, 4);
}

function accelerations(engine, body, state) {
  const contact = touching(body, gapsAt(engine, body, state));
  const f = loadsAt(engine, body, state, contact);
  const [m, I, w] = ["m", "I", "w"].map((name) => coefficient(engine, body, name));
  return [f[0] / m, f[1] / m, (w * f[2]) / I];
}

/** Contact state of the first motion; a point on the surface goes where a short step takes it. */
export function firstContact(engine, body, state) {
  const c = (name) => coefficient(engine, body, name);
  const gaps = gapsAt(engine, body, state).slice(0, body.points);
  const y0 = (body.pad.y0 ?? 0) / body.units.length;
  const rounding = 8 * Number.EPSILON * (c("h") + c("w") + Math.abs(y0) + Math.abs(state[1]));
  if (gaps.every((gap) => Math.abs(gap) > rounding)) return touching(body, gaps);
  const step = 1e-3, q = state.slice(0, 3), v = state.slice(3);
  const along = (x, ...move) => x.map((x, i) => move.reduce((sum, [f, d]) => sum + f * d[i], x));
  const at = (place, rate) => [...place, ...rate];
  const a1 = accelerations(engine, body, state);
  const v2 = along(v, [step / 2, a1]);
  const a2 = accelerations(engine, body, at(along(q, [step / 2, v]), v2));
  const q3 = along(q, [step / 2, v], [step ** 2 / 4, a1]);
  const a3 = accelerations(engine, body, at(q3, along(v, [step / 2, a2])));
  const a = a1.map((_, i) => a1[i] + a2[i] + a3[i]);
  const moved = gapsAt(engine, body, at(along(q, [step, v], [step ** 2 / 6, a]), v));
  const on = (gap, i) => (Math.abs(gap) > rounding ? gap : moved[i] - gap);
  return touching(body, gaps.map(on));
}

/** Turn a level pad on the surface, whose contact length would be 0/0, to the side that touches,
 * by less than rounding (squeal.simulation.hybrid.off_level; compared with it in the tests). */
function offLevel(engine, body, state, contact) {
  if (!body.own || (contact !== 1 && contact !== 2)) return;
  const gaps = gapsAt(engine, body, state);
  if (Math.abs(gaps[0] - gaps[1]) >= LEAST_TURN * coefficient(engine, body, "w")) return;
  const turned = [1, -1].map((way) => [state[0], state[1], state[2] + way * LEAST_TURN, ...state.slice(3)]);
  const [first, second] = turned.map((one) => gapsAt(engine, body, one)[contact - 1]);
  state[2] = first < second ? turned[0][2] : turned[1][2];
}

/** The other points that have passed the surface in the same instant as `point`. */
function late(engine, body, state, contact, point) {
  const gaps = gapsAt(engine, body, state);
  const beyond = (i, value) => ((contact >>> i) & 1 ? value : -value);
  const limit = Math.min(beyond(point, gaps[point]), 0), found = [];
  for (let i = 0; i < body.points; i++) {
    if (i === point || beyond(i, gaps[i]) < limit) continue;
    if (beyond(i, gaps[body.points + i]) > 0) found.push(i);
  }
  return found;
}

/**
 * The motion from SI values `initial` up to `stop` seconds, or from where `onward` ended.
 * nodes: times of the steps; jets: their polynomials; contacts: their states; changes: {t, from,
 * to}; end: null, or why the motion ends before. Natural units; `body.units` turns them to SI.
 */
export function run(engine, body, initial, stop, { onward = null, mostSteps = 20000 } = {}) {
  const { order, limits } = engine.tables, terms = order + 1, until = stop / body.units.time;
  const state = onward ? onward.state.slice() : initial.map((v, i) => v / body.factors[i]);
  let contact = onward ? onward.contact : firstContact(engine, body, state);
  let t = onward ? onward.t : 0, steps = 0, end = null;
  const first = contact;
  if (!onward) offLevel(engine, body, state, contact);
  let jets = new Float64Array(SIZE * terms * 512);
  const nodes = [t], contacts = [], changes = [];
  const what = body.damped ? "damped" : "step", { points } = body;
  const ends = limits.map((_, i) => points + i); // events that end the motion
  const change = (point) => {
    const to = (contact ^ (1 << point)) >>> 0;
    changes.push({ t, from: contact, to });
    contact = to;
  };
  while (t < until) {
    const name = within(engine, body, what, contact);
    let h = engine.step(name, state, body.coefficients, until - t);
    let event = -1;
    for (const e of [...nextPoints(body, contact), ...ends]) {
      const at = firstCrossing(engine.jet, (SIZE + e) * terms, order, h, e < points);
      if (at <= h && (event < 0 || at < h)) [h, event] = [at, e];
    }
    const own = SIZE * terms;
    if ((steps + 1) * own > jets.length) {
      const more = new Float64Array(2 * jets.length);
      more.set(jets);
      jets = more;
    }
    jets.set(engine.jet.subarray(0, own), steps * own);
    for (let i = 0; i < SIZE; i++) state[i] = horner(engine.jet, i * terms, order, h);
    const last = event < 0 && h >= until - t;
    t = last ? until : t + h;
    nodes.push(t);
    contacts.push(contact);
    steps++;
    if (!state.every(Number.isFinite)) end = "the motion is not finite";
    else if (event >= points) end = limits[event - points];
    else if (steps >= mostSteps && t < until) end = "the motion takes too many steps";
    if (end) break;
    if (event >= 0 && t < until) {
      const others = late(engine, body, state, contact, event);
      for (const point of [event, ...others]) change(point);
      offLevel(engine, body, state, contact);
    }
  }
  return { t, state, contact, first, steps, nodes, jets, contacts, changes, end };
}

/** Write the state of a step after `lapse` to place k of `states`. */
function put({ tables: { order } }, { jets }, step, lapse, states, k) {
  const terms = order + 1, from = step * SIZE * terms;
  for (let i = 0; i < SIZE; i++) states[SIZE * k + i] = horner(jets, from + i * terms, order, lapse);
}

/** States (6 each) and contacts at rising times, in natural units. */
export function sample(engine, motion, times) {
  const states = new Float64Array(SIZE * times.length), contacts = new Uint32Array(times.length);
  let step = 0;
  times.forEach((t, k) => {
    while (step < motion.steps - 1 && t >= motion.nodes[step + 1]) step++;
    put(engine, motion, step, t - motion.nodes[step], states, k);
    contacts[k] = motion.contacts[step];
  });
  return { states, contacts };
}

/** The same at `each` places of every step, its ends among them, with the times. */
export function trace(engine, motion, each) {
  const n = motion.steps * each, { nodes } = motion;
  const times = new Float64Array(n), contacts = new Uint32Array(n), states = new Float64Array(SIZE * n);
  for (let k = 0; k < n; k++) {
    const step = Math.floor(k / each), share = (k % each) / (each - 1);
    const lapse = share * (nodes[step + 1] - nodes[step]);
    times[k] = nodes[step] + lapse;
    contacts[k] = motion.contacts[step];
    put(engine, motion, step, lapse, states, k);
  }
  return { times, states, contacts, each };
}

const NEAR = 0.05; // of the range: so far the peaks lie at most above what was traced
const GOLDEN = (Math.sqrt(5) - 1) / 2;

/**
 * Least and greatest value that `read(state, contact)` takes in the motion, not only at what was
 * traced: about the highest places the peak of its step is searched.
 */
export function extremes(engine, motion, { times, contacts, each }, values, read) {
  const state = new Float64Array(SIZE), n = values.length;
  const ends = [Infinity, -Infinity];
  for (const v of values) {
    if (v < ends[0]) ends[0] = v;
    if (v > ends[1]) ends[1] = v;
  }
  const margin = NEAR * (ends[1] - ends[0]);
  return [-1, 1].map((sign, which) => {
    let best = sign * ends[which];
    const level = best - margin;
    for (let k = 0; k < n; k++) {
      const v = sign * values[k], step = Math.floor(k / each), first = step * each, last = first + each - 1;
      const below = k > first ? sign * values[k - 1] : -Infinity, above = k < last ? sign * values[k + 1] : -Infinity;
      if (!(v > level && v >= below && v >= above)) continue;
      const at = (t) => {
        put(engine, motion, step, t - motion.nodes[step], state, 0);
        return sign * read(state, contacts[k]);
      };
      let low = times[Math.max(k - 1, first)], high = times[Math.min(k + 1, last)];
      let inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)], heights = inner.map(at);
      for (let pass = 0; pass < 24; pass++) {
        const left = heights[0] > heights[1], t = inner[left ? 0 : 1];
        if (left) [high, inner] = [inner[1], [inner[1] - GOLDEN * (inner[1] - low), t]];
        else [low, inner] = [inner[0], [t, inner[0] + GOLDEN * (high - inner[0])]];
        const kept = heights[left ? 0 : 1];
        heights = left ? [at(inner[0]), kept] : [kept, at(inner[1])];
      }
      best = Math.max(best, ...heights.filter(Number.isFinite));
    }
    return sign * best;
  });
}

/** Time spent in each contact state that `state` names, as shares. */
export function shares({ nodes, contacts, t }, state) {
  const found = {};
  contacts.forEach((contact, step) => {
    found[state(contact)] = (found[state(contact)] ?? 0) + (nodes[step + 1] - nodes[step]) / t;
  });
  return found;
}

/** Plain numbers of a motion in SI units. */
export const summary = (body, { steps, end, t, state, changes }) => ({
  units: body.units,
  refusal: body.refusal ?? null, // of damping
  steps,
  end,
  t: t * body.units.time,
  state: state.map((v, i) => v * body.factors[i]),
  changes: changes.map((change) => [change.t * body.units.time, change.from, change.to]),
});
