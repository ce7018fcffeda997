// The page: opens pictures, keeps one piece of work under way, shows what came out.

import * as api from "./api.js";
import { forget, h, refresh } from "./fields.js";
import { drawStrokes, strokesAsPng } from "./marks.js";
import * as panels from "./panels.js";
import { canRedo, canUndo, change, current, onChange, recipe, redo, restart, settle, undo } from "./state.js";
import { LARGEST, View } from "./view.js";

const at = (id) => document.getElementById(id);
// name, panel, the stage that it shows, what is seen
const STEPS = [["Materials", panels.materials, "segment", "materials"], ["Noise", panels.noise, "denoise", "materials"], ["Boundaries", panels.boundaries, "smooth", "boundaries"], ["Mesh", panels.mesh, "mesh", "mesh"], ["Files", panels.files, "mesh", "mesh"]];
const SHOW = [["picture", "picture"], ["materials", "materials"], ["boundaries", "boundaries"], ["mesh", "mesh"]];
const STAGES = { start: "starting", read: "reading", segment: "finding materials", denoise: "removing noise", absorb: "simplifying", boundary: "finding boundaries", smooth: "smoothing", mesh: "meshing", write: "writing" };
// topics of the options that a stage hangs on
const HANGS = { segment: ["picture"], denoise: ["picture", "noise", "boundaries"], smooth: ["picture", "noise", "boundaries", "mesh"], mesh: ["picture", "noise", "boundaries", "mesh"] };

const app = { declared: {}, formats: [".vtu"], learns: false, results: {}, brush: 0, radius: 4, view: null, materials, refresh, fresh, shade, only, goTo, download, saveText, saveMarks, meshNow };
let picture = null, step = 0, running = null, failed = {}, texts = {}, tab = "command", sentMarks = null, looked = null;

// Pictures

async function open(blob, name) {
  say("");
  running?.abort();
  try {
    const [decoded, sent] = await Promise.all([decode(blob), api.sendPicture(blob, name)]);
    picture = { name: sent.name, decoded };
    Object.assign(app, { results: {}, brush: 0 });
    [failed, sentMarks, looked] = [{}, null, null];
    restart();
    at("drop").hidden = true;
    at("bar").hidden = false;
    at("name").textContent = picture.name;
    go(0);
  } catch (error) {
    at("drop").hidden = Boolean(picture);
    at("bar").hidden = !picture;
    say(error.message);
  }
}

// The browser shows what it can read itself at once, and says whether it can; the server draws other formats.
async function decode(blob) {
  try {
    const asIs = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
    const image = await createImageBitmap(blob, asIs), { width, height } = image;
    const by = LARGEST / Math.max(width, height), sides = { resizeWidth: Math.max(1, width * by), resizeHeight: Math.max(1, height * by) };
    const shown = by < 1 ? await createImageBitmap(image, { ...asIs, ...sides }) : image; // quick: shrunk by the decoder
    at("drop").hidden = true;
    at("bar").hidden = false;
    showPicture(shown, [width, height]);
    return true;
  } catch {
    return false;
  }
}

function showPicture(image, size) {
  app.view?.setPicture(image, size);
  app.view?.fit();
}

// Work: one request under way; what changed meanwhile comes after it

const keyOf = (stage) => {
  const { options, ...others } = recipe(picture?.name ?? "");
  const mine = Object.entries(options).filter(([name]) => HANGS[stage].includes(app.declared[name]?.topic ?? "picture"));
  return JSON.stringify([mine, others.marks && current().strokes]);
};

function fresh(stage) {
  return app.results[stage]?.key === keyOf(stage);
}

function due() {
  const paints = current().strokes && current().strokes.list.length === 0;
  if (!picture || paints) return null;
  const wanted = STEPS[step][2];
  return ["segment", wanted].find((stage) => !fresh(stage) && failed[stage] !== keyOf(stage) && (stage !== "mesh" || app.wanted)) ?? null;
}

async function work() {
  if (running) return;
  for (let stage = due(); stage; stage = due()) {
    const key = keyOf(stage);
    try {
      const [done, data] = await perform({ do: stage });
      take(stage, { ...done, key, arrays: api.arraysOf(done, data) });
      if (stage === "segment" && !picture.decoded && looked !== picture) await look();
    } catch (error) {
      failed[stage] = key;
      say(error.name === "AbortError" ? "" : error.message);
    }
    if (stage === "mesh") app.wanted = false;
    refresh();
    steps();
  }
}

async function perform(task) {
  running = new AbortController();
  const slow = setTimeout(() => (at("stage").textContent = "starting; the first time on a machine takes up to a minute, once"), 4000);
  busy(true);
  try {
    await bringMarks();
    const [done, data] = await api.run({ ...task, recipe: recipe(picture?.name ?? "") }, running.signal, ({ stage, number, of }) => {
      if (stage !== "start") clearTimeout(slow);
      at("stage").textContent = STAGES[stage] ?? stage;
      if (of) at("progress").value = number / of;
    });
    say("");
    return [done, data];
  } finally {
    clearTimeout(slow);
    running = null;
    busy(false);
  }
}

function busy(is) {
  at("cancel").hidden = at("progress").hidden = !is;
  at("stage").textContent = is ? STAGES.start : "";
  at("progress").value = 0; // without a value the bar moves all the time, which takes the work half a core
  document.body.toggleAttribute("data-busy", is);
}

async function bringMarks() {
  const { strokes } = current();
  if (!strokes?.list.length || sentMarks === strokes.list) return;
  await api.sendMarks(await strokesAsPng(strokes, pictureSize()));
  sentMarks = strokes.list;
}

const pictureSize = () => app.view.size;

async function look() {
  const [file] = api.filesOf(...(await perform({ do: "look" })));
  const { segment } = app.results;
  looked = picture;
  showPicture(await createImageBitmap(file), [segment.columns, segment.rows]);
  take("segment", segment);
}

function take(stage, result) {
  app.results[stage] = result;
  const { view } = app, { arrays } = result;
  if (stage === "denoise" || stage === "smooth") delete result.arrays; // the view has them
  if (stage === "segment") {
    app.formats = result.formats;
    if (view && (view.size[0] !== result.columns || view.size[1] !== result.rows)) view.size = [result.columns, result.rows];
    view?.setLabels("before", arrays.labels);
  }
  if (!view) return;
  if (arrays.labels && stage !== "segment") view.setLabels("after", arrays.labels, partOf(result));
  if (stage === "smooth") view.setLines(arrays.lines);
  if (stage === "mesh") {
    view.setQuads(arrays);
    view.mark = null;
    view.range = [-9, 9];
  }
  paint();
}

// The part of the picture that is meshed: left, top, width, height.
function partOf({ rows, columns }) {
  const [left, top] = (current().options.crop ?? "0,0").split(",").map(Number);
  return [left, top, columns, rows];
}

function meshNow() {
  app.wanted = true;
  delete failed.mesh;
  work();
}

// What is seen

// The table of materials with what the server has not heard yet.
function materials() {
  const { edits } = current(), found = app.results.segment;
  return (found?.materials ?? []).map((row) => {
    const base = found.base[row.number] ?? row.name;
    return { ...row, base, name: edits.rename[base] ?? row.name, color: edits.recolor[base] ?? row.color, out: edits.drop.includes(base) };
  });
}

function paint() {
  const { view } = app, shown = at("show").value;
  if (!view) return;
  const isMesh = shown === "mesh" && Boolean(app.results.mesh);
  view.shown = { picture: true, lines: shown === "boundaries", quads: isMesh };
  view.opacity = shown === "picture" ? 0 : shown === "boundaries" ? Math.min(0.25, at("opacity").value) : Number(at("opacity").value);
  at("split").hidden = !(step === 1 && shown === "materials" && view.labels?.after);
  view.split = shown === "boundaries" ? 0 : at("split").hidden ? 9 : Number(at("split").getAttribute("aria-valuenow")) / 100;
  at("tint").hidden = isMesh || shown === "picture";
  const rows = materials(), colors = rows.map((row) => (row.out ? null : row.color));
  view.setPalette(isMesh ? app.results.mesh.materials.map((row, k) => (fresh("segment") && colors[k]) || row.color) : colors);
  view.soon();
}

function shade(is) {
  app.view.shaded = is;
  app.view.draw();
}

function only(range) {
  app.view.range = range;
  app.view.draw();
}

function goTo(q) {
  at("show").value = "mesh";
  paint();
  app.view.goTo(q);
  tellHover(`scaled Jacobian ${app.results.mesh.arrays.jacobians[q].toFixed(3)}, ${app.results.mesh.materials[app.results.mesh.arrays.places[q]].name}`);
}

const tellHover = (text) => (at("hover").textContent = text);

function hover(event) {
  const { view } = app, box = at("screen").getBoundingClientRect();
  const [x, y] = view.toPicture(event.clientX - box.left, event.clientY - box.top), mesh = app.results.mesh;
  if (view.shown.quads && mesh) {
    const q = view.quadAt(x, y);
    return tellHover(q < 0 ? "" : `${mesh.materials[mesh.arrays.places[q]].name}, scaled Jacobian ${mesh.arrays.jacobians[q].toFixed(3)}`);
  }
  const place = view.placeAt(x, y), row = materials()[place];
  tellHover(row ? `${row.name}${row.out ? " (not meshed)" : ""}, pixel ${Math.floor(x)}, ${Math.floor(y)}` : place < 0 ? "" : "nothing");
}

// Steps

function go(to) {
  step = to;
  at("show").value = STEPS[step][3];
  if (STEPS[step][2] === "mesh" && !fresh("mesh")) meshNow();
  forget();
  at("panel").replaceChildren(...STEPS[step][1](app));
  at("panel").scrollTop = 0;
  paint();
  steps();
  work();
}

function makeSteps() {
  at("steps").replaceChildren(...STEPS.map(([name], k) => {
    const stale = h("span", { class: "stale", title: "out of date", hidden: true }, "↻", h("span", { class: "hidden" }, " out of date"));
    return h("li", {}, h("button", { type: "button", onclick: () => go(k), id: `step${k}` }, `${k + 1}`, h("span", {}, name), stale));
  }));
}

// In place: a button that is replaced loses the focus, and the click that is under way.
function steps() {
  STEPS.forEach(([, , stage], k) => {
    const button = at(`step${k}`), isCurrent = k === step && Boolean(picture);
    button.disabled = !picture;
    button.querySelector(".stale").hidden = !(k > 0 && app.results[stage] && !fresh(stage));
    if (isCurrent) button.setAttribute("aria-current", "step");
    else button.removeAttribute("aria-current");
  });
}

function changed() {
  refresh();
  at("undo").disabled = !canUndo();
  at("redo").disabled = !canRedo();
  if (!picture) return;
  paint();
  overlay();
  steps();
  tell();
  clearTimeout(changed.timer);
  changed.timer = setTimeout(work, 60);
}

// The same as text

async function tell() {
  if (tell.under) return void (tell.again = true);
  tell.under = true;
  try {
    const wanted = recipe(picture.name);
    texts = { ...(await api.askTexts(wanted)), properties: wanted.output.properties };
    at("text").textContent = texts[tab];
  } catch (error) {
    say(error.message);
  }
  tell.under = false;
  if (tell.again) {
    tell.again = false;
    tell();
  }
}

function setTab(name) {
  tab = name;
  for (const each of ["command", "python", "script"]) {
    at(`tab-${each}`).setAttribute("aria-selected", String(each === name));
    at(`tab-${each}`).tabIndex = each === name ? 0 : -1;
  }
  at("text").setAttribute("aria-labelledby", `tab-${name}`);
  at("text").textContent = texts[name] ?? "";
}

// Files

function save(blob, name) {
  const link = h("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

async function download(what) {
  while (running) await new Promise((resolve) => setTimeout(resolve, 50));
  try {
    for (const file of api.filesOf(...(await perform({ do: "write", what })))) save(file, file.name);
  } catch (error) {
    if (error.name !== "AbortError") say(error.message);
  }
  work(); // on what was changed meanwhile
}

function saveText(what) {
  const stem = picture.name.replace(/\.[^.]*$/, "");
  save(new Blob([texts[what]]), what === "properties" ? "properties.toml" : `${stem}.mlx`);
}

async function saveMarks() {
  save(await strokesAsPng(current().strokes, pictureSize()), "marks.png");
}

function say(text) {
  at("message").textContent = text;
  at("message").hidden = !text;
}

// Hands

function overlay() {
  if (app.view) drawStrokes(at("strokes"), step === 0 ? current().strokes : null, app.view);
}

function pointers() {
  const canvas = at("canvas"), held = new Map();
  let stroke = null;
  const place = (event) => {
    const box = at("screen").getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, place(event));
    const paints = step === 0 && current().strokes && !event.shiftKey && event.button === 0 && held.size === 1;
    stroke = paints ? { brush: app.brush, radius: app.radius, points: app.view.toPicture(...place(event)) } : null;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) return hover(event);
    const [was, now] = [held.get(event.pointerId), place(event)];
    const others = [...held].filter(([id]) => id !== event.pointerId).map(([, where]) => where);
    held.set(event.pointerId, now);
    if (others.length) {
      stroke = null;
      const apart = ([x, y]) => Math.hypot(x - others[0][0], y - others[0][1]);
      app.view.zoom(apart(now) / Math.max(apart(was), 1), ...others[0]);
    } else if (stroke) {
      stroke = { ...stroke, points: [...stroke.points, ...app.view.toPicture(...now)] };
      drawStrokes(at("strokes"), { ...current().strokes, list: [...current().strokes.list, stroke] }, app.view);
    } else app.view.pan(now[0] - was[0], now[1] - was[1]);
  });
  const up = (event) => {
    held.delete(event.pointerId);
    if (!stroke) return;
    const { strokes } = current(), painted = stroke;
    stroke = null;
    change({ strokes: { ...strokes, list: [...strokes.list, painted] } });
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    app.view.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...place(event));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
    if (event.key in moves) app.view.pan(...moves[event.key]);
    else if (event.key === "+" || event.key === "=") app.view.zoom(1.3);
    else if (event.key === "-") app.view.zoom(1 / 1.3);
    else if (event.key === "0") app.view.fit();
    else return;
    event.preventDefault();
  });
}

function splitting() {
  const split = at("split");
  const set = (share) => {
    const percent = Math.round(100 * Math.min(Math.max(share, 0), 1));
    split.setAttribute("aria-valuenow", percent);
    split.style.left = `${percent}%`;
    paint();
  };
  split.style.left = "50%";
  split.addEventListener("pointerdown", (event) => split.setPointerCapture(event.pointerId));
  split.addEventListener("pointermove", (event) => {
    const box = at("screen").getBoundingClientRect();
    if (split.hasPointerCapture(event.pointerId)) set((event.clientX - box.left) / box.width);
  });
  split.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -2, ArrowRight: 2, Home: -100, End: 100 }[event.key];
    if (by) set((Number(split.getAttribute("aria-valuenow")) + by) / 100), event.preventDefault();
  });
}

function dropping() {
  const over = (is) => at("screen").classList.toggle("over", is);
  addEventListener("dragover", (event) => (event.preventDefault(), over(true)));
  addEventListener("dragleave", () => over(false));
  addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    const [file] = event.dataTransfer.files;
    if (file) open(file, file.name);
  });
}

function buttons() {
  at("open").onclick = at("pick").onclick = () => at("file").click();
  at("file").onchange = () => at("file").files[0] && open(at("file").files[0], at("file").files[0].name);
  at("rock").onclick = async () => {
    try {
      const [file] = api.filesOf(...(await perform({ do: "rock" })));
      await open(file, file.name);
    } catch (error) {
      say(error.message);
    }
  };
  at("cancel").onclick = () => running?.abort();
  at("undo").onclick = undo;
  at("redo").onclick = redo;
  at("fit").onclick = () => app.view.fit();
  at("zoomin").onclick = () => app.view.zoom(1.4);
  at("zoomout").onclick = () => app.view.zoom(1 / 1.4);
  at("show").replaceChildren(...SHOW.map(([value, text]) => h("option", { value }, text)));
  at("show").onchange = at("opacity").oninput = paint;
  for (const name of ["command", "python", "script"]) at(`tab-${name}`).onclick = () => setTab(name);
  document.querySelector("[role=tablist]").addEventListener("keydown", (event) => {
    const names = ["command", "python", "script"], by = { ArrowLeft: 2, ArrowRight: 1 }[event.key];
    if (!by || !event.target.id.startsWith("tab-")) return;
    setTab(names[(names.indexOf(tab) + by) % 3]);
    at(`tab-${tab}`).focus();
  });
  at("copy").onclick = async () => {
    await navigator.clipboard.writeText(at("text").textContent);
    at("copy").textContent = "Copied";
    setTimeout(() => (at("copy").textContent = "Copy"), 1500);
  };
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || event.target.type === "text") return;
    event.preventDefault();
    (event.shiftKey ? redo : undo)();
  });
  addEventListener("change", settle);
  addEventListener("pagehide", api.close);
}

// The page is seen before its view is made, which takes most of the time.
const seen = () => new Promise((then) => requestAnimationFrame(() => setTimeout(then)));

async function start() {
  const [asked] = await Promise.allSettled([api.askOptions(), seen()]);
  try {
    app.view = new View(at("canvas"));
    app.view.listeners.push(overlay);
  } catch (error) {
    say(error.message);
  }
  buttons();
  dropping();
  splitting();
  if (app.view) pointers();
  onChange(changed);
  makeSteps();
  steps();
  history.replaceState(null, "", "/"); // the token has become a cookie
  try {
    if (asked.reason) throw asked.reason;
    const { options, given, learns } = asked.value;
    Object.assign(app, { declared: options, learns });
    if (given) await open(await api.givenPicture(), given);
  } catch (error) {
    say(error.message);
  }
  document.body.dataset.ready = "";
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.view?.draw());
globalThis.studio = app; // for tests and the curious
start();
