// Sliders with number fields: what each setting is called here, its unit and its range.

import { admits } from "./settings.js";

const angle = (label) => ({ label, unit: "π", factor: Math.PI, low: 0, high: 1 });
const around = (label, unit, factor = 1) => ({ label, unit, factor, log: true });
const between = (label, unit, factor, high, low = -high) => ({ label, unit, factor, low, high });

const GROUPS = {
  load: {
    alpha1: angle("α₁"), alpha2: angle("α₂"), mu: between("µ", "", 1, 1.5, 0), F_n: around("Fₙ", "N"),
    damping: between("ζ", "%", 0.01, 10, 0),
  },
  stiffness: Object.fromEntries(
    ["k1", "k2", "k3", "k4", "k_c"].map((k) => [k, around(k.replace("_", ""), "MN/m", 1e6)]),
  ),
  start: {
    start_1: between("y", "µm", 1e-6, 100), start_0: between("x", "µm", 1e-6, 100),
    start_2: between("θ", "mrad", 1e-3, 3), y0: between("y₀", "µm", 1e-6, 200),
    start_4: between("ẏ", "m/s", 1, 2), start_3: between("ẋ", "m/s", 1, 2),
    start_5: between("θ̇", "rad/s", 1, 50),
  },
  more: {
    m: around("m", "kg"), w: around("w", "mm", 1e-3), h: around("h", "mm", 1e-3),
    I: around("I", "kg mm²", 1e-6), L1: around("L₁", "mm", 1e-3), L2: around("L₂", "mm", 1e-3),
    V: around("V", "m/s"), theta0: between("θ₀", "mrad", 1e-3, 20), x0: between("x₀", "µm", 1e-6, 200),
    stop: { ...around("T", "ms", 1e-3), meaning: "length of time shown", most: 0.1 },
  },
};
const STARTS = ["position along the surface", "height", "angle"];
const STEPS = 1000; // of a slider
const SPAN = 20; // a slider reaches from 1/20 of the case's value to 20 times it

const OWN = ["stop", "damping"]; // settings that are no parameters

const start = (name) => (name.startsWith("start_") ? Number(name.at(-1)) : -1);

export const read = (settings, name) => {
  if (OWN.includes(name)) return settings[name];
  return start(name) < 0 ? settings.parameters[name] : settings.initial[start(name)];
};

function write(settings, name, value) {
  if (OWN.includes(name)) settings[name] = value;
  else if (start(name) < 0) settings.parameters[name] = value;
  else settings.initial[start(name)] = value;
}

const text = (value) => String(Number(value.toPrecision(7)));

function meaning(tables, name, { meaning: own }) {
  const i = start(name);
  if (own) return own;
  if (i < 0) return (tables.parameters[name] ?? tables[name]).meaning;
  return i < 3 ? `start: ${STARTS[i]}` : `start: rate of the ${STARTS[i - 3]}`;
}

/**
 * Put the sliders of all groups in their fieldsets. `changed(name)` follows a change, `refused`
 * gets a sentence. Gives a function that shows the settings of a model.
 */
export function makeControls(document, tables, settings, { changed, refused }) {
  const rows = [];
  for (const [group, entries] of Object.entries(GROUPS)) {
    for (const [name, spec] of Object.entries(entries)) rows.push(row(group, name, spec));
  }
  return function show(home) {
    for (const { update } of rows) update(home);
  };

  function row(group, name, spec) {
    const line = document.createElement("div");
    line.className = "row";
    const what = meaning(tables, name, spec), unit = spec.unit && ` in ${spec.unit}`;
    line.innerHTML =
      `<label for="${name}" title="${what}">${spec.label}</label>` +
      `<input type="range" id="${name}" aria-label="${spec.label}, ${what}" min="0" max="${STEPS}" step="1">` +
      `<input type="number" id="${name}_number" aria-label="${spec.label}, ${what}${unit}" step="any">` +
      `<span class="unit">${spec.unit}</span>`;
    document.getElementById(group).append(line);
    const [slider, field] = line.querySelectorAll("input");
    const limits = tables.parameters[name] ?? (name === "damping" ? tables.damping : null) ?? {
      low: spec.log ? 0 : -Infinity, high: spec.most ?? Infinity, lowAllowed: false,
      allowed: spec.most ? `above 0 and below ${spec.most / spec.factor} ${spec.unit}` : "a finite number",
    };
    let bottom = spec.low, top = spec.high;
    const toShare = (v) => (spec.log ? Math.log(v / bottom) / Math.log(top / bottom) : (v - bottom) / (top - bottom));
    const fromShare = (s) => (spec.log ? bottom * (top / bottom) ** s : bottom + (top - bottom) * s);
    const set = (value) => {
      write(settings(), name, value);
      changed(name);
    };
    slider.addEventListener("input", () => {
      const shown = Number(fromShare(slider.value / STEPS).toPrecision(5));
      set(shown * spec.factor);
      field.value = text(shown);
      slider.setAttribute("aria-valuetext", `${text(shown)} ${spec.unit}`);
      field.removeAttribute("aria-invalid");
    });
    field.addEventListener("change", () => {
      const value = field.value.trim() ? Number(field.value) * spec.factor : NaN;
      if (!admits(limits, value)) {
        field.setAttribute("aria-invalid", "true");
        refused(`${spec.label}: ${field.value || "nothing"} is not allowed; it must be ${limits.allowed} (SI units)`);
        return;
      }
      field.removeAttribute("aria-invalid");
      set(value);
      slider.value = Math.round(STEPS * toShare(value / spec.factor));
    });
    return {
      update(home) {
        const value = read(settings(), name), models = limits.models;
        line.hidden = value === undefined || (models && !models.includes(settings().model));
        if (line.hidden) return;
        if (spec.log) {
          const centre = read(home, name) / spec.factor;
          [bottom, top] = [centre / SPAN, centre * SPAN];
        }
        field.value = text(value / spec.factor);
        field.removeAttribute("aria-invalid");
        slider.value = Math.round(STEPS * toShare(value / spec.factor));
        slider.setAttribute("aria-valuetext", `${text(value / spec.factor)} ${spec.unit}`);
      },
    };
  }
}
