"use strict";
// Elements and number formats. Text becomes text nodes only; no markup is ever made from data.

const SVG = "http://www.w3.org/2000/svg";
const ABSENT = "–";

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, String(value));
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

const make = (tag, attributes = {}, ...children) => fill(document.createElement(tag), attributes, children);
const draw = (tag, attributes = {}, ...children) =>
  fill(document.createElementNS(SVG, tag), attributes, children);

// The preset's colour, for `color: light-dark(...)` in the style sheet.
function hued(node, look) {
  node.classList.add("hued");
  node.style.setProperty("--on-white", look.on_white);
  node.style.setProperty("--on-black", look.on_black);
  return node;
}

const fixed = (value, digits = 1) => (value === null || value === undefined ? ABSENT : value.toFixed(digits));
const signed = (value, digits = 1) =>
  value === null ? ABSENT : (value > 0 ? "+" : value < 0 ? "−" : "") + Math.abs(value).toFixed(digits);
const thousands = (value) => (value === null || value === undefined ? ABSENT : value.toLocaleString("en-US"));
const short = (steps) =>
  steps >= 1e6
    ? `${+(steps / 1e6).toFixed(2)}M`
    : steps >= 1000
      ? `${+(steps / 1000).toFixed(1)}k`
      : String(steps);
const withDeviation = (each) =>
  each.deviation === null ? fixed(each.mean) : `${fixed(each.mean)} ± ${fixed(each.deviation)}`;
const counted = (count, one, several) => `${thousands(count)} ${count === 1 ? one : several}`;
const bounds = (each, form = fixed) => `${form(each.low)} to ${form(each.high)}`;
const mean = (values) =>
  values.length ? values.reduce((sum, value) => sum + value, 0) / values.length : null;

const SHAPES = {
  circle: (r) => `M${-r},0a${r},${r} 0 1,0 ${2 * r},0a${r},${r} 0 1,0 ${-2 * r},0Z`,
  square: (r) => `M${-r},${-r}H${r}V${r}H${-r}Z`,
  up: (r) => `M0,${-1.2 * r}L${1.1 * r},${0.9 * r}H${-1.1 * r}Z`,
  down: (r) => `M0,${1.2 * r}L${1.1 * r},${-0.9 * r}H${-1.1 * r}Z`,
  diamond: (r) => `M0,${-1.35 * r}L${1.35 * r},0L0,${1.35 * r}L${-1.35 * r},0Z`,
  cross: (r) => `M${-r},${-r}L${r},${r}M${r},${-r}L${-r},${r}`,
};
const marker = (look, x, y, r = 3) =>
  draw("path", { d: SHAPES[look.shape](r), transform: `translate(${x},${y})`, class: `mark ${look.shape}` });

function swatch(look) {
  return hued(
    draw(
      "svg",
      { viewBox: "0 0 22 12", width: 22, height: 12, "aria-hidden": "true" },
      draw("line", { x1: 1, x2: 21, y1: 6, y2: 6, class: "stroke" }),
      marker(look, 11, 6, 3.6),
    ),
    look,
  );
}

// A row of buttons of which one is pressed; tells its value.
function choice(label, options, chosen, tell) {
  const buttons = options.map(([value, name]) =>
    make(
      "button",
      {
        type: "button",
        "aria-pressed": String(value === chosen),
        onclick: () => {
          buttons.forEach((button, place) =>
            button.setAttribute("aria-pressed", String(options[place][0] === value)),
          );
          tell(value);
        },
      },
      name,
    ),
  );
  return make(
    "div",
    { class: "choice", role: "group", "aria-label": label },
    make("span", { class: "label" }, label),
    make("span", { class: "buttons" }, buttons),
  );
}

function section(id, title, ...children) {
  return make(
    "section",
    { id, "aria-labelledby": `${id}-title` },
    make("h2", { id: `${id}-title` }, title),
    children,
  );
}
const note = (...children) => make("p", { class: "note" }, children);
const folded = (title, build) => {
  const box = make("details", {}, make("summary", {}, title));
  // Long tables are built when somebody looks.
  box.addEventListener("toggle", () => {
    if (box.open && box.childElementCount === 1) box.append(build());
  });
  return box;
};

const looksOf = (data) => new Map(data.presets.map((look) => [look.preset, look]));
const namesOf = (data) => new Map(data.tasks.map(({ task, name }) => [task, name]));
