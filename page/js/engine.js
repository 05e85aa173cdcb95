// The compiled functions of the model, and the hybrid run: steps, first root of the event
// polynomials, change of the contact state. No force and no equation of motion stands here.

const SIZE = 6; // x, y, w theta and rates, in natural units

/** The functions of the module: `call(name, input, coefficients, outputs)` gives an array. */
export async function load(bytes, tables) {
  const env = { sin: Math.sin, cos: Math.cos, pow: Math.pow };
  const { instance } = await WebAssembly.instantiate(bytes, { env });
  const { memory, __heap_base: base, ...functions } = instance.exports;
  const doubles = (at, n) => new Float64Array(memory.buffer, at, n);
  const events = 2 + tables.limits.length;
  const wanted = base.value + 8 * (tables.tape + 1024);
  if (memory.buffer.byteLength < wanted) {
    memory.grow(Math.ceil((wanted - memory.buffer.byteLength) / 65536));
  }
  let end = Math.ceil(base.value / 8) * 8;
  const room = (n) => (end += 8 * n) - 8 * n;
  const [IN, PARS, H, TIME, TOP, OUT] = [64, 64, 1, 1, 1, 64].map(room);
  const JET = room((SIZE + events) * (tables.order + 1)), TAPE = room(tables.tape);
  const input = doubles(IN, 64), pars = doubles(PARS, 64), h = doubles(H, 1), out = doubles(OUT, 64);
  const jet = doubles(JET, (SIZE + events) * (tables.order + 1));
  return {
    tables,
    events,
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

const ratios = new Map();

/** C(j, i)/C(n, i): from powers to Bernstein's basis, whose coefficients bound the polynomial. */
function toBernstein(n) {
  if (!ratios.has(n)) {
    const rows = [];
    for (let j = 0; j <= n; j++) {
      rows.push([1]);
      for (let i = 1; i <= j; i++) rows[j].push((rows[j][i - 1] * (j - i + 1)) / (n - i + 1));
    }
    ratios.set(n, rows);
  }
  return ratios.get(n);
}

/** First t in (0, h] where the polynomial passes zero upwards (or downwards), or Infinity. */
export function firstCrossing(a, from, order, h, rising) {
  let rest = 0, p = h;
  for (let i = 1; i <= order; i++, p *= h) rest += Math.abs(a[from + i]) * p;
  if (Math.abs(a[from]) > rest) return Infinity; // the usual case: far from the surface
  const scaled = new Float64Array(order + 1);
  p = 1;
  for (let i = 0; i <= order; i++, p *= h) scaled[i] = a[from + i] * p;
  const b = toBernstein(order).map((row) => row.reduce((sum, r, i) => sum + r * scaled[i], 0));
  return crossing(b, 0, h);

  function crossing(b, low, high) {
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
    return Math.min(crossing(left, low, middle), crossing(right, middle, high));
  }
}

/** Name of an exported function in a contact state (1: leading edge touches, 2: trailing). */
export const within = (what, law, contact) =>
  contact ? `${what}_${law}_${contact}` : `${what}_0`;

/** The law of a model in a formulation, as the exported functions are named. */
export const lawOf = (model, formulation) =>
  model === "B1" ? "B1" : ["B2", ...Object.values(formulation)].join("_");

/** Units in which a motion is of order one (squeal.model.units; compared with it in the tests). */
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
  const count = engine.tables.coefficients.length;
  const c = engine.call(`coefficients_${model}`, scaled, null, count);
  const turn = units.length / units.lever;
  const place = [units.length, units.length, turn];
  const factors = [...place, ...place.map((f) => f / units.time)];
  return { model, law: lawOf(model, formulation), pad, units, coefficients: c, factors };
}

/** A coefficient of the model by its name. */
export const coefficient = (engine, body, name) =>
  body.coefficients[engine.tables.coefficients.indexOf(name)];

/** [gap, gap, rate, rate, limits...] of a state; a gap is positive where the edge is off. */
export const gapsAt = (engine, body, state) =>
  engine.call("gaps", state, body.coefficients, 4 + engine.tables.limits.length);

export const touching = (gaps) => (gaps[0] < 0 ? 1 : 0) + (gaps[1] < 0 ? 2 : 0);

/** Net loads (3), K (9), C (9) and the loads' derivative by mu (3), in natural units. */
export const loadsAt = (engine, body, state, contact) =>
  engine.call(within("loads", body.law, contact), state, body.coefficients, 24);

/** Two plotted signals, reaction and its place from the mass centre; zero and NaN without contact. */
export function signalsAt(engine, body, state, contact) {
  if (!contact) return [0, body.model === "B1" ? 0 : NaN, 0, NaN];
  return engine.call(within("signals", body.law, contact), state, body.coefficients, 4);
}

function accelerations(engine, body, state) {
  const contact = touching(gapsAt(engine, body, state));
  const f = loadsAt(engine, body, state, contact);
  const [m, I, w] = ["m", "I", "w"].map((name) => coefficient(engine, body, name));
  return [f[0] / m, f[1] / m, (w * f[2]) / I];
}

/** Contact state of the first motion; an edge on the surface goes where a short step takes it. */
export function firstContact(engine, body, state) {
  const c = (name) => coefficient(engine, body, name);
  const gaps = gapsAt(engine, body, state);
  const y0 = (body.pad.y0 ?? 0) / body.units.length;
  const rounding = 8 * Number.EPSILON * (c("h") + c("w") + Math.abs(y0) + Math.abs(state[1]));
  if (Math.min(Math.abs(gaps[0]), Math.abs(gaps[1])) > rounding) return touching(gaps);
  const step = 1e-3, q = state.slice(0, 3), v = state.slice(3);
  const at = (...move) => {
    const place = q.map((x, i) => move.reduce((sum, [f, d]) => sum + f * d[i], x));
    return [...place, 0, 0, 0];
  };
  const a1 = accelerations(engine, body, state);
  const a2 = accelerations(engine, body, at([step / 2, v]));
  const a3 = accelerations(engine, body, at([step / 2, v], [step ** 2 / 4, a1]));
  const a = a1.map((_, i) => a1[i] + a2[i] + a3[i]);
  const moved = gapsAt(engine, body, at([step, v], [step ** 2 / 6, a]));
  return touching([0, 1].map((i) => (Math.abs(gaps[i]) > rounding ? gaps[i] : moved[i] - gaps[i])));
}

/** True if the other edge has passed the surface in the same instant as `edge`. */
function late(engine, body, state, contact, edge) {
  const gaps = gapsAt(engine, body, state), other = 1 - edge;
  const side = (e, value) => (contact & (1 << e) ? value : -value);
  if (side(other, gaps[other]) < Math.min(side(edge, gaps[edge]), 0)) return false;
  return side(other, gaps[2 + other]) > 0;
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
  let jets = new Float64Array(SIZE * terms * 512);
  const nodes = [t], contacts = [], changes = [];
  const change = (edge) => {
    const to = contact ^ (1 << edge);
    changes.push({ t, from: contact, to });
    contact = to;
  };
  while (t < until) {
    let h = engine.step(within("step", body.law, contact), state, body.coefficients, until - t);
    let event = -1;
    for (let e = 0; e < engine.events; e++) {
      const at = firstCrossing(engine.jet, (SIZE + e) * terms, order, h, e < 2);
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
    else if (event >= 2) end = limits[event - 2];
    else if (steps >= mostSteps && t < until) end = "the motion takes too many steps";
    if (end) break;
    if (event >= 0 && t < until) {
      const both = late(engine, body, state, contact, event);
      change(event);
      if (both) change(1 - event);
    }
  }
  return { t, state, contact, first, steps, nodes, jets, contacts, changes, end };
}

/** States (6 each) and contacts at rising times, in natural units. */
export function sample(engine, motion, times) {
  const { order } = engine.tables, terms = order + 1;
  const states = new Float64Array(SIZE * times.length), contacts = new Uint8Array(times.length);
  let step = 0;
  times.forEach((t, k) => {
    while (step < motion.steps - 1 && t >= motion.nodes[step + 1]) step++;
    const lapse = t - motion.nodes[step], from = step * SIZE * terms;
    for (let i = 0; i < SIZE; i++) {
      states[SIZE * k + i] = horner(motion.jets, from + i * terms, order, lapse);
    }
    contacts[k] = motion.contacts[step];
  });
  return { states, contacts };
}

/** Plain numbers of a motion in SI units. */
export const summary = (body, { steps, end, t, state, changes }) => ({
  units: body.units,
  steps,
  end,
  t: t * body.units.time,
  state: state.map((v, i) => v * body.factors[i]),
  changes: changes.map((change) => [change.t * body.units.time, change.from, change.to]),
});
