// The page: settings in, motion and stability out, everything again at each change.

import { drawHistories, drawMap, drawModes, drawRoots, drawSpectrum, instantAt } from "./charts.js";
import { makeControls } from "./controls.js";
import { bodyOf } from "./damped.js";
import { edges, gapsAt, load, run, sample, signalsAt, summary } from "./engine.js";
import * as linear from "./linear.js";
import { drawPad, enlargement } from "./pad.js";
import { fromCase, fromLink, toLink, toScene } from "./settings.js";
import { play, render, silence } from "./sound.js";
import { spectrum } from "./spectrum.js";
import { VERDICTS } from "./undamped.js";

const SAMPLES = 1024, MOST_STEPS = 5000, MU_MAX = 2, MAP = 40;
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
  const say = (text) => (id("status").textContent = text);
  const show = makeControls(document, tables, () => settings, { changed: touched, refused: say });

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
    const natural = Float64Array.from({ length: SAMPLES }, (_, k) => (motion.t * k) / (SAMPLES - 1));
    const { states, contacts: touching } = sample(engine, motion, natural);
    const contacts = Uint8Array.from(touching, (contact) => edges(body, contact));
    const { length, time, mass } = body.units, newton = (mass * length) / time ** 2;
    const signals = [0, 1].map(() => new Float64Array(SAMPLES)), force = new Float64Array(SAMPLES);
    const units = settings.model === "B1" ? [body.pad.F_n, body.pad.F_n] : [body.pad.F_n, body.pad.w];
    const si = settings.model === "B1" ? [newton, newton] : [newton, length];
    const gaps = [];
    for (let k = 0; k < SAMPLES; k++) {
      const state = states.subarray(6 * k, 6 * k + 6);
      const values = signalsAt(engine, body, state, touching[k]);
      for (const i of [0, 1]) signals[i][k] = (values[i] * si[i]) / units[i];
      force[k] = values[2] * newton;
      if (k % 8 === 0) gaps.push(...gapsAt(engine, body, state).slice(0, body.points));
    }
    const seconds = natural.map((t) => t * time);
    const displacements = [0, 1, 2].map((i) => {
      return Float64Array.from({ length: SAMPLES }, (_, k) => states[6 * k + i] * length * 1e6);
    });
    const points = linear.branch(engine, body, MU_MAX);
    const at = linear.onBranch(engine, body, points, body.pad.mu);
    const eigen = at ? linear.modeShapes(at, time) : [];
    const names = tables.signals[body.law].map((n, i) => `${n} / ${units[i] === body.pad.F_n ? "Fn" : "w"}`);
    view = {
      engine, body, settings, motion, states, contacts, signals, force, gaps, seconds, displacements,
      names, points, at, eigen, thresholds: linear.thresholds(engine, body, points),
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
    if (map?.of === of) map.place = null;
    else map = { of, n: MAP, codes: new Int8Array(MAP * MAP).fill(-1), next: 0, origin, place: null };
  }

  function draw() {
    drawHistories(id("histories"), view);
    const { signal, name } = id("heard").value === "force"
      ? { signal: view.force, name: "reaction" }
      : { signal: Float64Array.from({ length: SAMPLES }, (_, k) => view.states[6 * k + 3]), name: "velocity" };
    drawSpectrum(id("spectrum"), spectrum(signal, view.seconds[1]), view.eigen, name);
    drawRoots(id("roots"), view);
    drawModes(id("modes"), view);
    drawPadNow();
  }

  function drawPadNow() {
    const t = share * view.motion.t;
    const { contact, values } = drawPad(id("pad"), view, t, view.enlarged);
    id("instant").style.left = `${instantAt(id("histories").clientWidth, share)}px`;
    const name = tables.contacts[settings.model][contact];
    const ms = (1000 * t * view.body.units.time).toFixed(3);
    id("now").textContent = `${ms} ms, state ${name} (${tables.meanings[settings.model][name]})`;
    id("now").dataset.reaction = values[2];
  }

  function numbers() {
    const { motion, body, contacts, at, thresholds, points, signals, names, eigen } = view;
    const counts = { 0: 0, 1: 0, 2: 0, 3: 0 };
    for (const contact of contacts) counts[contact]++;
    const shares = {};
    for (const [bits, name] of Object.entries(tables.contacts[settings.model])) {
      shares[name] = (shares[name] ?? 0) + counts[bits] / SAMPLES;
    }
    const percent = Object.entries(shares).map(([name, s]) => `${name} ${(100 * s).toFixed(1)} %`);
    const extreme = (values, pick) => Array.from(values).filter(Number.isFinite).reduce((a, b) => pick(a, b), NaN);
    const least = (a, b) => (a < b ? a : b), most = (a, b) => (a > b ? a : b);
    const between = signals.map((v, i) => `${names[i]} ${extreme(v, least).toFixed(3)} to ${extreme(v, most).toFixed(3)}`);
    const speed = extreme(displacementRate(), most), end = motion.state.map((v, i) => v * body.factors[i]);
    const rows = {
      contacts: `${motion.changes.length}; ${percent.join(", ")}`,
      extrema: between.join("; "),
      final: `x ${(end[0] * 1e6).toFixed(4)} µm, y ${(end[1] * 1e6).toFixed(4)} µm, θ ${(end[2] * 1e3).toFixed(5)} mrad`,
      ended: motion.end ? `${motion.end} at ${(motion.t * body.units.time * 1e3).toFixed(4)} ms` : `no, all ${(settings.stop * 1e3).toPrecision(4)} ms are shown`,
      sliding: sliding(speed),
      equilibrium: at
        ? `state ${tables.contacts[settings.model][edges(body, at.contact)]}, reaction ${linear.reaction(engine, body, at)[0].toFixed(1)} N`
        : points.length ? `none: the branch from µ = 0 ends at µ = ${points.at(-1).mu.toPrecision(5)}` : "none without friction",
      verdict: at ? VERDICTS[at.verdict] : "none",
      damping: damped(body),
      origin: aboutOrigin(),
      threshold: thresholds.length
        ? thresholds.map((t) => `${t.kind} from µ = ${t.mu.toFixed(6)} at ${t.hertz.toFixed(0)} Hz`).join("; ")
        : `none up to µ = ${(points.at(-1)?.mu ?? 0).toPrecision(4)}${points.at(-1)?.mu < MU_MAX ? ", where the branch ends" : ""}`,
    };
    for (const [key, value] of Object.entries(rows)) id(`n_${key}`).textContent = value;
    id("eigenvalues").innerHTML = eigen.map(({ re, im }) => {
      return `<tr><td>${(im / 2 / Math.PI).toFixed(2)}</td><td>${re.toFixed(2)}</td>` +
        `<td>${(-re / Math.hypot(re, im) || 0).toFixed(6)}</td></tr>`;
    }).join("");
    const matrix = (v) => [0, 3, 6].map((i) => v.slice(i, i + 3).map((e) => e.toExponential(4)).join("  ")).join("\n");
    id("matrices").textContent = at
      ? Object.entries(linear.matrices(engine, body, at)).map(([k, v]) => `${k} =\n${matrix(v)}`).join("\n")
      : "no equilibrium";
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

  function* displacementRate() {
    for (let k = 0; k < SAMPLES; k++) yield view.states[6 * k + 3] * view.body.factors[3];
  }

  function sliding(speed) {
    const { V } = settings.parameters;
    if (V === undefined) return `pad at most ${speed.toFixed(2)} m/s along the surface`;
    return `${speed < V ? "yes" : "no"}: pad at most ${speed.toFixed(2)} m/s, surface ${V} m/s`;
  }

  /** The words for those who do not see the pictures, and for the status line. */
  function describe() {
    const { motion, at, thresholds } = view, text = (name) => id(`n_${name}`).textContent;
    const first = thresholds[0] ? `${thresholds[0].kind} from µ = ${thresholds[0].mu.toFixed(3)}` : "no threshold";
    say(`Model ${settings.model}: ${motion.changes.length} contact changes; ${at ? VERDICTS[at.verdict] : "no equilibrium"}; ${first}.${view.body.refusal ? ` Undamped: ${view.body.refusal}.` : ""}`);
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
    map.place = drawMap(id("map"), map, settings.parameters);
    id("n_map").textContent = mapWords();
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
      if (map.next < MAP * MAP || !map.place) workOnMap();
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
    const [a1, a2] = map.place(offsetX, offsetY).map((a) => Math.round(a * 1000) / 1000);
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
  /** For the console and for tests: what is shown, and the motion of other settings. */
  globalThis.squeal = {
    get view() { return view; },
    get map() { return map; },
    get settings() { return settings; },
    get settled() { return settled; },
    motion(other) {
      const body = bodyOf(engine, other), motion = run(engine, body, other.initial, other.stop);
      return summary(body, motion);
    },
  };
  showPlaying();
  showAll();
  requestAnimationFrame(frame);
}

start().catch((error) => {
  id("status").textContent = `The page cannot run in this browser: ${error.message}`;
  throw error;
});
