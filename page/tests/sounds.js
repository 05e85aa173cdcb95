// The samples of a scene's sound without their fades: {scene, what, seconds, slow} to numbers.
import { readFileSync } from "node:fs";
import { bodyOf } from "../js/damped.js";
import { load } from "../js/engine.js";
import { render } from "../js/sound.js";

const folder = process.argv[2];
const tables = JSON.parse(readFileSync(`${folder}/model.json`, "utf8"));
const engine = await load(readFileSync(`${folder}/model.wasm`), tables);
const { scene, ...options } = JSON.parse(readFileSync(0, "utf8"));
const body = bodyOf(engine, scene);
const samples = await render(engine, body, scene.initial, { ...options, rest: async () => true });
process.stdout.write(JSON.stringify(Array.from(samples)));
