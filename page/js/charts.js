// Histories, spectrum, roots against friction, mode shapes and the stability map.

import { eigenvalues, modeShapes } from "./linear.js";
import { COLOURS, DASHES, axes, line, range, sheet, stretches } from "./plot.js";

const LEFT = 72, RIGHT = 12;
const ROWS = [3, 1, 2, 0]; // rows of the state strip: full, leading, trailing, apart
const EDGES = { 3: "both edges", 1: "leading", 2: "trailing", 0: "apart" };

/** Strip of contact states, both signals in the states' colours, and the displacement. */
export function drawHistories(canvas, view) {
  const page = sheet(canvas), { g, width, height } = page;
  const { seconds, contacts, signals, names, displacements } = view;
  const ms = Float64Array.from(seconds, (t) => 1000 * t);
  const x = [0, ms.at(-1)], inner = width - LEFT - RIGHT;
  const strip = { left: LEFT, top: 6, width: inner, height: 56 };
  g.textAlign = "right";
  g.textBaseline = "middle";
  const px = (t) => LEFT + (t / x[1]) * inner;
  ROWS.forEach((state, row) => {
    g.fillStyle = "#222";
    g.fillText(EDGES[state], LEFT - 5, strip.top + 14 * row + 7);
    g.fillStyle = "#f3f3f3";
    g.fillRect(LEFT, strip.top + 14 * row + 1, inner, 12);
  });
  const parts = stretches(contacts);
  for (const { contact, from, to } of parts) {
    g.fillStyle = COLOURS[contact];
    const end = ms[Math.min(to, ms.length - 1)];
    const row = ROWS.indexOf(contact);
    g.fillRect(px(ms[from]), strip.top + 14 * row + 1, Math.max(1, px(end) - px(ms[from])), 12);
  }
  const each = (height - 76 - 40) / 3 - 10;
  const boxes = [0, 1, 2].map((i) => {
    return { left: LEFT, top: 76 + i * (each + 10), width: inner, height: each };
  });
  signals.forEach((values, i) => {
    const y = range(values, 0), scale = axes(page, boxes[i], { x, y, yLabel: names[i], xTicks: false });
    for (const { contact, from, to } of parts) {
      const cut = [from, Math.min(to + 1, ms.length)];
      const style = { colour: COLOURS[contact], dash: DASHES[contact] };
      line(page, boxes[i], scale, ms.subarray(...cut), values.subarray(...cut), style);
    }
  });
  const y = range(displacements.flatMap((d) => Array.from(range(d))), 0);
  const scale = axes(page, boxes[2], { x, y, yLabel: "x, y, wθ in µm", xLabel: "time in ms" });
  [["x", []], ["y", [6, 3]], ["wθ", [2, 2]]].forEach(([name, dash], i) => {
    line(page, boxes[2], scale, ms, displacements[i], { dash, colour: "#333" });
    g.fillStyle = "#222";
    g.textAlign = "left";
    g.fillText(name, LEFT + 30 + 60 * i, boxes[2].top + 10);
    line(page, boxes[2], { px: (v) => v, py: (v) => v },
      [LEFT + 6 + 60 * i, LEFT + 26 + 60 * i], [boxes[2].top + 10, boxes[2].top + 10], { dash });
  });
}

/** Where the histories' instant lies, for the moving line over them. */
export const instantAt = (width, share) => LEFT + share * (width - LEFT - RIGHT);

/** Amplitudes over frequency on a scale of decades, with the eigenfrequencies. */
export function drawSpectrum(canvas, { hertz, amplitude }, eigen, name) {
  const page = sheet(canvas), { width, height } = page;
  const box = { left: LEFT, top: 10, width: width - LEFT - RIGHT, height: height - 54 };
  const top = amplitude.reduce((a, b) => Math.max(a, b), 0) || 1;
  const frequencies = eigen.map(({ im }) => Math.abs(im) / (2 * Math.PI));
  const end = Math.max(1000, 2 * Math.max(...frequencies, hertz[1] * 20));
  const x = [0, end / 1000], y = [-80, 5];
  const labels = { x, y, xLabel: "frequency in kHz (dashed: eigenfrequencies)", yLabel: `${name}, dB` };
  const scale = axes(page, box, labels);
  const level = amplitude.map((a) => Math.max(-80, 20 * Math.log10(a / top)));
  line(page, box, scale, hertz.map((f) => f / 1000), level, { colour: "#333" });
  for (const f of frequencies) {
    line(page, box, scale, [f / 1000, f / 1000], y, { colour: "#C8380E", dash: [4, 3] });
  }
}

/** Frequency and growth of the modes along the branch, with the pad's mu and the thresholds. */
export function drawRoots(canvas, { body, points, thresholds }) {
  const page = sheet(canvas), { g, width, height } = page;
  const each = (height - 62) / 2;
  const top = { left: LEFT, top: 8, width: width - LEFT - RIGHT, height: each };
  const low = { ...top, top: 18 + each };
  const mus = points.map((p) => p.mu), x = [0, Math.max(body.pad.mu * 1.1, mus.at(-1) ?? 1)];
  const all = points.map((p) => eigenvalues(p, body.units.time));
  const sorted = all.map((roots) => roots.filter((r) => r.im >= 0));
  const hertz = sorted.flatMap((roots) => roots.map((r) => r.im / 2000 / Math.PI));
  const growth = all.flatMap((roots) => roots.map((r) => r.re / 1000));
  const a = axes(page, top, { x, y: range(hertz, 0), yLabel: "kHz", xTicks: false });
  const b = axes(page, low, { x, y: range(growth, 1, -1), yLabel: "growth, 1/ms", xLabel: "coefficient of friction µ" });
  const dot = (box, { px, py }, mu, value, grows) => {
    g.fillStyle = grows ? "#C8380E" : "#333";
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
  vertical(body.pad.mu, [], "#3498DB");
  for (const t of thresholds) vertical(t.mu, [5, 3], "#C8380E");
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
    outline(null, [2, 3], "#999");
    g.lineWidth = 1.6;
    outline(0, [], "#3498DB");
    outline(Math.PI, [6, 3], "#C8380E");
    g.setLineDash([]);
    g.fillStyle = "#222";
    g.textAlign = "center";
    g.fillText(`${(mode.im / 2000 / Math.PI).toFixed(3)} kHz`, cx, height - 26);
    g.fillText(`${(mode.re / 1000).toPrecision(3)} 1/ms`, cx, height - 9);
  });
}

const FILLS = ["#ffffff", "#c9c9c9", "#7d6a86", "#f3ddc4", "#ffffff"];

const HATCHES = [null, [1, 0], [0, 1], [0.5, 0.5], null]; // heights at the left and right of a cell

/** Verdicts over both angles (rows of codes, -1 where not yet known), and the place of the pad. */
export function drawMap(canvas, { codes, n }, parameters) {
  const page = sheet(canvas), { g, width, height } = page;
  const side = Math.min(width - LEFT - RIGHT, height - 52);
  const box = { left: LEFT, top: 8, width: side, height: side }, cell = side / n;
  for (let k = 0; k < n * n; k++) {
    if (codes[k] < 0) continue;
    const x = box.left + Math.floor(k / n) * cell, y = box.top + side - ((k % n) + 1) * cell;
    g.fillStyle = FILLS[codes[k]];
    g.fillRect(x, y, cell + 0.6, cell + 0.6);
    if (!HATCHES[codes[k]]) continue;
    g.strokeStyle = "#555"; // hatching: flutter rises, divergence falls, the rest is level
    g.lineWidth = 0.7;
    g.beginPath();
    const [from, to] = HATCHES[codes[k]].map((share) => share * cell);
    g.moveTo(x, y + from);
    g.lineTo(x + cell, y + to);
    g.stroke();
  }
  const label = { xLabel: "α₁ / π", yLabel: "α₂ / π" };
  const { px, py } = axes(page, box, { x: [0, 1], y: [0, 1], ...label });
  const [x, y] = [px(parameters.alpha1 / Math.PI), py(parameters.alpha2 / Math.PI)];
  for (const [colour, wide] of [["#fff", 6], ["#C8380E", 2.5]]) {
    g.strokeStyle = colour;
    g.lineWidth = wide;
    g.beginPath();
    g.moveTo(x - 9, y);
    g.lineTo(x + 9, y);
    g.moveTo(x, y - 9);
    g.lineTo(x, y + 9);
    g.stroke();
  }
  return (left, top) => [(left - box.left) / side, 1 - (top - box.top) / side];
}
