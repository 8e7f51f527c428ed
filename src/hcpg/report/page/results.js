// The paper's table, with the seeds behind each number.

const METRICS = {
  last_five: ["Last five", "mean of the last five evaluations"],
  auc: ["AUC", "area under the curve over the normalised budget"],
  final: ["Last evaluation", "the last evaluation alone"],
};
const MOST_SEEDS = 50;
const POLICIES = { own: "With the selector", bare: "Bare actor" };

// A preset without a selector is bare in either case.
const policy = (result, kind) => (kind === "bare" ? (result.bare ?? result.own) : result.own);

function resultsSection(data) {
  const state = { metric: "last_five", policy: "own" };
  const place = make("div");
  const update = () => place.replaceChildren(mainTable(data, state.metric, state.policy));
  update();
  return section(
    "results",
    "Results",
    make(
      "div",
      { class: "toolbar" },
      choice(
        "Metric",
        Object.entries(METRICS).map(([key, [name]]) => [key, name]),
        state.metric,
        (value) => {
          state.metric = value;
          update();
        },
      ),
      data.results.some((each) => each.bare)
        ? choice("Policy", Object.entries(POLICIES), state.policy, (value) => {
            state.policy = value;
            update();
          })
        : null,
    ),
    place,
    note(
      "Success (",
      make("code", {}, "success_once"),
      ") in percent: mean over seeds ± sample SD over seeds; in the last row, mean of the tasks' means ± SD over ",
      "tasks. Each dot is a seed, the tick their mean. A SD is no confidence interval: differences with ",
      "intervals are ",
      make("a", { href: "#differences" }, "below"),
      ".",
    ),
    make("h3", {}, "Over all tasks"),
    acrossTable(data),
    make("h3", {}, "Every number"),
    numbersTable(data),
  );
}

function mainTable(data, metric, kind) {
  const cells = new Map(
    data.results.map((each) => [`${each.task}\n${each.preset}`, policy(each, kind)[metric]]),
  );
  const at = (row, preset) => cells.get(`${row.task}\n${preset}`);
  const best = (row) => top(data.presets.map(({ preset }) => at(row, preset)).filter(Boolean));
  const columns = [
    { name: "Task", value: (row) => row.name, cell: taskCell },
    ...data.presets.map((look) => ({
      name: look.name,
      number: true,
      mark: () => swatch(look),
      value: (row) => at(row, look.preset)?.mean,
      cell: (row) =>
        (row.foot ? row.cells.get(look.preset) : resultCell(at(row, look.preset), look, best(row))) ?? ABSENT,
    })),
  ];
  const whole = Object.entries(data.task_means[kind][metric]);
  const highest = top(whole.map(([, each]) => each));
  const foot = {
    foot: true,
    name: "Across tasks",
    cells: new Map(whole.map(([preset, each]) => [preset, numberCell(each, +fixed(each.mean) === highest)])),
  };
  return table({
    label: `${METRICS[metric][0]}, ${POLICIES[kind].toLowerCase()}`,
    columns,
    rows: data.tasks,
    foot: data.tasks.length > 1 ? [foot] : [],
  });
}

// The best printed mean, where there are several.
const top = (several) => (several.length > 1 ? Math.max(...several.map((each) => +fixed(each.mean))) : null);
const taskCell = (row) => [row.name, row.suite ? [" ", make("span", { class: "suite" }, row.suite)] : null];
const numberCell = (each, isBest) =>
  make(
    "span",
    { class: isBest ? "value best" : "value" },
    make("span", { class: "mean" }, fixed(each.mean)),
    each.deviation === null ? null : make("span", { class: "deviation" }, ` ± ${fixed(each.deviation)}`),
  );

function resultCell(each, look, best) {
  return each
    ? make("div", { class: "result" }, numberCell(each, +fixed(each.mean) === best), strip(each, look))
    : null;
}

// From 0 to 100: a dot per seed, of the first fifty, a tick at the mean.
function strip(each, look) {
  const x = (value) => `${4 + 0.92 * value}%`;
  return hued(
    draw(
      "svg",
      { class: "strip", "aria-hidden": "true" },
      draw("line", { x1: x(0), x2: x(100), y1: 6, y2: 6, class: "track" }),
      each.values
        .slice(0, MOST_SEEDS)
        .map((value) => draw("circle", { cx: x(value), cy: 6, r: 3, class: "dot" })),
      draw("line", { x1: x(each.mean), x2: x(each.mean), y1: 1, y2: 11, class: "tick" }),
    ),
    look,
  );
}
