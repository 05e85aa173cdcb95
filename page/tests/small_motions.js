// Equilibria, matrices, eigenvalues, thresholds and maps of scenes from standard input.
import { readFileSync } from "node:fs";
import { bodyOf } from "../js/damped.js";
import { load } from "../js/engine.js";
import * as linear from "../js/linear.js";
import { VERDICTS } from "../js/undamped.js";

const folder = process.argv[2];
const tables = JSON.parse(readFileSync(`${folder}/model.json`, "utf8"));
const engine = await load(readFileSync(`${folder}/model.wasm`), tables);
const answers = JSON.parse(readFileSync(0, "utf8")).map((scene) => {
  const body = bodyOf(engine, scene);
  const points = linear.branch(engine, body, 2);
  const at = linear.onBranch(engine, body, points, body.pad.mu);
  const n = scene.map ?? 0;
  const angle = (i) => (Math.PI * (i + 0.5)) / n;
  const grid = (origin) => Array.from({ length: n * n }, (_, k) => {
    return VERDICTS[linear.mapCode(engine, scene, angle(Math.floor(k / n)), angle(k % n), origin)];
  });
  return {
    refusal: body.refusal ?? null,
    q: at && at.z.slice(0, 3).map((v, i) => v * body.factors[i]),
    contact: at?.contact,
    verdict: at && VERDICTS[at.verdict],
    reaction: at && linear.reaction(engine, body, at),
    ...(at && linear.matrices(engine, body, at)),
    eigenvalues: at && linear.eigenvalues(at, body.units.time).map(({ re, im }) => [re, im]),
    shapes: at && linear.modeShapes(at, body.units.time).map(({ re, im, shape }) => {
      return [[re, im], ...shape.map((v) => [v.re, v.im])];
    }),
    end: points.at(-1)?.mu,
    thresholds: linear.thresholds(engine, body, points),
    origin: grid(true),
    codes: grid(false),
  };
});
process.stdout.write(JSON.stringify(answers));
