// What is set: from the article's cases, from and to a link, to a scene file.

const COORDINATES = ["x", "y", "theta", "x_dot", "y_dot", "theta_dot"];
const SAMPLES = 4001;

/** The settings of one of the article's cases. */
export function fromCase(tables, model, name) {
  const found = tables.cases[model][name];
  return {
    model,
    case: name,
    formulation: { ...found.formulation },
    parameters: { ...found.parameters },
    initial: [...found.initial],
    stop: found.stop,
    damping: found.damping,
  };
}

/** Settings that make one point each, as links. */
export const PRESETS = [
  {
    title: "The article’s squeal", link: "model=B2&case=c",
    point: "Friction 0.32, above the threshold 0.23: the pad begins to hammer.",
  },
  {
    title: "Just below the threshold", link: "model=B2&case=c&mu=0.22&stop=0.01",
    point: "Friction 0.22: the same pad rings on and nothing grows.",
  },
  {
    title: "Damping saves it", link: "model=B2&case=c&damping=0.05&stop=0.01",
    point: "Friction 0.32 again, with 5 % damping: the vibration dies out.",
  },
  {
    title: "A cycle beside stable sliding", link: "model=B2&case=d&damping=0.005&start_y=7.463339e-06&start_y_dot=1.5&stop=0.03",
    point: "A knock of 1.5 m/s starts a rocking that no eigenvalue shows. At ẏ = 0.5 m/s it dies out.",
  },
];

/** Text after # that carries all settings. */
export function toLink(settings) {
  const pairs = new URLSearchParams({ model: settings.model, case: settings.case });
  for (const [key, value] of Object.entries(settings.formulation)) pairs.set(key, value);
  for (const [key, value] of Object.entries(settings.parameters)) pairs.set(key, value);
  settings.initial.forEach((value, i) => value && pairs.set(`start_${COORDINATES[i]}`, value));
  pairs.set("stop", settings.stop);
  if (settings.damping) pairs.set("damping", settings.damping);
  return pairs.toString();
}

/** Settings of a link; what it lacks, or says wrongly, is that of its case. */
export function fromLink(tables, text) {
  const pairs = new URLSearchParams(text.replace(/^#/, ""));
  const pick = (key, choices) => (choices.includes(pairs.get(key)) ? pairs.get(key) : choices[0]);
  const model = pick("model", ["B2", "B1", "BN"]);
  const settings = fromCase(tables, model, pick("case", ["c", "a", "b", "d"]));
  for (const key of Object.keys(settings.formulation)) {
    const given = tables.formulation[model][key].find((value) => String(value) === pairs.get(key));
    if (given !== undefined) settings.formulation[key] = given;
  }
  for (const [key, limits] of Object.entries(tables.parameters)) {
    if (!limits.models.includes(model) || !pairs.has(key)) continue;
    const value = number(pairs.get(key));
    if (admits(limits, value)) settings.parameters[key] = value;
  }
  if ([...pairs.keys()].some((key) => key.startsWith("start_"))) settings.initial.fill(0);
  COORDINATES.forEach((name, i) => {
    const value = number(pairs.get(`start_${name}`));
    if (Number.isFinite(value)) settings.initial[i] = value;
  });
  const stop = number(pairs.get("stop"));
  if (stop > 0 && stop <= 0.1) settings.stop = stop;
  const damping = number(pairs.get("damping"));
  if (admits(tables.damping, damping)) settings.damping = damping;
  return settings;
}

const number = (text) => (text?.trim() ? Number(text) : NaN);

/** True if a parameter may have this value. */
export const admits = ({ low, high, lowAllowed }, value) =>
  Number.isFinite(value) && (value > low || (lowAllowed && value === low)) && value < high;

/** A number as YAML reads it as one: 1e-7 becomes 1.0e-7. */
const yaml = (value) => String(value).replace(/^(-?\d+)e/, "$1.0e");

/** The settings as a scene file for `squeal simulate`. */
export function toScene(tables, settings) {
  const mapping = (entries) => entries.map(([key, value]) => `  ${key}: ${value}`);
  const parameters = Object.keys(tables.parameters)
    .filter((key) => settings.parameters[key] !== undefined)
    .map((key) => [key, yaml(settings.parameters[key])]);
  const initial = settings.initial.map((v, i) => [COORDINATES[i], yaml(v)]).filter((_, i) => {
    return settings.initial[i] !== 0;
  });
  const formulation = Object.entries(settings.formulation).map(([k, v]) => [k, JSON.stringify(v)]);
  return [
    `# Model ${settings.model}, from case (${settings.case})`,
    `model: ${settings.model}`,
    "parameters:",
    ...mapping(parameters),
    ...(formulation.length ? ["formulation:", ...mapping(formulation)] : []),
    ...(settings.damping ? [`damping: {ratios: [${Array(3).fill(yaml(settings.damping)).join(", ")}]}`] : []),
    ...(initial.length ? ["initial:", ...mapping(initial)] : []),
    `time: {stop: ${yaml(settings.stop)}, samples: ${SAMPLES}}`,
    "outputs: [events, shares, extrema]",
    "",
  ].join("\n");
}
