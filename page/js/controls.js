// Sliders with number fields: what each setting is called here, its unit and its range.

import { admits } from "./settings.js";

const angle = (label, name) => ({ label, name, unit: "π", factor: Math.PI, low: 0, high: 1 });
const around = (label, name, unit, factor = 1) => ({ label, name, unit, factor, log: true });
const between = (label, name, unit, factor, high, low = -high) => ({ label, name, unit, factor, low, high });
const spring = (label, name) => around(label, name, "MN/m", 1e6);

const GROUPS = {
  load: {
    mu: between("µ", "friction", "", 1, 1.5, 0),
    damping: between("ζ", "damping ratio, all modes", "%", 0.01, 10, 0),
    F_n: around("Fₙ", "pressing force", "N"),
    alpha1: angle("α₁", "angle of spring 1"), alpha2: angle("α₂", "angle of spring 2"),
    stop: { ...around("T", "time shown", "ms", 1e-3), most: 0.1 },
  },
  stiffness: {
    k1: spring("k₁", "spring at the leading side"), k2: spring("k₂", "spring at the trailing side"),
    k3: spring("k₃", "contact, leading edge"), k4: spring("k₄", "contact, trailing edge"),
    k_c: spring("k꜀", "contact of the whole face"),
  },
  start: {
    start_1: between("y", "height", "µm", 1e-6, 100), start_0: between("x", "position along the surface", "µm", 1e-6, 100),
    start_2: between("θ", "angle", "mrad", 1e-3, 3), y0: between("y₀", "height without load", "µm", 1e-6, 200),
    start_4: between("ẏ", "speed off the surface", "m/s", 1, 2), start_3: between("ẋ", "speed along the surface", "m/s", 1, 2),
    start_5: between("θ̇", "rate of turning", "rad/s", 1, 50),
  },
  more: {
    m: around("m", "mass", "kg"), w: around("w", "half length", "mm", 1e-3), h: around("h", "half height", "mm", 1e-3),
    I: around("I", "moment of inertia", "kg mm²", 1e-6),
    L1: around("L₁", "free length of spring 1", "mm", 1e-3), L2: around("L₂", "free length of spring 2", "mm", 1e-3),
    V: around("V", "speed of the surface", "m/s"), theta0: between("θ₀", "angle without load", "mrad", 1e-3, 20),
    x0: between("x₀", "position without load", "µm", 1e-6, 200),
  },
};
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

/** What a number may be, in the unit that is shown. */
function allowed({ low, high, lowAllowed }, { factor, unit }) {
  const shown = (value) => `${text(value / factor)} ${unit}`.trim();
  const ends = [];
  if (low > -1e300) ends.push(`${lowAllowed ? "at least" : "above"} ${shown(low)}`);
  if (high < 1e300) ends.push(`below ${shown(high)}`);
  return ["a number", ends.join(" and ")].join(" ").trim();
}

/**
 * Put the sliders of all groups in their fieldsets. `changed(name)` follows a change. Gives
 * a function that shows the settings of a model.
 */
export function makeControls(document, tables, settings, changed) {
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
    line.innerHTML =
      `<label id="${name}_label" for="${name}" title="${tables.parameters[name]?.meaning ?? ""}"><b>${spec.label}</b> ${spec.name}</label>` +
      `<input type="number" id="${name}_number" aria-labelledby="${name}_label ${name}_unit" aria-describedby="${name}_refusal" step="any">` +
      `<span class="unit" id="${name}_unit">${spec.unit}</span>` +
      `<input type="range" id="${name}" min="0" max="${STEPS}" step="1">` +
      `<span class="refusal" id="${name}_refusal" role="alert"></span>`;
    document.getElementById(group).append(line);
    const [field, slider] = line.querySelectorAll("input"), refusal = line.lastChild;
    const refuse = (words) => {
      refusal.textContent = words;
      if (words) field.setAttribute("aria-invalid", "true");
      else field.removeAttribute("aria-invalid");
    };
    const limits = tables.parameters[name] ?? (name === "damping" ? tables.damping : null) ?? {
      low: spec.log ? 0 : -Infinity, high: spec.most ?? Infinity, lowAllowed: false,
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
      refuse("");
    });
    field.addEventListener("change", () => {
      const value = field.value.trim() ? Number(field.value) * spec.factor : NaN;
      if (!admits(limits, value)) {
        refuse(`${spec.label} = ${field.value || "nothing"} is not allowed: ${allowed(limits, spec)}`);
        return;
      }
      refuse("");
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
        refuse("");
        slider.value = Math.round(STEPS * toShare(value / spec.factor));
        slider.setAttribute("aria-valuetext", `${text(value / spec.factor)} ${spec.unit}`);
      },
    };
  }
}
