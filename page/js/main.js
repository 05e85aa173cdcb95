// The page: settings in, motion and stability out, everything again at each change.

import { drawHistories, drawMap, drawModes, drawRoots, drawSpectrum, instantAt, number } from "./charts.js";
import { makeControls } from "./controls.js";
import { bodyOf } from "./damped.js";
import { edges, extremes, gapsAt, load, run, shares, signalsAt, summary, trace } from "./engine.js";
import * as linear from "./linear.js";
import { drawPad, enlargement } from "./pad.js";
import { paint, readColours } from "./plot.js";
import { PRESETS, fromCase, fromLink, toLink, toScene } from "./settings.js";
import { play, render, silence } from "./sound.js";
import { spectrum } from "./spectrum.js";
import { MARGINAL, STABLE, VERDICTS } from "./undamped.js";

const POINTS = 1024; // of a curve at least, in all of its steps
const MOST_STEPS = 5000, MU_MAX = 2, MAP = 40;
const SWEEP = 12; // seconds in which the picture goes through the time shown
const SLICE = 5; // ms of each frame that the map may take
const CHOICES = ["line_force", "delta_from", "delta_moment", "springs"]; // of a formulation
const id = (name) => document.getElementById(name);

async function start() {
  const tables = JSON.parse(id("tables").textContent);
  const packed = Uint8Array.from(atob(id("module").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const engine = await load(await new Response(stream).arrayBuffer(), tables);
  let settings = fromLink(tables, location.hash);
  let view = null, map = null, dirty = true, settled = false, later = 0, before = 0;
  let share = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  let reads = {};
  const hover = {}; // where the pointer is over a chart
  /** Words for all readers, or for those who hear the page only. */
  const say = (text, quiet = false) => {
    id("status").textContent = text;
    id("status").classList.toggle("quiet", quiet);
  };
  const show = makeControls(document, tables, () => settings, touched);

  function touched() {
    dirty = true;
    settled = false;
    clearTimeout(later);
    later = setTimeout(settle, 300);
  }

  /** Show all settings after a change of model or case, or from a link. */
  function showAll() {
    for (const name of ["model", "case"]) {
      for (const radio of document.getElementsByName(name)) radio.checked = radio.value === settings[name];
    }
    id("formulation").hidden = !Object.keys(settings.formulation).length;
    for (const key of CHOICES) {
      id(key).closest("label").hidden = !(key in settings.formulation);
      if (key in settings.formulation) id(key).value = settings.formulation[key];
    }
    show(fromCase(tables, settings.model, settings.case));
    touched();
  }

  /** What follows a change only when it is over: link, scene file, words. */
  function settle() {
    if (dirty) return void (later = setTimeout(settle, 100));
    history.replaceState(null, "", `#${toLink(settings)}`);
    id("scene").value = toScene(tables, settings);
    describe();
    settled = true;
  }

  function recompute() {
    const begun = performance.now();
    const body = bodyOf(engine, settings);
    const motion = run(engine, body, settings.initial, settings.stop, { mostSteps: MOST_STEPS });
    const each = Math.min(16, Math.max(4, Math.ceil(POINTS / motion.steps)));
    const course = trace(engine, motion, each), { times, states, contacts: touching } = course;
    const contacts = Uint8Array.from(touching, (contact) => edges(body, contact));
    const { length, time, mass } = body.units, newton = (mass * length) / time ** 2;
    const units = settings.model === "B1" ? [body.pad.F_n, body.pad.F_n] : [body.pad.F_n, body.pad.w];
    const si = settings.model === "B1" ? [newton, newton] : [newton, length];
    const stateAt = (k) => states.subarray(6 * k, 6 * k + 6);
    const signals = [0, 1].map(() => new Float64Array(times.length)), gaps = [];
    times.forEach((_, k) => {
      const values = signalsAt(engine, body, stateAt(k), touching[k]);
      for (const i of [0, 1]) signals[i][k] = (values[i] * si[i]) / units[i];
      if (k % each === 0) gaps.push(...gapsAt(engine, body, stateAt(k)).slice(0, body.points));
    });
    const ends = signals.map((values, i) => {
      const read = (state, contact) => (signalsAt(engine, body, state, contact)[i] * si[i]) / units[i];
      return extremes(engine, motion, course, values, read);
    });
    const rates = Float64Array.from(times, (_, k) => states[6 * k + 3] * body.factors[3]);
    const [, fastest] = extremes(engine, motion, course, rates, (state) => state[3] * body.factors[3]);
    const milliseconds = times.map((t) => 1000 * t * time);
    const displacements = [0, 1, 2].map((i) => {
      return Float64Array.from(times, (_, k) => states[6 * k + i] * length * 1e6);
    });
    const points = linear.branch(engine, body, MU_MAX);
    const at = linear.onBranch(engine, body, points, body.pad.mu);
    const eigen = at ? linear.modeShapes(at, time) : [];
    const names = tables.signals[body.law].map((n, i) => `${n.replace("delta", "δ")} / ${units[i] === body.pad.F_n ? "Fn" : "w"}`);
    view = {
      engine, body, settings, motion, states, contacts, signals, ends, fastest, gaps, milliseconds,
      displacements, names, points, at, eigen,
      // of a run that was cut, the end is seen and not only a sliver at the left
      stop: motion.end ? Math.min(settings.stop, 1.4 * motion.t * time) : settings.stop,
      shares: shares(motion, (contact) => tables.contacts[settings.model][edges(body, contact)]),
      thresholds: linear.thresholds(engine, body, points),
    };
    view.enlarged = enlargement(view);
    renewMap();
    const computed = performance.now();
    draw();
    numbers();
    view.cost = { compute: computed - begun, draw: performance.now() - computed };
  }

  /** Start the map anew if more than the pad's place on it has changed. */
  function renewMap() {
    const { alpha1, alpha2, ...others } = settings.parameters;
    const origin = id("origin").value === "origin";
    const of = JSON.stringify([settings.model, settings.formulation, settings.damping, others, origin]);
    if (map?.of !== of) map = { of, n: MAP, codes: new Int8Array(MAP * MAP).fill(-1), next: 0, origin };
  }

  function draw() {
    const { body, motion, eigen, thresholds } = view, what = id("heard").value;
    // without an equilibrium, and so without eigenfrequencies, what the stiffest spring would give
    const fastest = Math.max(1 / (Math.PI * body.units.time), ...thresholds.map((t) => t.hertz));
    const highest = 2 * (eigen.length ? Math.max(...eigen.map(({ im }) => im / 2 / Math.PI), 500) : fastest);
    const lines = spectrum(engine, body, motion, what, highest);
    reads = {
      histories: drawHistories(id("histories"), view, () => (share * motion.t * body.units.time) / view.stop),
      spectrum: drawSpectrum(id("spectrum"), lines, eigen, what === "force" ? "reaction" : "velocity", highest),
      roots: drawRoots(id("roots"), view),
    };
    drawModes(id("modes"), view);
    drawMapNow();
    drawPadNow();
    for (const name of Object.keys(reads)) readOut(name);
  }

  function drawMapNow() {
    map.chart = drawMap(id("map"), map, settings.parameters);
    reads.map = map.chart.read;
    id("n_map").textContent = mapWords();
    readOut("map");
  }

  /** What a chart says under the pointer, or at the pad's own place. */
  function readOut(name) {
    const line = id(`${name}_line`), words = hover[name] && reads[name](...hover[name]);
    line.hidden = !words || name === "map";
    line.style.left = `${hover[name]?.[0]}px`;
    const done = name === "map" && map.next < MAP * MAP ? ` (map: ${Math.round((100 * map.next) / MAP ** 2)} % computed)` : "";
    id(`r_${name}`).textContent = (words || reads[name]() || "") + done;
  }

  function drawPadNow() {
    const t = share * view.motion.t;
    const { contact, values } = drawPad(id("pad"), view, t, view.enlarged);
    const shown = (t * view.body.units.time) / view.stop;
    id("instant").style.left = `${instantAt(id("histories").clientWidth, shown)}px`;
    if (!hover.histories) readOut("histories");
    const name = tables.contacts[settings.model][contact];
    const ms = (1000 * t * view.body.units.time).toFixed(3);
    id("now").textContent = `${ms} ms, state ${name} (${tables.meanings[settings.model][name]})`;
    id("now").dataset.reaction = values[2];
  }

  function numbers() {
    const { motion, body, at, points, ends, names, eigen } = view;
    const percent = Object.entries(view.shares).map(([name, s]) => `${name} ${(100 * s).toFixed(1)} %`);
    const between = ends.map(([low, high], i) => `${names[i]} ${number(low, 6)} to ${number(high, 6)}`);
    const end = motion.state.map((v, i) => v * body.factors[i]);
    const rows = {
      contacts: `${motion.changes.length}; ${percent.join(", ")}`,
      extrema: between.join("; "),
      final: `x ${(end[0] * 1e6).toFixed(4)} µm, y ${(end[1] * 1e6).toFixed(4)} µm, θ ${(end[2] * 1e3).toFixed(5)} mrad`,
      ended: motion.end ? `${motion.end} at ${(motion.t * body.units.time * 1e3).toFixed(4)} ms` : `no, all ${number(settings.stop * 1e3)} ms are shown`,
      sliding: sliding(),
      equilibrium: at
        ? `state ${tables.contacts[settings.model][edges(body, at.contact)]}, reaction ${linear.reaction(engine, body, at)[0].toFixed(1)} N`
        : points.length ? `none: the branch from µ = 0 ends at µ = ${points.at(-1).mu.toPrecision(5)}` : "none without friction",
      verdict: at ? VERDICTS[at.verdict] : "none",
      damping: damped(body),
      origin: aboutOrigin(),
      threshold: view.thresholds.map((t) => `${t.kind} from µ = ${t.mu.toFixed(6)} at ${t.hertz.toFixed(0)} Hz`).join("; ") || loss(),
    };
    id("origin_name").textContent = settings.model === "B2" ? "about the origin (model B3)" : "about the origin, full contact";
    conclude();
    for (const [key, value] of Object.entries(rows)) id(`n_${key}`).textContent = value;
    id("eigenvalues").innerHTML = eigen.map(({ re, im }) => {
      return `<tr><td>${(im / 2 / Math.PI).toFixed(2)}</td><td>${re.toFixed(2)}</td>` +
        `<td>${((-100 * re) / Math.hypot(re, im) || 0).toFixed(4)}</td></tr>`;
    }).join("");
    const matrix = (v) => [0, 3, 6].map((i) => v.slice(i, i + 3).map((e) => e.toExponential(4)).join("  ")).join("\n");
    id("matrices").textContent = at
      ? Object.entries(linear.matrices(engine, body, at)).map(([k, v]) => `${k} =\n${matrix(v)}`).join("\n")
      : "no equilibrium";
  }

  /** The verdict in a line, as `squeal eigenvalues` words it. */
  function verdict() {
    const { at, eigen, points } = view, here = `at µ = ${number(settings.parameters.mu)}`;
    if (!at) return points.length ? `No sliding equilibrium ${here}` : "No sliding equilibrium in contact without friction";
    if (at.verdict === STABLE) return `Stable ${here}`;
    if (at.verdict === MARGINAL) return `Marginal ${here}: no mode grows, not all decay`;
    const rounding = 1e-9 * Math.max(...eigen.map(({ re, im }) => Math.hypot(re, im)));
    const grow = eigen.filter(({ re }) => re > rounding).sort((p, q) => q.re - p.re), [{ re, im }] = grow;
    const size = im ? `${number(im / 2 / Math.PI)} Hz, damping ratio ${number((-100 * re) / Math.hypot(re, im), 2)} %` : `${number(re)} 1/s`;
    return `Unstable ${here}: ${grow.length === 1 ? "1 mode," : `${grow.length} modes, the fastest by`} ${im ? "flutter" : "divergence"} at ${size}`;
  }

  function loss() {
    const first = view.thresholds.find(({ kind }) => kind !== "restabilised"), last = view.points.at(-1)?.mu ?? 0;
    if (first) return `Stability is first lost at µ = ${number(first.mu)}: ${first.kind} at ${number(first.hertz)} Hz`;
    return `No mode grows up to µ = ${number(last)}${last < MU_MAX ? ", where the branch of equilibria ends" : ""}`;
  }

  /** The first lines of the page: verdict, threshold, motion, and what a reader must not overlook. */
  function conclude() {
    const { at, motion, body, names, ends } = view, ms = (t) => `${number(1000 * t * body.units.time)} ms`;
    const { length } = motion.changes, contact = length ? `${length} contact changes, the last at ${ms(motion.changes.at(-1).t)}` : "no contact change";
    id("verdict").dataset.kind = at ? { [STABLE]: "stable", [MARGINAL]: "marginal" }[at.verdict] ?? "unstable" : "none";
    id("conclusion").textContent = verdict();
    id("because").textContent = `${loss()}. Motion over ${ms(motion.t)}: ${contact}; ${names[0]} ${number(ends[0][0], 3)} to ${number(ends[0][1], 3)}.`;
    if (at?.verdict === STABLE && motion.changes.at(-1)?.t > 0.9 * motion.t) {
      id("because").textContent += " Sliding is stable, and this larger motion does not die out.";
    }
    const { V } = settings.parameters, warnings = [];
    if (motion.end) warnings.push(`Cut at ${ms(motion.t)} of ${number(1000 * settings.stop)} ms: ${motion.end}. Extremes, shares and spectrum are of this part alone.`);
    if (V <= view.fastest) warnings.push("The pad becomes as fast as the surface, beyond which the equations do not hold.");
    if (body.refusal) warnings.push(`Undamped: ${body.refusal}.`);
    id("warnings").textContent = warnings.join(" ");
  }

  function damped({ refusal }) {
    if (refusal) return `none: ${refusal}`;
    const percent = Number((100 * settings.damping).toPrecision(5));
    return percent ? `${percent} % of critical in each mode without friction` : "none";
  }

  /** The linearisation about the origin, which is model B3, in words. */
  function aboutOrigin() {
    const { body, at } = linear.aboutOrigin(engine, settings);
    if (body.refusal) return `none: ${body.refusal}`;
    const hertz = linear.modeShapes(at, body.units.time).map(({ im }) => (im / 2 / Math.PI).toFixed(1));
    return `${VERDICTS[at.verdict]}, ${hertz.join(", ")} Hz`;
  }

  function sliding() {
    const { V } = settings.parameters, speed = `pad at most ${number(view.fastest, 3)} m/s`;
    return V === undefined ? `${speed} along the surface` : `${view.fastest < V ? "yes" : "no"}: ${speed}, surface ${V} m/s`;
  }

  /** The words for those who do not see the pictures, and for the status line. */
  function describe() {
    const text = (name) => id(`n_${name}`).textContent;
    say(["conclusion", "because", "warnings"].map((name) => id(name).textContent).join(" "), true);
    const labels = {
      pad: `Pad with springs, forces and contact. Share of time: ${text("contacts")}`,
      histories: `Contact states and ${view.names.join(", ")} over time: ${text("extrema")}`,
      spectrum: `Spectrum with eigenfrequencies ${view.eigen.map((e) => (e.im / 2 / Math.PI).toFixed(0)).join(", ")} Hz`,
      roots: `Frequency and growth of the modes against friction: ${text("threshold")}`,
      modes: `Three mode shapes at ${view.eigen.map((e) => (e.im / 2 / Math.PI).toFixed(0)).join(", ")} Hz`,
      map: `Stability map over both spring angles; the pad's place: ${mapWords()}`,
    };
    for (const [name, label] of Object.entries(labels)) id(name).setAttribute("aria-label", label);
  }

  function mapWords() {
    const { alpha1, alpha2 } = settings.parameters;
    const code = linear.mapCode(engine, settings, alpha1, alpha2, map.origin);
    return `${VERDICTS[code]} at α₁ = ${(alpha1 / Math.PI).toFixed(3)} π, α₂ = ${(alpha2 / Math.PI).toFixed(3)} π`;
  }

  function workOnMap() {
    const until = performance.now() + SLICE, all = MAP * MAP;
    while (map.next < all && performance.now() < until) {
      const k = (map.next++ * 643) % all; // coarse all over first
      const angle = (i) => (Math.PI * (i + 0.5)) / MAP;
      map.codes[k] = linear.mapCode(engine, settings, angle(Math.floor(k / MAP)), angle(k % MAP), map.origin);
    }
    drawMapNow();
  }

  function frame(now) {
    requestAnimationFrame(frame);
    if (dirty) {
      dirty = false;
      recompute();
    } else {
      if (playing) {
        share = (share + (now - before) / 1000 / SWEEP) % 1;
        id("time").value = Math.round(1000 * share);
      }
      if (map.next < MAP * MAP) workOnMap();
      drawPadNow();
    }
    before = now;
  }

  const showPlaying = () => (id("play").textContent = playing ? "Pause" : "Play");
  id("play").addEventListener("click", () => {
    playing = !playing;
    showPlaying();
  });
  id("time").addEventListener("input", () => {
    playing = false;
    showPlaying();
    share = id("time").value / 1000;
    drawPadNow();
    id("time").setAttribute("aria-valuetext", id("now").textContent);
  });
  for (const name of ["model", "case"]) {
    for (const radio of document.getElementsByName(name)) {
      radio.addEventListener("change", () => {
        settings = fromCase(tables, name === "model" ? radio.value : settings.model, name === "case" ? radio.value : settings.case);
        showAll();
      });
    }
  }
  for (const key of CHOICES) {
    id(key).addEventListener("change", () => {
      settings.formulation[key] = tables.formulation[settings.model][key].find((v) => String(v) === id(key).value);
      touched();
    });
  }
  for (const name of ["origin", "heard"]) id(name).addEventListener("change", touched);
  id("map").addEventListener("click", ({ offsetX, offsetY }) => {
    const [a1, a2] = map.chart.place(offsetX, offsetY).map((a) => Math.round(a * 1000) / 1000);
    if (Math.min(a1, a2) < 0 || Math.max(a1, a2) > 1) return;
    Object.assign(settings.parameters, { alpha1: a1 * Math.PI, alpha2: a2 * Math.PI });
    showAll();
  });
  id("reset").addEventListener("click", () => {
    settings = fromCase(tables, settings.model, settings.case);
    showAll();
  });
  const copy = (text, done) => async () => {
    settle();
    try {
      await navigator.clipboard.writeText(text());
      say(done);
    } catch {
      id("scene").value = text();
      id("scene").closest("details").open = true;
      id("scene").select();
      say("The browser does not let the page copy; the text is selected, press Ctrl+C.");
    }
  };
  id("copy_link").addEventListener("click", copy(() => location.href, "Link copied."));
  id("copy_scene").addEventListener("click", copy(() => toScene(tables, settings), "Scene file copied; squeal simulate takes it."));

  let hearing = false;
  const stopped = () => {
    hearing = false;
    id("hear").textContent = "Hear";
  };
  id("hear").addEventListener("click", async () => {
    if (hearing) {
      silence();
      return void stopped();
    }
    hearing = true;
    id("hear").textContent = "Stop";
    const rest = async (done) => {
      say(`Computing the sound: ${Math.round(100 * done)} %`);
      await new Promise((go) => setTimeout(go));
      return hearing;
    };
    const options = { what: id("heard").value, seconds: 1, slow: Number(id("slow").value), rest };
    const samples = await render(engine, bodyOf(engine, settings), settings.initial, options);
    if (!samples) return;
    play(samples, stopped);
    say(`Playing ${(samples.length / 44100).toFixed(2)} s.`);
  });
  addEventListener("hashchange", () => {
    if (location.hash.slice(1) === toLink(settings)) return;
    settings = fromLink(tables, location.hash);
    showAll();
  });
  addEventListener("resize", touched);
  for (const name of ["histories", "spectrum", "roots", "map"]) {
    const at = ({ offsetX, offsetY, type }) => {
      if (type === "pointerleave") delete hover[name];
      else hover[name] = [offsetX, offsetY];
      if (view) readOut(name);
    };
    for (const type of ["pointermove", "pointerdown", "pointerleave"]) id(name).addEventListener(type, at);
  }
  for (const { title, point, link } of PRESETS) {
    const button = document.createElement("button");
    button.type = "button";
    button.innerHTML = `<b>${title}</b> <span>${point}</span>`;
    button.addEventListener("click", () => {
      settings = fromLink(tables, link);
      showAll();
    });
    id("presets").append(button);
  }
  const recolour = () => {
    readColours();
    if (view) draw();
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
  for (const [event, on] of [["beforeprint", true], ["afterprint", false]]) {
    addEventListener(event, () => {
      document.documentElement.classList.toggle("paper", on);
      recolour();
    });
  }
  /** For the console and for tests: what is shown, and the motion of other settings. */
  globalThis.squeal = {
    get view() { return view; },
    get map() { return map; },
    get settings() { return settings; },
    get settled() { return settled; },
    paint,
    read: (name, ...place) => reads[name](...place),
    motion(other) {
      const body = bodyOf(engine, other), motion = run(engine, body, other.initial, other.stop);
      return summary(body, motion);
    },
  };
  readColours();
  showPlaying();
  showAll();
  requestAnimationFrame(frame);
}

start().catch((error) => {
  id("status").textContent = `The page cannot run in this browser: ${error.message}`;
  throw error;
});
