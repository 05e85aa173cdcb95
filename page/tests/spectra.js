// Spectra and extremes of scenes from standard input.
import { readFileSync } from "node:fs";
import { bodyOf } from "../js/damped.js";
import { extremes, load, run, shares, signalsAt, trace } from "../js/engine.js";
import { spectrum } from "../js/spectrum.js";

const folder = process.argv[2];
const tables = JSON.parse(readFileSync(`${folder}/model.json`, "utf8"));
const engine = await load(readFileSync(`${folder}/model.wasm`), tables);
const answers = JSON.parse(readFileSync(0, "utf8")).map(({ highest, ...scene }) => {
  const body = bodyOf(engine, scene), motion = run(engine, body, scene.initial, scene.stop);
  const course = trace(engine, motion, 5);
  const ends = [0, 1].map((i) => {
    const read = (state, contact) => signalsAt(engine, body, state, contact)[i];
    const values = Float64Array.from(course.times, (_, k) => {
      return read(course.states.subarray(6 * k, 6 * k + 6), course.contacts[k]);
    });
    return extremes(engine, motion, course, values, read);
  });
  const { hertz, decibels } = spectrum(engine, body, motion, "force", highest);
  return {
    ends, units: body.units, shares: shares(motion, String),
    hertz: Array.from(hertz), decibels: Array.from(decibels),
  };
});
process.stdout.write(JSON.stringify(answers));
