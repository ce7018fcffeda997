// The five steps: what can be set, and what came out.

import { BRUSHES } from "./marks.js";
import { button, choice, field, h, live, slide } from "./fields.js";
import { NEEDED, change, current, edit, resetEdits, setOption, setOutput } from "./state.js";
import { RAMP } from "./view.js";

const option = (name) => current().options[name];
const percent = (share) => `${(100 * share).toFixed(share < 0.1 ? 2 : 1)} %`;
// Options that have a place of their own on the page.
const SHOWN = ["colors", "marks", "learn", "merge", "rename", "recolor", "drop", "min_pixels", "min_length", "size", "effort", "tolerance", "max_shift", "material_sizes", "sizes_between", "keep", "max_pixels", "threads", "order", "split_quads"];

function more(app, topic, get = option, set = setOption) {
  const names = Object.keys(app.declared).filter((name) => app.declared[name].topic === topic && !SHOWN.includes(name));
  return h("details", {}, h("summary", {}, "More options"), names.map((name) => field(name, app.declared[name], get, set)));
}

// 1

const MODES = [["auto", "automatic"], ["number", "this many"], ["exact", "each colour one"], ["regions", "each region one"], ["palette", "nearest of a palette"], ["marks", "painted by me"]];

function modeOf({ options, strokes }) {
  if (strokes) return "marks";
  const { colors } = options;
  if (colors === undefined) return "auto";
  return typeof colors === "number" ? "number" : colors.startsWith("#") ? "palette" : colors;
}

function setMode(mode, app) {
  const { colors, ...options } = current().options;
  const n = app.results.segment?.materials.length ?? 3;
  const start = { number: Math.min(Math.max(n, 2), 12), exact: "exact", regions: "regions", palette: paletteOf(app) }[mode];
  if (start !== undefined) options.colors = start;
  const strokes = mode === "marks" ? { list: [], brushes: BRUSHES.slice(0, 2), learn: false } : null;
  app.brush = 0;
  change({ options, strokes, edits: resetEdits() });
}

const paletteOf = (app) => (app.results.segment?.materials ?? []).slice(0, 12).map((row) => row.color).join(",") || "#000000,#ffffff";

export function materials(app) {
  const result = h("div", { "aria-live": "polite" }), own = h("div");
  live(() => {
    const found = app.results.segment;
    result.replaceChildren(...(found ? [h("p", { class: "note" }, [found.note, ...found.notes].join("; ")), ...found.warnings.map((text) => h("p", { class: "warn" }, text))] : []));
  });
  let shown;
  live(() => {
    const mode = modeOf(current());
    if (mode === shown) return;
    shown = mode;
    own.replaceChildren(...[{ number, palette, marks }[mode]?.(app)].filter(Boolean));
  });
  return [h("h2", {}, "Materials"), choice("Classes", "classes", MODES, () => modeOf(current()), (mode) => setMode(mode, app)), own, result, table(app), more(app, "picture")];
}

const number = () => slide("How many", "number", [1, 12, 1], () => (typeof option("colors") === "number" ? option("colors") : 3), (value, what) => setOption("colors", value, what));

function palette() {
  const input = h("input", { type: "text", id: "palette", onchange: () => setOption("colors", input.value.replaceAll(" ", "")) });
  live(() => document.activeElement !== input && typeof option("colors") === "string" && (input.value = option("colors")));
  return h("p", {}, h("label", { for: "palette" }, "Palette, as #rrggbb,#rrggbb"), input);
}

function marks(app) {
  const brushes = h("div", { class: "brushes", role: "group", "aria-label": "Material to paint" });
  const set = (parts) => change({ strokes: { ...current().strokes, ...parts } });
  live(() => {
    const { strokes } = current();
    if (!strokes) return;
    const made = strokes.brushes.map((color, k) => {
      const brush = button([h("i"), `${k + 1}`], () => ((app.brush = k), app.refresh()), { "aria-pressed": String(k === app.brush), id: `brush-${k}`, "aria-label": `Paint material ${k + 1}` });
      brush.firstChild.style.setProperty("--brush", color);
      return brush;
    });
    const focus = document.activeElement?.id;
    brushes.replaceChildren(...made, button("+", () => set({ brushes: BRUSHES.slice(0, strokes.brushes.length + 1) }), { "aria-label": "One more material", disabled: strokes.brushes.length === BRUSHES.length, id: "brush-more" }));
    if (focus?.startsWith("brush-")) document.getElementById(focus)?.focus();
  });
  const learn = h("input", { type: "checkbox", id: "learn", disabled: !app.learns, onchange: () => set({ learn: learn.checked }) });
  live(() => (learn.checked = Boolean(current().strokes?.learn)));
  const radius = slide("Radius of the brush, pixels", "radius", [1, 40, 1], () => app.radius, (value) => ((app.radius = value), app.refresh()));
  return h("div", {}, h("p", { class: "note" }, "Paint a few strokes of each material on the picture; the rest grows from them. Hold Shift to move the picture."), brushes, radius,
    h("div", { class: "row" }, learn, h("label", { for: "learn" }, app.learns ? "Learn what looks like the strokes" : "Learn (needs scikit-learn: imgquad-mesh[learn])"), button("Clear", () => set({ list: [] }))));
}

function table(app) {
  const chosen = new Set(), filter = h("input", { type: "text", "aria-label": "Show materials with this in their name", placeholder: "filter", oninput: () => draw() });
  const merge = button("Merge", () => mergeChosen(app, chosen), { id: "merge" });
  const body = h("tbody"), reset = button("As found", () => change({ edits: resetEdits() }), { id: "reset" });
  const draw = () => {
    const rows = app.materials(), focus = document.activeElement?.id;
    merge.disabled = chosen.size < 2;
    reset.disabled = current().edits === resetEdits();
    filter.hidden = rows.length <= 100;
    const wanted = rows.filter((row) => row.name.includes(filter.value)).slice(0, 300);
    body.replaceChildren(...wanted.map((row) => materialRow(app, row, chosen, draw)));
    if (focus && body.querySelector(`[id="${CSS.escape(focus)}"]`)) document.getElementById(focus).focus();
  };
  let key;
  live(() => {
    const now = JSON.stringify([app.materials(), current().edits]);
    if (now === key) return;
    key = now;
    for (const name of chosen) if (!app.materials().some((row) => row.base === name)) chosen.delete(name);
    draw();
  });
  const heads = [h("th", { scope: "col" }, h("span", { "aria-hidden": "true" }, "✓"), hidden("chosen")), ...["colour", "name", "area", "meshed"].map((text) => h("th", { scope: "col" }, text))];
  return h("div", {}, filter, h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Materials" }, h("table", {}, h("thead", {}, h("tr", {}, heads)), body)), h("div", { class: "row" }, merge, reset));
}

const hidden = (text) => h("span", { class: "hidden" }, text);

function materialRow(app, row, chosen, draw) {
  const { base, name, color, share, out } = row, { edits } = current();
  const check = h("input", { type: "checkbox", "aria-label": `Choose ${name}`, id: `choose-${base}`, onchange: () => (check.checked ? chosen.add(base) : chosen.delete(base), draw()) });
  check.checked = chosen.has(base);
  const paint = h("input", { type: "color", value: color, "aria-label": `Colour of ${name}`, id: `color-${base}`, onchange: () => edit({ recolor: { ...edits.recolor, [base]: paint.value } }) });
  const call = h("input", { type: "text", value: name, "aria-label": `Name of ${name}`, id: `name-${base}`, onchange: () => rename(base, call.value.trim()) });
  const meshed = h("input", { type: "checkbox", "aria-label": `Mesh ${name}`, id: `mesh-${base}`, onchange: () => edit({ drop: out ? edits.drop.filter((each) => each !== base) : [...edits.drop, base] }) });
  meshed.checked = !out;
  return h("tr", { class: out ? "out" : null }, h("td", {}, check), h("td", {}, paint), h("td", {}, call), h("td", { class: "number" }, percent(share)), h("td", {}, meshed));
}

function rename(base, name) {
  const { [base]: former, ...others } = current().edits.rename;
  edit({ rename: name && name !== base ? { ...others, [base]: name } : others });
}

function mergeChosen(app, chosen) {
  const { edits } = current(), names = app.materials().map((row) => row.base).filter((base) => chosen.has(base)), gone = names.slice(1);
  const left = (values) => Object.fromEntries(Object.entries(values).filter(([base]) => !gone.includes(base)));
  chosen.clear();
  edit({ merge: [...edits.merge, names], rename: left(edits.rename), recolor: left(edits.recolor), sizes: left(edits.sizes), drop: edits.drop.filter((base) => !gone.includes(base)) });
}

// 2

export function noise(app) {
  const result = h("p", { class: "note", "aria-live": "polite", id: "removed" });
  live(() => {
    const found = app.results.denoise;
    result.textContent = found ? `${found.clusters} clusters of ${found.pixels} pixels removed` : "";
  });
  return [h("h2", {}, "Noise"), h("p", { class: "note" }, "Clusters that are both smaller and shorter go to their neighbours. Drag the line in the picture."),
    slide("Least pixels of a cluster", "min_pixels", [0, 400, 1], () => option("min_pixels"), (value, what) => setOption("min_pixels", value === undefined ? value : Math.round(value), what), () => app.results.denoise?.min_pixels),
    slide("Least length of a cluster, pixels", "min_length", [0, 60, 0.5], () => option("min_length"), (value, what) => setOption("min_length", value, what), () => app.results.denoise?.min_length),
    result, more(app, "noise")];
}

// 3

const sized = () => slide("Length of the edges, pixels", "size", [1, 20, 0.5], () => option("size") ?? 4, (value, what) => setOption("size", value === 4 ? undefined : value, what));

export function boundaries(app) {
  const result = h("p", { class: "note", "aria-live": "polite" });
  live(() => {
    const found = app.results.smooth;
    result.textContent = found ? `${found.chains} boundaries between ${found.regions} regions` : "";
  });
  return [h("h2", {}, "Boundaries"), h("p", { class: "note" }, "Boundaries are smoothed; corners stay sharp and areas are kept."), sized(),
    slide("Furthest that a boundary moves, pixels", "max_shift", [0, 4, 0.1], () => option("max_shift") ?? 1, (value, what) => setOption("max_shift", value === 1 ? undefined : value, what)),
    slide("Tolerance: thinner parts go to their neighbours", "tolerance", [0, 20, 1], () => option("tolerance") ?? 0, (value, what) => setOption("tolerance", value || undefined, what)),
    result, more(app, "boundaries")];
}

// 4

const EFFORTS = [["fast", "fast"], ["normal", "normal"], ["best", "best"]];
const BARS = 20;

export function mesh(app) {
  const figures = h("dl", { class: "figures" }), warning = h("p", { class: "warn", hidden: true }), bars = h("div", { id: "histogram", role: "group", "aria-label": "Scaled Jacobian: number of quads" });
  const worst = h("div", { id: "worst", role: "group", "aria-label": "Worst quads" });
  const again = button("Mesh", () => app.meshNow(), { class: "primary", id: "meshnow" }), sizes = h("details");
  const shade = choice("Colours", "shade", [["material", "material"], ["jacobian", "scaled Jacobian, red 0 to blue 1"]], () => (app.view?.shaded ? "jacobian" : "material"), (value) => app.shade(value === "jacobian"));
  let shown;
  live(() => {
    again.disabled = app.fresh("mesh");
    const found = app.results.mesh;
    if (found === shown) return;
    shown = found;
    figures.replaceChildren(...(found ? figuresOf(found) : []));
    bars.replaceChildren(...(found ? barsOf(app, found) : []));
    worst.replaceChildren(...(found ? worstOf(app, found) : []));
  });
  let names;
  live(() => {
    const rows = app.materials().filter((row) => !row.out).slice(0, 50), now = rows.map((row) => row.name).join();
    if (now === names) return;
    names = now;
    sizes.replaceChildren(h("summary", {}, "Sizes of single materials"), ...rows.map((row) => sizeOf(row)));
  });
  return [h("h2", {}, "Mesh"), sized(), choice("Effort", "effort", EFFORTS, () => option("effort") ?? "normal", (value) => setOption("effort", value === "normal" ? "" : value)),
    h("div", { class: "row" }, again), warning, figures, shade, h("h3", {}, "Scaled Jacobian, 0 to 1"), bars, h("h3", {}, "Worst quads"), worst, sizes, more(app, "mesh")];
}

function sizeOf({ base, name }) {
  const id = `size-${base}`, input = h("input", { type: "number", id, min: 0.05, step: "any", placeholder: "as all", onchange: () => {
    const { [base]: former, ...others } = current().edits.sizes;
    edit({ sizes: input.value === "" ? others : { ...others, [base]: Number(input.value) } });
  } });
  live(() => document.activeElement !== input && (input.value = current().edits.sizes[base] ?? ""));
  return h("div", { class: "field" }, h("label", { for: id }, name), input);
}

function figuresOf({ quality, errors }) {
  const largest = Math.max(0, ...Object.values(errors).map(Math.abs));
  const rows = { Quads: quality.n_quads.toLocaleString("en"), Nodes: quality.n_points.toLocaleString("en"), "Scaled Jacobian, least": quality.min_sj.toFixed(3), "Scaled Jacobian, mean": quality.mean_sj.toFixed(3),
    "Irregular nodes": percent(quality.irregular), "Largest error of an area": percent(largest) };
  return Object.entries(rows).flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]);
}

function barsOf(app, { arrays }) {
  const counts = new Array(BARS).fill(0);
  for (const value of arrays.jacobians) counts[Math.min(BARS - 1, Math.max(0, Math.floor(value * BARS)))]++;
  const most = Math.max(...counts.map(height));
  return counts.map((n, k) => {
    const [low, high] = [k / BARS, (k + 1) / BARS];
    const bar = button(h("span"), () => pressed(app, bar, low, high, k), { title: `${low.toFixed(2)} to ${high.toFixed(2)}: ${n} quads`, "aria-label": `${low.toFixed(2)} to ${high.toFixed(2)}: ${n} quads`, "aria-pressed": "false", disabled: n === 0 });
    bar.firstChild.style.height = `${(100 * height(n)) / most}%`;
    bar.firstChild.style.setProperty("--bar", RAMP[Math.min(4, Math.floor(low * 5))]);
    return bar;
  });
}

const height = (n) => Math.log10(1 + n); // so that single quads are seen beside thousands

function pressed(app, bar, low, high, k) {
  const on = bar.getAttribute("aria-pressed") === "false";
  for (const each of bar.parentElement.children) each.setAttribute("aria-pressed", String(on && each === bar));
  app.only(on ? [k ? low : -9, k === BARS - 1 ? 9 : high] : [-9, 9]);
}

function worstOf(app, { arrays: { jacobians, quads }, worst }) {
  const forced = new Map(worst.map((place) => [place.quad, place]));
  const order = lowest(jacobians, 12);
  return order.map((q) => {
    const place = forced.get(quads[q]);
    const why = place ? (place.forced ? `the picture forces it: a corner of ${Math.round(place.angle)} degrees` : "the picture does not force it") : "";
    return button(jacobians[q].toFixed(3) + (place?.forced ? " !" : ""), () => app.goTo(q), { title: why, "aria-label": `Scaled Jacobian ${jacobians[q].toFixed(3)}${why && `, ${why}`}` });
  });
}

// Places of the smallest values, smallest first.
function lowest(values, n) {
  const found = [];
  for (let k = 0; k < values.length; k++) {
    if (found.length === n && values[k] >= values[found[n - 1]]) continue;
    let at = found.length;
    while (at > 0 && values[found[at - 1]] > values[k]) at--;
    found.splice(at, 0, k);
    found.length = Math.min(found.length, n);
  }
  return found;
}

// 5

const DECKS = [["", "the mesh alone"], ["tension", "pulled by 0.1 % (CalculiX runs it)"], ["thermal", "heat from side to side (CalculiX runs it)"]];
const ANALYSES = ["", "plane stress", "plane strain", "axisymmetric", "heat"].map((name) => [name, name || "plane stress (as usual)"]);
const TOLD = { ".inp": "Abaqus, CalculiX", ".bdf": "Nastran", ".cdb": "Ansys", ".msh": "Gmsh", ".vtu": "ParaView, PyVista", ".vtk": "VTK, legacy", ".vtkhdf": "VTK, HDF5", ".e": "Exodus", ".med": "Code_Aster, Salome", ".unv": "I-DEAS", ".xdmf": "XDMF",
  ".npz": "NumPy", ".obj": "Wavefront", ".off": "OFF", ".ply": "PLY", ".stl": "STL, triangles", ".svg": "drawing", ".dxf": "AutoCAD" };

export function files(app) {
  const formats = Object.keys(TOLD).filter((extension) => app.formats.includes(extension)).concat(app.formats.filter((extension) => !(extension in TOLD)));
  const get = (name) => current().output.elements[name], only = h("div"), values = h("div");
  const set = (name, value) => {
    const { [name]: former, ...elements } = current().output.elements;
    setOutput({ elements: value === "" || value === undefined ? elements : { ...elements, [name]: value } });
  };
  let shown;
  live(() => {
    const { extension, deck } = current().output, now = [extension, deck, app.materials().map((row) => row.name)].join();
    if (now === shown) return;
    shown = now;
    const decks = extension === ".inp" ? [choice("Model", "deck", DECKS, () => current().output.deck, (value) => setOutput({ deck: value }))] : [];
    const analyses = [".inp", ".bdf", ".cdb"].includes(extension) ? [choice("Analysis", "analysis", ANALYSES, () => current().output.analysis, (value) => setOutput({ analysis: value }))] : [];
    const focus = document.activeElement?.id;
    only.replaceChildren(...decks, ...analyses);
    values.replaceChildren(...(deck && extension === ".inp" ? [valuesOf(app, deck)] : []));
    if (focus) document.getElementById(focus)?.focus();
  });
  const get5 = (text, what) => button(text, () => app.download(what), { id: `get-${what}` });
  return [h("h2", {}, "Files"), choice("Format", "format", formats.map((each) => [each, `${each}  ${TOLD[each] ?? ""}`]), () => current().output.extension, (extension) => setOutput({ extension, analysis: "", deck: "" })),
    choice("Elements", "order", [[1, "4 nodes"], [2, "8 nodes, curved"]], () => get("order") ?? 1, (value) => set("order", value === "2" ? 2 : "")), only, values,
    h("div", { class: "row" }, button("Download the mesh", () => app.download("mesh"), { class: "primary", id: "get-mesh" })),
    h("h3", {}, "And"), h("div", { class: "row" }, get5("report .json", "report"), get5("picture .png", "picture"), get5("labels .npy", "labels"), get5("labels .png", "labels_png"),
      button("script .mlx", () => app.saveText("script"), { id: "get-script" }), extras(app)), more(app, "elements", get, set)];
}

function extras(app) {
  const made = h("span", { class: "row" });
  live(() => {
    const { strokes, output } = current(), parts = [];
    if (strokes?.list.length) parts.push(button("marks.png", () => app.saveMarks(), { id: "get-marks" }));
    if (output.deck && output.extension === ".inp") parts.push(button("properties.toml", () => app.saveText("properties"), { id: "get-properties" }));
    if (parts.length !== made.children.length) made.replaceChildren(...parts);
  });
  return made;
}

const VALUES = { young: "Young's modulus", poisson: "Poisson's ratio", conductivity: "conductivity" };

function valuesOf(app, deck) {
  const keys = Object.entries(NEEDED[deck]), rows = app.materials().filter((row) => !row.out).slice(0, 50);
  const cell = ({ base, name }, [key, usual]) => {
    const input = h("input", { type: "number", step: "any", placeholder: usual, "aria-label": `${VALUES[key]} of ${name}`, id: `${key}-${base}`, onchange: () => {
      const { [key]: former, ...others } = current().output.values[base] ?? {};
      setOutput({ values: { ...current().output.values, [base]: input.value === "" ? others : { ...others, [key]: Number(input.value) } } });
    } });
    input.value = current().output.values[base]?.[key] ?? "";
    return h("td", {}, input);
  };
  return h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Values of the materials" }, h("p", { class: "note" }, "In units that fit together; a modulus of 1 and a ratio of 0.3 where nothing is given."),
    h("table", {}, h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "material"), keys.map(([key]) => h("th", { scope: "col" }, VALUES[key])))), h("tbody", {}, rows.map((row) => h("tr", {}, h("th", { scope: "row" }, row.name), keys.map((key) => cell(row, key)))))));
}
