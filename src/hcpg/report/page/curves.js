// Learning curves, a panel per task: methods switched by the legend, read-out under the pointer or the arrow keys.

const BANDS = { deviation: "±1 SD", interval: "95 % interval", none: "None" };
const LINES = { own: "With the selector", bare: "Bare actor", both: "Both" };
const AWAY = 12;
const MARGIN = { left: 36, right: 14, top: 12, bottom: 28 };

function curvesSection(data) {
  const state = { hidden: new Set(), band: "deviation", lines: "own", seeds: false };
  const panels = data.tasks.map((task) => panel(data, task, state));
  const update = () => panels.forEach((each) => each.update());
  const chips = data.presets.map((look) => make("button", { type: "button", class: "chip", "aria-pressed": "true", onclick: (event) => {
    const shown = state.hidden.delete(look.preset) || !state.hidden.add(look.preset);
    event.currentTarget.setAttribute("aria-pressed", String(shown));
    update();
  } }, swatch(look), look.name));
  const seeds = make("button", { type: "button", class: "chip", "aria-pressed": "false", onclick: (event) => {
    state.seeds = !state.seeds;
    event.currentTarget.setAttribute("aria-pressed", String(state.seeds));
    update();
  } }, "Each seed");
  const pairs = (names) => Object.entries(names);
  return section("curves", "Learning curves",
    make("div", { class: "toolbar legend", role: "group", "aria-label": "Methods" }, chips),
    make("div", { class: "toolbar" }, choice("Band", pairs(BANDS), state.band, (value) => { state.band = value; update(); }),
      data.results.some((each) => each.bare) ? choice("Policy", pairs(LINES), state.lines, (value) => { state.lines = value; update(); }) : null, seeds),
    make("div", { class: "panels" }, panels.map((each) => each.node)),
    note("Success in percent over environment steps, means over seeds. The band is the sample SD over seeds, or the 95 % Wilson interval of all seeds' episodes together; a single seed has the latter. ",
      "Dashed: the bare actor of a method that has a selector. Point, or focus a panel and use the arrow keys, to read values."));
}

function panel(data, task, state) {
  const all = data.presets.map((look) => ({ look, result: data.results.find((each) => each.task === task.task && each.preset === look.preset) }))
    .filter(({ result }) => result);
  const steps = [...new Set(all.flatMap(({ result }) => [result.own, result.bare].filter(Boolean).flatMap((each) => each.steps)))].sort((a, b) => a - b);
  const picture = draw("svg", { class: "plot", "aria-hidden": "true" });
  const readout = make("div", { class: "readout", hidden: true });
  const spoken = make("p", { class: "unseen", "aria-live": "polite" });
  const stage = make("div", { class: "stage", tabindex: 0, role: "group", "aria-label": `Learning curves on ${task.name}; left and right arrow keys read values` }, picture, readout, spoken);
  const cursor = draw("g", { class: "cursor" });
  let inner = scales(400, steps.at(-1));
  let place = null;

  const shown = () => all.filter(({ look }) => !state.hidden.has(look.preset)).flatMap(({ look, result }) => [
    state.lines === "bare" && result.bare ? null : { look, curve: result.own, name: look.name },
    state.lines !== "own" && result.bare ? { look, curve: result.bare, name: `${look.name}, bare`, dashed: true } : null,
  ]).filter(Boolean);

  function point(next) {
    place = next;
    cursor.replaceChildren();
    readout.hidden = place === null;
    if (place === null) return;
    const step = steps[place];
    const rows = shown().map((each) => ({ ...each, at: each.curve.steps.indexOf(step) })).filter(({ at }) => at >= 0)
      .sort((a, b) => b.curve.mean[b.at] - a.curve.mean[a.at]);
    cursor.append(draw("line", { x1: inner.x(step), x2: inner.x(step), y1: inner.y(100), y2: inner.y(0) }),
      ...rows.map(({ look, curve, at }) => hued(draw("g", {}, marker(look, inner.x(step), inner.y(curve.mean[at]), 4.5)), look)));
    readout.replaceChildren(make("strong", {}, `${thousands(step)} steps`), make("table", {}, make("tbody", {}, rows.map(({ look, curve, at, name }) =>
      make("tr", {}, make("td", {}, swatch(look)), make("td", { class: "named" }, name), make("td", { class: "number" }, fixed(curve.mean[at])), make("td", { class: "number interval" }, spreadText(curve, at, state.band)))))));
    const right = inner.x(step) + AWAY, left = inner.x(step) - AWAY - readout.offsetWidth;
    readout.style.left = `${Math.max(0, right + readout.offsetWidth <= inner.width ? right : left)}px`;
    spoken.textContent = `${thousands(step)} steps: ${rows.map(({ curve, at, name }) => `${name} ${fixed(curve.mean[at])} percent`).join(", ")}`;
  }

  const nearest = (event) => {
    const frame = picture.getBoundingClientRect();
    const x = event.clientX - frame.left;
    return steps.reduce((best, step, index) => (Math.abs(inner.x(step) - x) < Math.abs(inner.x(steps[best]) - x) ? index : best), 0);
  };
  stage.addEventListener("pointermove", (event) => point(nearest(event)));
  stage.addEventListener("pointerdown", (event) => point(nearest(event)));
  stage.addEventListener("pointerleave", () => point(null));
  stage.addEventListener("blur", () => point(null));
  stage.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: (place ?? steps.length) - 1, ArrowRight: (place ?? -1) + 1, Home: 0, End: steps.length - 1 };
    if (event.key === "Escape") point(null);
    if (!(event.key in moves)) return;
    event.preventDefault();
    point(Math.min(Math.max(moves[event.key], 0), steps.length - 1));
  });

  const update = () => {
    picture.setAttribute("height", inner.height);
    picture.replaceChildren(axes(inner, steps.at(-1)), ...shown().map((each) => drawn(each, inner, state)), cursor);
    point(place);
  };
  update();
  // Drawn anew at every width, so that letters and lines keep their size.
  new ResizeObserver(([entry]) => {
    if (!entry.contentRect.width || entry.contentRect.width === inner.width) return;
    inner = scales(entry.contentRect.width, steps.at(-1));
    update();
  }).observe(stage);
  return { node: make("figure", { class: "card panel" }, make("figcaption", {}, taskCell(task)), stage), update };
}

function scales(width, last) {
  const height = Math.round(Math.min(Math.max(0.56 * width, 190), 360));
  return { width, height, x: (step) => MARGIN.left + (step / last) * (width - MARGIN.left - MARGIN.right),
    y: (rate) => MARGIN.top + (1 - rate / 100) * (height - MARGIN.top - MARGIN.bottom) };
}

function axes({ x, y, height }, last) {
  return draw("g", { class: "axes" },
    [0, 25, 50, 75, 100].map((rate) => [draw("line", { x1: x(0), x2: x(last), y1: y(rate), y2: y(rate), class: rate ? "grid" : "ground" }),
      draw("text", { x: x(0) - 8, y: y(rate) + 4, "text-anchor": "end" }, String(rate))]),
    [0, 0.25, 0.5, 0.75, 1].map((share) => draw("text", { x: x(share * last), y: height - 8, "text-anchor": share === 1 ? "end" : "middle" }, short(Math.round(share * last)))));
}

function drawn({ look, curve, dashed }, { x, y }, state) {
  const path = (values) => values.map((value, at) => `${at ? "L" : "M"}${x(curve.steps[at]).toFixed(1)},${y(value).toFixed(1)}`).join("");
  const [low, high] = band(curve, state.band);
  const area = low && `${path(high)}${path(low.slice()).split(/(?=[ML])/).reverse().join("").replaceAll("M", "L")}Z`;
  return hued(draw("g", { class: dashed ? "curve dashed" : "curve", "data-preset": look.preset },
    area ? draw("path", { d: area, class: "band" }) : null,
    state.seeds && curve.seeds.length > 1 ? curve.seeds.slice(0, 50).map((values) => draw("path", { d: path(values), class: "seed" })) : null,
    draw("path", { d: path(curve.mean), class: "stroke" }),
    curve.mean.map((value, at) => marker(look, x(curve.steps[at]), y(value), 2.6))), look);
}

// Lower and upper edge; one seed has no deviation, so it gets the interval of its episodes.
function band(curve, kind) {
  if (kind === "none") return [null, null];
  if (kind === "interval" || curve.deviation[0] === null) return [curve.low, curve.high];
  const edge = (sign) => curve.mean.map((value, at) => Math.min(100, Math.max(0, value + sign * curve.deviation[at])));
  return [edge(-1), edge(1)];
}

function spreadText(curve, at, kind) {
  if (kind === "none") return "";
  const single = curve.deviation[at] === null;
  return kind === "interval" || single ? `[${fixed(curve.low[at])}, ${fixed(curve.high[at])}]` : `± ${fixed(curve.deviation[at])}`;
}
