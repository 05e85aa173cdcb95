// Runs scenes from standard input with the page's engine: node runs.js FOLDER < scenes.json
import { readFileSync } from "node:fs";
import { bodyOf } from "../js/damped.js";
import { load, run, summary } from "../js/engine.js";

const folder = process.argv[2];
const tables = JSON.parse(readFileSync(`${folder}/model.json`, "utf8"));
const engine = await load(readFileSync(`${folder}/model.wasm`), tables);
const answers = JSON.parse(readFileSync(0, "utf8")).map((scene) => {
  const body = bodyOf(engine, scene);
  return summary(body, run(engine, body, scene.initial, scene.stop));
});
process.stdout.write(JSON.stringify(answers));
