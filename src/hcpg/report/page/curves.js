// Learning curves, a panel per task: methods switched by the legend, values read by pointer or arrow keys.

const BANDS = { deviation: "±1 SD", interval: "95 % interval", none: "None" };
const LINES = { own: "With the selector", bare: "Bare actor", both: "Both" };
const MARGIN = { left: 36, right: 14, top: 12, bottom: 28 };
const AWAY = 12;

function curvesSection(data) {
  const state = { hidden: new Set(), band: "deviation", lines: "own", seeds: false };
  const panels = data.tasks.map((task) => new Panel(data, task, state));
  const update = () => panels.forEach((panel) => panel.update());
  const set = (name) => (value) => {
    state[name] = value;
    update();
  };
  const guided = data.results.some((result) => result.bare);
  return section(
    "curves",
    "Learning curves",
    make(
      "div",
      { class: "toolbar legend", role: "group", "aria-label": "Methods" },
      legend(data, state, update),
    ),
    make(
      "div",
      { class: "toolbar" },
      choice("Band", Object.entries(BANDS), state.band, set("band")),
      guided ? choice("Policy", Object.entries(LINES), state.lines, set("lines")) : null,
      chip("Each seed", false, set("seeds")),
    ),
    make(
      "div",
      { class: "panels" },
      panels.map((panel) => panel.node),
    ),
    note(
      "Success in percent over environment steps, means over seeds. The band is the sample SD over seeds, or the ",
      "95 % Wilson interval of all seeds' episodes together; a single seed has the latter. Dashed: the bare actor ",
      "of a method that has a selector. Point, or focus a panel and use the arrow keys, to read values.",
    ),
  );
}

function legend(data, state, update) {
  return data.presets.map((look) =>
    chip([swatch(look), look.name], true, (shown) => {
      if (shown) state.hidden.delete(look.preset);
      else state.hidden.add(look.preset);
      update();
    }),
  );
}

// A button that stays pressed until it is pressed again.
function chip(content, pressed, tell) {
  const toggle = (event) => {
    pressed = !pressed;
    event.currentTarget.setAttribute("aria-pressed", String(pressed));
    tell(pressed);
  };
  return make(
    "button",
    { type: "button", class: "chip", "aria-pressed": String(pressed), onclick: toggle },
    content,
  );
}

class Panel {
  constructor(data, task, state) {
    this.state = state;
    this.methods = data.presets
      .map((look) => ({
        look,
        result: data.results.find((each) => each.task === task.task && each.preset === look.preset),
      }))
      .filter(({ result }) => result);
    const curves = this.methods.flatMap(({ result }) => [result.own, result.bare].filter(Boolean));
    this.steps = [...new Set(curves.flatMap((curve) => curve.steps))].sort((a, b) => a - b);
    this.place = null; // which step is read
    this.scales = scales(400, this.steps.at(-1));
    this.picture = draw("svg", { class: "plot", "aria-hidden": "true" });
    this.cursor = draw("g", { class: "cursor" });
    this.readout = make("div", { class: "readout", hidden: true });
    this.spoken = make("p", { class: "unseen", "aria-live": "polite" });
    const label = `Learning curves on ${task.name}; left and right arrow keys read values`;
    const stage = make(
      "div",
      { class: "stage", tabindex: 0, role: "group", "aria-label": label },
      this.picture,
      this.readout,
      this.spoken,
    );
    this.node = make("figure", { class: "card panel" }, make("figcaption", {}, taskCell(task)), stage);
    this.listen(stage);
    this.update();
  }

  listen(stage) {
    for (const moved of ["pointermove", "pointerdown"])
      stage.addEventListener(moved, (event) => this.read(this.nearest(event)));
    for (const left of ["pointerleave", "blur"]) stage.addEventListener(left, () => this.read(null));
    stage.addEventListener("keydown", (event) => this.press(event));
    // Drawn anew at every width, so that letters and lines keep their size.
    new ResizeObserver(([{ contentRect }]) => {
      if (!contentRect.width || contentRect.width === this.scales.width) return;
      this.scales = scales(contentRect.width, this.steps.at(-1));
      this.update();
    }).observe(stage);
  }

  update() {
    this.picture.setAttribute("height", this.scales.height);
    const lines = this.shown().map((line) => drawn(line, this.scales, this.state));
    this.picture.replaceChildren(axes(this.scales, this.steps.at(-1)), ...lines, this.cursor);
    this.read(this.place);
  }

  // The lines that legend and policy leave: look, curve, name, dashed.
  shown() {
    const { hidden, lines } = this.state;
    return this.methods
      .filter(({ look }) => !hidden.has(look.preset))
      .flatMap(({ look, result }) => {
        const own = { look, curve: result.own, name: look.name };
        if (!result.bare || lines === "own") return [own];
        const bare = { look, curve: result.bare, name: `${look.name}, bare`, dashed: true };
        return lines === "bare" ? [bare] : [own, bare];
      });
  }

  nearest(event) {
    const x = event.clientX - this.picture.getBoundingClientRect().left;
    const away = this.steps.map((step) => Math.abs(this.scales.x(step) - x));
    return away.indexOf(Math.min(...away));
  }

  press(event) {
    const last = this.steps.length - 1;
    const places = {
      ArrowLeft: (this.place ?? last + 1) - 1,
      ArrowRight: (this.place ?? -1) + 1,
      Home: 0,
      End: last,
    };
    if (event.key === "Escape") this.read(null);
    if (!(event.key in places)) return;
    event.preventDefault();
    this.read(Math.min(Math.max(places[event.key], 0), last));
  }

  // Show the values at a step, or none.
  read(place) {
    this.place = place;
    this.cursor.replaceChildren();
    this.readout.hidden = place === null;
    if (place === null) return;
    const step = this.steps[place];
    const lines = this.shown()
      .map((line) => ({ ...line, at: line.curve.steps.indexOf(step) }))
      .filter(({ at }) => at >= 0)
      .sort((a, b) => b.curve.mean[b.at] - a.curve.mean[a.at]);
    this.mark(step, lines);
    const rows = lines.map((line) => readoutRow(line, this.state.band));
    this.readout.replaceChildren(
      make("strong", {}, `${thousands(step)} steps`),
      make("table", {}, make("tbody", {}, rows)),
    );
    const width = this.readout.offsetWidth;
    const right = this.scales.x(step) + AWAY;
    const left = this.scales.x(step) - AWAY - width;
    this.readout.style.left = `${Math.max(0, right + width <= this.scales.width ? right : left)}px`;
    const values = lines.map(({ name, curve, at }) => `${name} ${fixed(curve.mean[at])} percent`);
    this.spoken.textContent = `${thousands(step)} steps: ${values.join(", ")}`;
  }

  mark(step, lines) {
    const { x, y } = this.scales;
    const marks = lines.map(({ look, curve, at }) =>
      hued(draw("g", {}, marker(look, x(step), y(curve.mean[at]), 4.5)), look),
    );
    this.cursor.append(draw("line", { x1: x(step), x2: x(step), y1: y(100), y2: y(0) }), ...marks);
  }
}

function readoutRow({ look, curve, at, name }, kind) {
  return make(
    "tr",
    {},
    make("td", {}, swatch(look)),
    make("td", { class: "named" }, name),
    make("td", { class: "number" }, fixed(curve.mean[at])),
    make("td", { class: "number interval" }, spreadText(curve, at, kind)),
  );
}

function scales(width, last) {
  const height = Math.round(Math.min(Math.max(0.56 * width, 190), 360));
  const x = (step) => MARGIN.left + (step / last) * (width - MARGIN.left - MARGIN.right);
  const y = (rate) => MARGIN.top + (1 - rate / 100) * (height - MARGIN.top - MARGIN.bottom);
  return { width, height, x, y };
}

function axes({ x, y, height }, last) {
  const levels = [0, 25, 50, 75, 100].map((rate) => [
    draw("line", { x1: x(0), x2: x(last), y1: y(rate), y2: y(rate), class: rate ? "grid" : "ground" }),
    draw("text", { x: x(0) - 8, y: y(rate) + 4, "text-anchor": "end" }, String(rate)),
  ]);
  const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) => {
    const place = { x: x(share * last), y: height - 8, "text-anchor": share === 1 ? "end" : "middle" };
    return draw("text", place, short(Math.round(share * last)));
  });
  return draw("g", { class: "axes" }, levels, ticks);
}

function drawn({ look, curve, dashed }, { x, y }, state) {
  const points = (values) =>
    values.map((value, at) => `${x(curve.steps[at]).toFixed(1)},${y(value).toFixed(1)}`);
  const path = (places) => `M${places.join("L")}`;
  const [low, high] = band(curve, state.band);
  const area = low && `${path([...points(high), ...points(low).reverse()])}Z`;
  const seeds = state.seeds && curve.seeds.length > 1 ? curve.seeds.slice(0, MOST_SEEDS) : [];
  return hued(
    draw(
      "g",
      { class: dashed ? "curve dashed" : "curve", "data-preset": look.preset },
      area ? draw("path", { d: area, class: "band" }) : null,
      seeds.map((values) => draw("path", { d: path(points(values)), class: "seed" })),
      draw("path", { d: path(points(curve.mean)), class: "stroke" }),
      curve.mean.map((value, at) => marker(look, x(curve.steps[at]), y(value), 2.6)),
    ),
    look,
  );
}

// Lower and upper edge; one seed has no deviation, so it gets the interval of its episodes.
function band(curve, kind) {
  if (kind === "none") return [null, null];
  if (kind === "interval" || curve.deviation[0] === null) return [curve.low, curve.high];
  const within = (value) => Math.min(100, Math.max(0, value));
  return [-1, 1].map((sign) => curve.mean.map((value, at) => within(value + sign * curve.deviation[at])));
}

function spreadText(curve, at, kind) {
  if (kind === "none") return "";
  if (kind === "interval" || curve.deviation[at] === null)
    return `[${fixed(curve.low[at])}, ${fixed(curve.high[at])}]`;
  return `± ${fixed(curve.deviation[at])}`;
}
