// Axes, lines and ticks on a canvas that follows its width and the screen's resolution.

const CONTACTS = { 3: "both", 0: "separated", 1: "leading", 2: "trailing" };

/** Colours of the style sheet, light or dark, by name, and those of the contact states. */
export const paint = { contacts: {} };

export function readColours() {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(`--${name}`).trim();
  for (const name of ["ink", "soft", "grid", "line", "panel", "ground", "pad", "grows", "accent"]) paint[name] = value(name);
  paint.verdicts = ["marginal", "flutter", "divergence", "beyond", "stable", "unknown"].map(value);
  for (const [contact, name] of Object.entries(CONTACTS)) paint.contacts[contact] = value(name);
}

/** Line styles of the contact states: the second cue beside the colour. */
export const DASHES = { 3: [], 0: [1.5, 2.5], 1: [7, 2], 2: [7, 2, 1.5, 2] };
const FONT = "12px system-ui, sans-serif";

/** Context of a canvas, cleared, in CSS pixels; width and height as laid out. */
export function sheet(canvas) {
  const ratio = globalThis.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = FONT;
  g.lineWidth = 1;
  g.strokeStyle = g.fillStyle = paint.ink;
  return { g, width, height };
}

/** Round numbers within [low, high], about `count` of them. */
export function ticks(low, high, count) {
  const raw = (high - low) / count;
  if (!(raw > 0) || !Number.isFinite(raw)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= raw * 0.999);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** [low, high] of numbers, widened a little; non-finite ones are left out. */
export function range(values, ...more) {
  let low = Infinity, high = -Infinity;
  for (const list of [values, more]) {
    for (const v of list) {
      if (!Number.isFinite(v)) continue;
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  if (!(low <= high)) return [-1, 1];
  const margin = 0.06 * (high - low) || Math.abs(high) * 0.1 || 1;
  return [low - margin, high + margin];
}

/** A frame with ticks and labels; gives functions from values to pixels. */
export function axes({ g }, box, { x, y, xLabel, yLabel, xTicks = true }) {
  const { left, top, width, height } = box;
  const px = (v) => left + ((v - x[0]) / (x[1] - x[0])) * width;
  const py = (v) => top + height - ((v - y[0]) / (y[1] - y[0])) * height;
  g.save();
  g.strokeStyle = paint.grid;
  g.fillStyle = paint.ink;
  g.textBaseline = "middle";
  g.textAlign = "right";
  g.beginPath();
  for (const v of ticks(...y, Math.max(2, height / 36))) {
    g.moveTo(left, py(v));
    g.lineTo(left + width, py(v));
    g.fillText(String(v), left - 5, py(v));
  }
  g.textAlign = "center";
  g.textBaseline = "top";
  for (const v of ticks(...x, Math.max(2, width / 80))) {
    g.moveTo(px(v), top);
    g.lineTo(px(v), top + height);
    if (xTicks) g.fillText(String(v), px(v), top + height + 5);
  }
  g.stroke();
  g.strokeStyle = paint.soft;
  g.strokeRect(left, top, width, height);
  if (xLabel) g.fillText(xLabel, left + width / 2, top + height + 20);
  if (yLabel) {
    g.translate(12, top + height / 2);
    g.rotate(-Math.PI / 2);
    g.textBaseline = "middle";
    g.fillText(yLabel, 0, 0);
  }
  g.restore();
  return { px, py };
}

/** A polyline through (x, y), broken where y is not finite, clipped to the box. */
export function line({ g }, box, { px, py }, xs, ys, { colour = paint.ink, dash = [], wide = 1.4 } = {}) {
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.width, box.height);
  g.clip();
  g.strokeStyle = colour;
  g.lineWidth = wide;
  g.setLineDash(dash);
  g.beginPath();
  let pen = false;
  for (let i = 0; i < xs.length; i++) {
    if (!Number.isFinite(ys[i])) pen = false;
    else {
      if (pen) g.lineTo(px(xs[i]), py(ys[i]));
      else g.moveTo(px(xs[i]), py(ys[i]));
      pen = true;
    }
  }
  g.stroke();
  g.restore();
}

/** Stretches [from, to) of equal contact state. */
export function stretches(contacts) {
  const found = [];
  for (let i = 0, from = 0; i < contacts.length; i++) {
    if (i + 1 === contacts.length || contacts[i + 1] !== contacts[i]) {
      found.push({ contact: contacts[i], from, to: i + 1 });
      from = i + 1;
    }
  }
  return found;
}
