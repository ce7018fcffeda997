// Small makers of elements. What must follow the state registers itself by `live`.

let updates = [];

export function live(update) {
  updates.push(update);
  update();
}
export const refresh = () => updates.forEach((update) => update());
export const forget = () => (updates = []);

// h("p", { class: "note" }, "text", element): attributes, `on…` listeners, children.
export function h(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value != null) made.setAttribute(name, value);
  }
  made.append(...children.flat().filter((child) => child != null));
  return made;
}

export const button = (text, onclick, attributes = {}) => h("button", { type: "button", onclick, ...attributes }, text);

// Puts a value into an input, unless the user is at it.
export function put(input, value) {
  if (document.activeElement !== input || input.type === "range" || input.type === "select-one") input.value = value ?? "";
}

export function choice(label, id, choices, get, set) {
  const select = h("select", { id, onchange: () => set(select.value) }, choices.map(([value, text]) => h("option", { value }, text)));
  live(() => put(select, get()));
  return h("div", { class: "field" }, h("label", { for: id }, label), select);
}

// A slider and a number; `automatic` is what the studio chose where the user has not.
export function slide(label, id, [min, max, step], get, set, automatic = null) {
  const own = (input) => set(Number(input.value), id);
  const range = h("input", { type: "range", id, min, max, step, oninput: () => own(range) });
  const number = h("input", { type: "number", min: 0, step: "any", "aria-label": `${label}: number`, onchange: () => number.value !== "" && own(number) });
  const auto = automatic && button("automatic", () => set(undefined), { id: `${id}-auto` });
  live(() => {
    const value = get() ?? automatic?.() ?? "";
    put(range, value);
    put(number, value === "" ? "" : Math.round(value * 100) / 100);
    auto?.setAttribute("aria-pressed", String(get() === undefined));
  });
  return h("div", { class: "slide" }, h("label", { for: id }, label), range, number, auto);
}

// A field for any declared option.
export function field(name, { kind, choices, help, default: usual, least, most }, get, set) {
  const id = `option-${name}`, label = h("label", { for: id }, name.replaceAll("_", " "));
  let input;
  if (choices.length) {
    input = h("select", { id, onchange: () => set(name, input.value === usual ? "" : typed(input.value)) }, choices.map((each) => h("option", { value: each }, String(each))));
    const typed = (text) => choices.find((each) => String(each) === text);
    live(() => put(input, get(name) ?? usual));
  } else if (kind === "bool") {
    input = h("input", { id, type: "checkbox", onchange: () => set(name, input.checked || "") });
    live(() => (input.checked = Boolean(get(name))));
  } else {
    const isNumber = kind === "int" || kind === "float";
    const limits = isNumber ? { type: "number", step: kind === "int" ? 1 : "any", min: least, max: most } : { type: "text" };
    input = h("input", { id, ...limits, placeholder: usual || "none", onchange: () => set(name, isNumber && input.value !== "" ? Number(input.value) : input.value) });
    live(() => put(input, get(name)));
  }
  return h("div", { class: "field" }, label, input, h("small", {}, help));
}
