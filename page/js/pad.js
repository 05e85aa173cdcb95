// The pad, its springs, the surface and the forces at one instant, displacements enlarged.

import { coefficient, edges, gapsAt, sample, signalsAt } from "./engine.js";
import { paint, sheet } from "./plot.js";

/** How much displacements are enlarged: the largest of the motion is seen as half the height. */
export function enlargement({ engine, body, states, gaps }) {
  let top = 0;
  for (let k = 0; k < states.length; k += 6) {
    top = Math.max(top, Math.abs(states[k]), Math.abs(states[k + 1]) + Math.abs(states[k + 2]));
  }
  for (const gap of gaps) top = Math.max(top, Math.abs(gap));
  const raw = (0.5 * coefficient(engine, body, "h")) / (top || 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  return Math.max(1, Math.floor(raw / power) * power);
}

function arrow(g, x, y, dx, dy, colour) {
  const size = Math.hypot(dx, dy);
  if (!(size > 3)) return;
  const [ux, uy] = [dx / size, dy / size], head = Math.min(9, size);
  g.strokeStyle = g.fillStyle = colour;
  g.lineWidth = 2.4;
  g.beginPath();
  g.moveTo(x, y);
  g.lineTo(x + dx - ux * head * 0.7, y + dy - uy * head * 0.7);
  g.stroke();
  g.beginPath();
  g.moveTo(x + dx, y + dy);
  g.lineTo(x + dx - head * (ux - 0.45 * uy), y + dy - head * (uy + 0.45 * ux));
  g.lineTo(x + dx - head * (ux + 0.45 * uy), y + dy - head * (uy - 0.45 * ux));
  g.fill();
}

function zigzag(g, x0, y0, x1, y1, turns, wide) {
  const length = Math.hypot(x1 - x0, y1 - y0) || 1;
  const [nx, ny] = [(-(y1 - y0) / length) * wide, ((x1 - x0) / length) * wide];
  const at = (share, side) => [x0 + (x1 - x0) * share + side * nx, y0 + (y1 - y0) * share + side * ny];
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(...at(0.15, 0));
  for (let i = 0; i < turns; i++) g.lineTo(...at(0.15 + (0.7 * (i + 0.5)) / turns, i % 2 ? -1 : 1));
  g.lineTo(...at(0.85, 0));
  g.lineTo(x1, y1);
  g.stroke();
}

function ground(g, level, width, height, travelled) {
  g.fillStyle = paint.ground;
  g.fillRect(0, level, width, height - level);
  g.strokeStyle = paint.soft;
  g.lineWidth = 1;
  g.beginPath();
  g.moveTo(0, level);
  g.lineTo(width, level);
  for (let x = (travelled % 16) - 16; x < width + 16; x += 16) {
    g.moveTo(x, level + 1);
    g.lineTo(x - 8, level + 9);
  }
  g.stroke();
}

/** Draw the pad at time t (natural units) of a motion; gives the state and contact there. */
export function drawPad(canvas, view, t, enlarged) {
  const { engine, body, motion, settings } = view;
  const c = (name) => coefficient(engine, body, name);
  const { states: s, contacts: [touching] } = sample(engine, motion, [t]);
  const contact = edges(body, touching);
  const gaps = gapsAt(engine, body, s);
  const page = sheet(canvas), { g, width, height } = page;
  const [w, h] = [c("w"), c("h")];
  const scale = Math.min(width / (4.4 * w), (height - 60) / (2.0 * h + 1.9 * w));
  const level = height - 46, middle = width / 2;
  const low = (c("rly") + c("rty")) / 2;
  const px = (x) => middle + x * scale, py = (y) => level - (y - low) * scale;
  ground(g, level, width, height, 260 * (t / motion.t));

  const turn = s[2] / w, lift = [c("gap_l"), c("gap_t")].reduce((a, b) => a + b) / 2;
  const corner = (name) => {
    const [x, y] = [c(`r${name}x`), c(`r${name}y`)];
    return [px(x + enlarged * (s[0] - turn * y)), py(y + enlarged * (lift + s[1] + turn * x))];
  };
  const [upper1, upper2, lead, trail] = ["1", "2", "l", "t"].map(corner);
  const centre = [px(enlarged * s[0]), py(enlarged * (lift + s[1]))];

  g.strokeStyle = paint.soft;
  for (const [n, [x, y]] of [["1", upper1], ["2", upper2]]) {
    const [dx, dy] = [c(`D${n}x`), c(`D${n}y`)], reach = (1.05 * w) / Math.hypot(dx, dy);
    const foot = [px(c(`r${n}x`) - dx * reach), py(c(`r${n}y`) - dy * reach)];
    zigzag(g, ...foot, x, y, 9, 6);
    g.fillStyle = paint.soft;
    g.fillRect(foot[0] - 4, foot[1] - 4, 8, 8);
    g.textAlign = "center";
    const [sx, sy] = [x - foot[0], y - foot[1]], aside = 18 / (Math.hypot(sx, sy) || 1);
    const side = sx > 0 ? 1 : -1; // above a level spring, beside a steep one
    const [tx, ty] = [(foot[0] + x) / 2 + aside * side * sy, (foot[1] + y) / 2 - aside * side * sx];
    g.fillText(`k${n}`, tx, ty + 4);
  }
  const colour = paint.contacts[contact];
  // contact springs: where they are, or some for the distributed stiffness of the lower face
  const places = body.places.length ? body.places : [-3, -2, -1, 0, 1, 2, 3].map((i) => i / 3);
  g.strokeStyle = paint.soft;
  for (const place of places) {
    const [a, b] = [(1 - place) / 2, (1 + place) / 2];
    const [x, y] = [a * lead[0] + b * trail[0], a * lead[1] + b * trail[1]];
    zigzag(g, x, level + 40, x, Math.max(level, y), 5, Math.min(4, 60 / places.length));
  }
  g.fillStyle = paint.pad;
  g.strokeStyle = paint.ink;
  g.lineWidth = 1.5;
  g.beginPath();
  [upper1, upper2, trail, lead].forEach((p, i) => (i ? g.lineTo(...p) : g.moveTo(...p)));
  g.closePath();
  g.fill();
  g.stroke();
  g.strokeStyle = colour;
  g.lineWidth = 4;
  g.beginPath();
  g.moveTo(...lead);
  g.lineTo(...trail);
  g.stroke();
  for (const [edge, p] of [[1, lead], [2, trail]]) {
    g.beginPath();
    g.arc(...p, 6, 0, 7);
    g.fillStyle = contact & edge ? colour : paint.panel;
    g.fill();
    g.lineWidth = 2;
    g.stroke();
  }

  const force = (0.55 * w * scale) / c("F_n"), most = 1.3 * w * scale;
  const capped = (f) => Math.min(force * f, most);
  arrow(g, centre[0], centre[1] - 0.55 * w * scale - h * scale, 0, 0.55 * w * scale, paint.ink);
  g.fillStyle = paint.ink;
  g.beginPath();
  g.arc(...centre, 3, 0, 7);
  g.fill();
  const values = signalsAt(engine, body, s, touching);
  const [, , reaction, place] = values;
  const aside = contact && reaction > 0 && place > 0 ? -14 : 14; // away from the reaction
  g.fillStyle = paint.ink;
  g.fillText("Fn", centre[0] + aside, centre[1] - h * scale - 0.4 * w * scale);
  if (contact && reaction > 0) {
    const frame = settings.formulation.delta_from === "frame" ? c("x0") + s[0] : 0;
    const x = centre[0] + (place - frame) * scale;
    arrow(g, x, level, 0, -capped(reaction), colour);
    arrow(g, x, level, capped(c("mu") * reaction), 0, colour);
    g.fillStyle = colour;
    g.fillText("Rn", x + (place > 0 ? 16 : -16), level - capped(reaction) + 6);
  }
  g.fillStyle = paint.ink;
  g.textAlign = "left";
  g.fillText(`surface moves right; displacements × ${enlarged.toLocaleString("en")}`, 4, 12);
  return { state: s, contact, gaps, values };
}
