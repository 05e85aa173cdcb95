// Histories, spectrum, roots against friction, mode shapes and the stability map. Each drawing gives
// `read(x, y)`: what the chart says there in words, or, without a place, at the pad's own.

import { eigenvalues, modeShapes } from "./linear.js";
import { DASHES, axes, line, paint, range, sheet, stretches } from "./plot.js";
import { FLOOR } from "./spectrum.js";
import { VERDICTS } from "./undamped.js";

const LEFT = 72, RIGHT = 12;
const ROWS = [3, 1, 2, 0]; // rows of the state strip: full, leading, trailing, separated
const EDGES = { 3: "both edges", 1: "leading", 2: "trailing", 0: "separated" };

/** A number with so many digits, a real minus sign and no empty zeros. */
export const number = (value, digits = 4) =>
  Number.isFinite(value) ? String(Number(value.toPrecision(digits))).replace("-", "−") : "–";

/** Index of the entry of a rising list that is nearest to a value. */
function nearest(list, value) {
  let low = 0, high = list.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle;
    else high = middle;
  }
  return Math.abs(list[low] - value) <= Math.abs(list[high] - value) ? low : high;
}

/** Strip of contact states, both signals in the states' colours, and the displacement. */
export function drawHistories(canvas, view, instant) {
  const page = sheet(canvas), { g, width, height } = page;
  const { milliseconds: ms, contacts, signals, names, displacements, stop } = view;
  const x = [0, 1000 * stop], inner = width - LEFT - RIGHT;
  const strip = { left: LEFT, top: 6, width: inner, height: 56 };
  g.textAlign = "right";
  g.textBaseline = "middle";
  const px = (t) => LEFT + (t / x[1]) * inner;
  ROWS.forEach((state, row) => {
    g.fillStyle = paint.ink;
    g.fillText(EDGES[state], LEFT - 5, strip.top + 14 * row + 7);
    g.fillStyle = paint.ground;
    g.fillRect(LEFT, strip.top + 14 * row + 1, inner, 12);
  });
  const parts = stretches(contacts);
  for (const { contact, from, to } of parts) {
    g.fillStyle = paint.contacts[contact];
    const row = ROWS.indexOf(contact);
    g.fillRect(px(ms[from]), strip.top + 14 * row + 1, Math.max(1, px(ms[to - 1]) - px(ms[from])), 12);
  }
  const each = (height - 76 - 40) / 3 - 10;
  const boxes = [0, 1, 2].map((i) => {
    return { left: LEFT, top: 76 + i * (each + 10), width: inner, height: each };
  });
  signals.forEach((values, i) => {
    const y = range(values, 0), scale = axes(page, boxes[i], { x, y, yLabel: names[i], xTicks: false });
    for (const { contact, from, to } of parts) {
      const style = { colour: paint.contacts[contact], dash: DASHES[contact] };
      line(page, boxes[i], scale, ms.subarray(from, to), values.subarray(from, to), style);
    }
  });
  const y = range(displacements.flatMap((d) => Array.from(range(d))), 0);
  const scale = axes(page, boxes[2], { x, y, yLabel: "x, y, wθ in µm", xLabel: "time in ms" });
  [["x", []], ["y", [6, 3]], ["wθ", [2, 2]]].forEach(([name, dash], i) => {
    line(page, boxes[2], scale, ms, displacements[i], { dash });
    g.fillStyle = paint.ink;
    g.textAlign = "left";
    g.fillText(name, LEFT + 30 + 60 * i, boxes[2].top + 10);
    line(page, boxes[2], { px: (v) => v, py: (v) => v },
      [LEFT + 6 + 60 * i, LEFT + 26 + 60 * i], [boxes[2].top + 10, boxes[2].top + 10], { dash });
  });
  if (view.motion.end) notComputed(page, px(ms.at(-1)), 6, LEFT + inner, boxes[2].top + each);
  return (left = instantAt(width, instant())) => {
    const t = ((left - LEFT) / inner) * x[1];
    if (!(t >= 0 && t <= x[1])) return null;
    if (t > ms.at(-1)) return `${number(t)} ms: not computed`;
    const k = nearest(ms, t), [dx, dy, turn] = displacements.map((d) => number(d[k], 3));
    const values = names.map((name, i) => `${name} ${number(signals[i][k], 3)}`);
    return `${number(ms[k])} ms, ${EDGES[contacts[k]]}: ${values.join(", ")}, x ${dx} µm, y ${dy} µm, wθ ${turn} µm`;
  };
}

/** Hatch the time that the motion does not reach, so that nobody takes it for a quiet pad. */
function notComputed({ g }, left, top, right, bottom) {
  g.save();
  g.beginPath();
  g.rect(left, top, right - left, bottom - top);
  g.clip();
  g.fillStyle = paint.panel;
  g.fillRect(left, top, right - left, bottom - top);
  g.strokeStyle = paint.grows;
  g.beginPath();
  for (let x = left - (bottom - top); x < right; x += 14) {
    g.moveTo(x, bottom);
    g.lineTo(x + bottom - top, top);
  }
  g.stroke();
  g.fillStyle = paint.panel;
  g.fillRect((left + right) / 2 - 52, (top + bottom) / 2 - 12, 104, 24);
  g.restore();
  g.fillStyle = paint.grows;
  g.textAlign = "center";
  g.textBaseline = "middle";
  g.fillText("not computed", (left + right) / 2, (top + bottom) / 2);
}

/** Where the histories' instant lies, for the moving line over them. */
export const instantAt = (width, share) => LEFT + share * (width - LEFT - RIGHT);

/** Levels over frequency, with the eigenfrequencies. */
export function drawSpectrum(canvas, { hertz, decibels }, eigen, name, highest) {
  const page = sheet(canvas), { width, height } = page;
  const box = { left: LEFT, top: 10, width: width - LEFT - RIGHT, height: height - 54 };
  const x = [0, highest / 1000], y = [FLOOR, 5];
  const labels = { x, y, xLabel: "frequency in kHz", yLabel: `${name}, dB` };
  const scale = axes(page, box, labels);
  line(page, box, scale, hertz.map((f) => f / 1000), decibels);
  for (const { im } of eigen) {
    const f = im / 2000 / Math.PI;
    line(page, box, scale, [f, f], y, { colour: paint.grows, dash: [4, 3] });
  }
  return (left) => {
    if (left === undefined) return `highest line at ${number(hertz[decibels.indexOf(0)])} Hz`;
    const k = nearest(hertz, ((left - LEFT) / box.width) * highest);
    return `${number(hertz[k])} Hz: ${number(decibels[k], 3)} dB below the highest line`.replace("−", "");
  };
}

/** Frequency and growth of the modes along the branch, with the pad's mu and the thresholds. */
export function drawRoots(canvas, { body, at, points, thresholds }) {
  const page = sheet(canvas), { g, width, height } = page;
  const each = (height - 62) / 2;
  const top = { left: LEFT, top: 8, width: width - LEFT - RIGHT, height: each };
  const low = { ...top, top: 18 + each };
  const mus = points.map((p) => p.mu), x = [0, Math.max(body.pad.mu * 1.1, mus.at(-1) ?? 1)];
  const all = points.map((p) => eigenvalues(p, body.units.time));
  const sorted = all.map((roots) => roots.filter((r) => r.im >= 0));
  const hertz = sorted.flatMap((roots) => roots.map((r) => r.im / 2000 / Math.PI));
  const growth = all.flatMap((roots) => roots.map((r) => r.re / 1000));
  const a = axes(page, top, { x, y: range(hertz, 0), yLabel: "frequency, kHz", xTicks: false });
  const b = axes(page, low, { x, y: range(growth, 1, -1), yLabel: "growth, 1/ms", xLabel: "coefficient of friction µ" });
  const dot = (box, { px, py }, mu, value, grows) => {
    g.fillStyle = grows ? paint.grows : paint.ink;
    const size = grows ? 2.4 : 1.3;
    g.fillRect(px(mu) - size, py(value) - size, 2 * size, 2 * size);
  };
  points.forEach((p, i) => {
    for (const r of sorted[i]) dot(top, a, p.mu, r.im / 2000 / Math.PI, r.re > 0);
    for (const r of all[i]) dot(low, b, p.mu, r.re / 1000, r.re > 0);
  });
  const vertical = (mu, dash, colour) => {
    for (const [box, s] of [[top, a], [low, b]]) {
      line(page, box, { px: s.px, py: (v) => v }, [mu, mu], [box.top, box.top + box.height], { dash, colour });
    }
  };
  vertical(body.pad.mu, [], paint.accent);
  for (const t of thresholds) vertical(t.mu, [5, 3], paint.grows);
  return (left) => {
    const mu = left === undefined ? body.pad.mu : ((left - LEFT) / top.width) * x[1];
    const there = left === undefined ? at : mu <= mus.at(-1) + 0.01 * x[1] && points[nearest(mus, mu)];
    if (!there) return `µ = ${number(mu, 3)}: no equilibrium on the branch`;
    const words = modeShapes(there, body.units.time).map(({ re, im }) => {
      return `${number(im / 2 / Math.PI)} Hz (${number(re, 3)} 1/s)`;
    });
    return `µ = ${number(there.mu, 3)}: frequency (growth) ${words.join(", ")}`;
  };
}

/** The three mode shapes: the pad at rest and at both ends of a period's swing, and its centre. */
export function drawModes(canvas, { body, at }) {
  const page = sheet(canvas), { g, width, height } = page;
  if (!at) return;
  const { w, h } = body.pad, each = width / 3, scale = each / (3.6 * w);
  const corners = [[-w, h], [w, h], [w, -h], [-w, -h]];
  modeShapes(at, body.units.time).forEach((mode, k) => {
    const [cx, cy] = [each * (k + 0.5), (height - 40) / 2 + 8];
    const displaced = (phase) => mode.shape.map(({ re, im }) => {
      return 0.35 * w * (re * Math.cos(phase) - im * Math.sin(phase));
    });
    const outline = (phase, dash, colour) => {
      const [x, y, s] = phase === null ? [0, 0, 0] : displaced(phase);
      g.setLineDash(dash);
      g.strokeStyle = colour;
      g.beginPath();
      for (const [rx, ry] of corners) {
        g.lineTo(cx + (rx + x - (s / w) * ry) * scale, cy - (ry + y + (s / w) * rx) * scale);
      }
      g.closePath();
      g.stroke();
    };
    g.lineWidth = 1;
    outline(null, [2, 3], paint.soft);
    g.lineWidth = 1.6;
    outline(0, [], paint.accent);
    outline(Math.PI, [6, 3], paint.grows);
    g.setLineDash([]);
    g.fillStyle = paint.ink;
    g.textAlign = "center";
    g.fillText(`${number(mode.im / 2 / Math.PI)} Hz`, cx, height - 26);
    g.fillText(mode.re > 0 ? `grows, ${number(mode.re, 3)} 1/s` : `${number(mode.re, 3)} 1/s`, cx, height - 9);
  });
}

// heights at the left and right of a cell: flutter rises, divergence falls, the rest is level
const HATCHES = [null, [1, 0], [0, 1], [0.5, 0.5], null];

/** Verdicts over both angles (rows of codes, -1 where not yet computed), and the place of the pad. */
export function drawMap(canvas, { codes, n }, parameters) {
  const page = sheet(canvas), { g, width, height } = page;
  const side = Math.min(width - LEFT - RIGHT, height - 52);
  const box = { left: LEFT, top: 8, width: side, height: side }, cell = side / n;
  g.lineWidth = 0.7;
  for (let k = 0; k < n * n; k++) {
    const x = box.left + Math.floor(k / n) * cell, y = box.top + side - ((k % n) + 1) * cell;
    g.fillStyle = paint.verdicts.at(codes[k]);
    g.fillRect(x, y, cell + 0.6, cell + 0.6);
    g.fillStyle = g.strokeStyle = paint.soft;
    if (codes[k] < 0) g.fillRect(x + cell / 2 - 1, y + cell / 2 - 1, 2, 2);
    if (!HATCHES[codes[k]]) continue;
    g.beginPath();
    const [from, to] = HATCHES[codes[k]].map((share) => share * cell);
    g.moveTo(x, y + from);
    g.lineTo(x + cell, y + to);
    g.stroke();
  }
  const label = { xLabel: "angle of spring 1, α₁ / π", yLabel: "angle of spring 2, α₂ / π" };
  const { px, py } = axes(page, box, { x: [0, 1], y: [0, 1], ...label });
  const own = [parameters.alpha1 / Math.PI, parameters.alpha2 / Math.PI], [x, y] = [px(own[0]), py(own[1])];
  for (const [colour, wide] of [[paint.panel, 6], [paint.grows, 2.5]]) {
    g.strokeStyle = colour;
    g.lineWidth = wide;
    g.beginPath();
    g.moveTo(x - 9, y);
    g.lineTo(x + 9, y);
    g.moveTo(x, y - 9);
    g.lineTo(x, y + 9);
    g.stroke();
  }
  const place = (left, top) => [(left - box.left) / side, 1 - (top - box.top) / side];
  return {
    place,
    read(left, top) {
      const at = left === undefined ? own : place(left, top);
      if (Math.min(...at) < 0 || Math.max(...at) > 1) return null;
      const [i, j] = at.map((a) => Math.min(n - 1, Math.floor(a * n))), code = codes[i * n + j];
      const verdict = code < 0 ? "not yet computed" : VERDICTS[code];
      return `α₁ = ${number(at[0], 3)} π, α₂ = ${number(at[1], 3)} π: ${verdict}`;
    },
  };
}
