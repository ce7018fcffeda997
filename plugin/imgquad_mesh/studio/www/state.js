// What was clicked: one plain value, replaced at each change, so that undo is taking a former one.

const START = {
  options: {}, // of MeshOptions, where they are not the default
  edits: { merge: [], rename: {}, recolor: {}, drop: [], sizes: {} }, // of materials, by the names that they were found with
  strokes: null, // painted marks: { list: [{ brush, radius, points }], brushes: [colour], learn }
  output: { extension: ".vtu", elements: {}, deck: "", analysis: "", values: {} },
};

let past = [], now = START, future = [];
const listeners = [];

export const current = () => now;
export const canUndo = () => past.length > 0;
export const canRedo = () => future.length > 0;
export const onChange = (listener) => listeners.push(listener);

let lastWhat = "";
// `what` names a slider: its many small steps are one for undo.
export function change(parts, what = "") {
  if (!what || what !== lastWhat) past.push(now);
  lastWhat = what;
  [now, future] = [{ ...now, ...parts }, []];
  told();
}
export const settle = () => (lastWhat = "");

export function setOption(name, value, what = "") {
  const options = { ...now.options };
  if (value === undefined || value === "" || Number.isNaN(value)) delete options[name];
  else options[name] = value;
  change({ options, ...(SEGMENTING.includes(name) ? { edits: START.edits } : {}) }, what);
}
const SEGMENTING = ["colors", "flatten", "no_data", "frame", "channel", "level", "scalars", "info_bar", "grain_angle"];

export const edit = (parts) => change({ edits: { ...now.edits, ...parts } });
export const setOutput = (parts) => change({ output: { ...now.output, ...parts } });
export function restart() {
  [past, now, future] = [[], START, []];
  told();
}
export const resetEdits = () => START.edits;

export function undo() {
  if (canUndo()) step(past, future);
}
export function redo() {
  if (canRedo()) step(future, past);
}
function step(from, to) {
  to.push(now);
  now = from.pop();
  lastWhat = "";
  told();
}
const told = () => listeners.forEach((listener) => listener());

// The recipe that the server takes.
export function recipe(picture) {
  const { options, edits, strokes, output } = now;
  const name = (base) => edits.rename[base] ?? base;
  const mapped = (values) => Object.fromEntries(Object.entries(values).map(([base, value]) => [name(base), value]));
  const made = { ...options };
  if (edits.merge.length) made.merge = edits.merge.map((names) => [names, names[0]]);
  if (Object.keys(edits.rename).length) made.rename = edits.rename;
  if (Object.keys(edits.recolor).length) made.recolor = mapped(edits.recolor);
  if (edits.drop.length) made.drop = edits.drop.map(name);
  if (Object.keys(edits.sizes).length) made.material_sizes = mapped(edits.sizes);
  const marks = Boolean(strokes && strokes.list.length);
  return { picture, options: made, marks, learn: marks && strokes.learn, output: outputOf(output, name) };
}

function outputOf({ extension, elements, deck, analysis, values }, name) {
  const made = { extension, elements };
  if (analysis) made.analysis = analysis;
  if (deck && extension === ".inp") {
    made.deck = deck;
    made.properties = properties(deck, values, name);
  }
  return made;
}

export const NEEDED = { tension: { young: 1, poisson: 0.3 }, thermal: { conductivity: 1 } };

// Values of the materials as TOML; those that nobody gave are 1 (0.3 for Poisson's ratio).
function properties(deck, values, name) {
  const table = (given) => Object.entries(NEEDED[deck]).map(([key, usual]) => `${key} = ${given[key] ?? usual}\n`).join("");
  const own = Object.entries(values).map(([base, given]) => `\n[${JSON.stringify(name(base))}]\n${table(given)}`);
  return `["*"]\n${table({})}${own.join("")}`;
}
