// The paper's table with the seeds behind each number, the methods over all tasks, and every number there is.

const METRICS = {
  last_five: ["Last five", "mean of the last five evaluations"],
  auc: ["AUC", "area under the curve over the normalised budget"],
  final: ["Last evaluation", "the last evaluation alone"],
};
const POLICIES = { own: "With the selector", bare: "Bare actor" };

// A preset without a selector is bare in either case.
const policy = (result, kind) => (kind === "bare" ? result.bare ?? result.own : result.own);

function resultsSection(data) {
  const state = { metric: "last_five", policy: "own" };
  const place = make("div");
  const update = () => place.replaceChildren(mainTable(data, state.metric, state.policy));
  update();
  return section("results", "Results",
    make("div", { class: "toolbar" },
      choice("Metric", Object.entries(METRICS).map(([key, [name]]) => [key, name]), state.metric, (value) => { state.metric = value; update(); }),
      data.results.some((each) => each.bare) ? choice("Policy", Object.entries(POLICIES), state.policy, (value) => { state.policy = value; update(); }) : null),
    place,
    note("Success (", make("code", {}, "success_once"), ") in percent: mean over seeds ± sample SD over seeds; in the last row, mean of the tasks' means ± SD over tasks. ",
      "Each dot is a seed, the tick their mean. A SD is no confidence interval: differences with intervals are ", make("a", { href: "#differences" }, "below"), "."),
    make("h3", {}, "Over all tasks"), acrossTable(data),
    make("h3", {}, "Every number"), numbersTable(data));
}

function mainTable(data, metric, kind) {
  const cells = new Map(data.results.map((each) => [`${each.task}\n${each.preset}`, policy(each, kind)[metric]]));
  const at = (row, preset) => cells.get(`${row.task}\n${preset}`);
  const best = (row) => top(data.presets.map(({ preset }) => at(row, preset)).filter(Boolean));
  const columns = [{ name: "Task", value: (row) => row.name, cell: taskCell }, ...data.presets.map((look) => ({
    name: look.name, number: true, mark: () => swatch(look), value: (row) => at(row, look.preset)?.mean,
    cell: (row) => (row.foot ? row.cells.get(look.preset) : resultCell(at(row, look.preset), look, best(row))) ?? ABSENT,
  }))];
  const whole = Object.entries(data.task_means[kind][metric]);
  const highest = top(whole.map(([, each]) => each));
  const foot = { foot: true, name: "Across tasks", cells: new Map(whole.map(([preset, each]) => [preset, numberCell(each, +fixed(each.mean) === highest)])) };
  return table({ label: `${METRICS[metric][0]}, ${POLICIES[kind].toLowerCase()}`, columns, rows: data.tasks, foot: data.tasks.length > 1 ? [foot] : [] });
}

// The best printed mean, where there are several.
const top = (several) => (several.length > 1 ? Math.max(...several.map((each) => +fixed(each.mean))) : null);
const taskCell = (row) => [row.name, row.suite ? [" ", make("span", { class: "suite" }, row.suite)] : null];
const numberCell = (each, isBest) => make("span", { class: isBest ? "value best" : "value" },
  make("span", { class: "mean" }, fixed(each.mean)), each.deviation === null ? null : make("span", { class: "deviation" }, ` ± ${fixed(each.deviation)}`));

function resultCell(each, look, best) {
  return each ? make("div", { class: "result" }, numberCell(each, +fixed(each.mean) === best), strip(each, look)) : null;
}

// From 0 to 100: a dot per seed (at most fifty), a tick at the mean.
function strip(each, look) {
  const x = (value) => `${4 + 0.92 * value}%`;
  return hued(draw("svg", { class: "strip", "aria-hidden": "true" },
    draw("line", { x1: x(0), x2: x(100), y1: 6, y2: 6, class: "track" }),
    each.values.slice(0, 50).map((value) => draw("circle", { cx: x(value), cy: 6, r: 3, class: "dot" })),
    draw("line", { x1: x(each.mean), x2: x(each.mean), y1: 1, y2: 11, class: "tick" })), look);
}

function acrossTable(data) {
  const looks = new Map(data.presets.map((each) => [each.preset, each]));
  const name = looks.get(data.reference).name;
  const columns = [
    { name: "Method", value: (row) => looks.get(row.preset).name, cell: (row) => methodCell(looks.get(row.preset)) },
    { name: "Tasks", number: true, value: (row) => row.tasks },
    { name: "Mean ± SD", number: true, title: "of the tasks' means; SD over tasks", value: (row) => row.mean?.mean, cell: (row) => (row.mean ? withDeviation(row.mean) : ABSENT) },
    { name: "Interquartile mean", number: true, title: "of all tasks' seeds, 95 % interval by stratified bootstrap", value: (row) => row.middle?.estimate, cell: (row) => estimateCell(row.middle) },
    { name: `Beats ${name}`, number: true, title: "probability that a run is better, 95 % interval; a tie counts half", value: (row) => row.improvement?.estimate, cell: (row) => estimateCell(row.improvement, " %") },
    { name: "Collapsed", number: true, title: "runs that reached 80 % and later fell below 50 %", value: (row) => row.collapsed[0], cell: (row) => `${row.collapsed[0]} of ${row.collapsed[1]}` },
  ];
  return make("div", {}, table({ label: "Methods over all tasks", columns, rows: data.across }),
    note("Last five, in percent. Brackets are 95 % intervals: of the interquartile mean and of the probability that a run beats one of ", name, " on the same task, from seeds resampled within each task."));
}

const methodCell = (look) => make("span", { class: "method" }, swatch(look), look.name);
const estimateCell = (each, unit = "") => (each ? make("span", {}, `${fixed(each.estimate)}${unit} `, make("span", { class: "interval" }, `[${fixed(each.low)}, ${fixed(each.high)}]`)) : ABSENT);

function numbersTable(data) {
  const looks = new Map(data.presets.map((each) => [each.preset, each]));
  const names = new Map(data.tasks.map((each) => [each.task, each.name]));
  const rows = data.results.flatMap((each) => ["own", "bare"].filter((kind) => each[kind]).map((kind) => ({ ...each, at: each[kind], kind })));
  const selector = (row) => (row.kind === "bare" || !row.selector ? "bare" : row.selector);
  const spreadOf = (metric) => ({ name: METRICS[metric][0], number: true, title: METRICS[metric][1], value: (row) => row.at[metric].mean, cell: (row) => withDeviation(row.at[metric]) });
  const columns = [
    { name: "Task", value: (row) => names.get(row.task) },
    { name: "Method", value: (row) => `${looks.get(row.preset).name} ${selector(row)}`, cell: (row) => [methodCell(looks.get(row.preset)), " ", make("span", { class: "suite" }, selector(row))] },
    spreadOf("last_five"), spreadOf("auc"), spreadOf("final"),
    { name: "Episodes", number: true, title: "of the last evaluation, all seeds, with the 95 % Wilson interval of their rate", value: (row) => row.at.final.successes / row.at.final.episodes,
      cell: (row) => [`${row.at.final.successes}/${row.at.final.episodes} `, make("span", { class: "interval" }, `[${fixed(row.at.final.low)}, ${fixed(row.at.final.high)}]`)] },
    { name: "Steps to 80 %", number: true, ascending: true, title: "first evaluation of at least 80 %, each seed", value: (row) => mean(row.at.reached.filter((step) => step !== null)), cell: (row) => brief(row.at.reached.map((step) => (step === null ? ABSENT : short(step)))) },
    { name: "Collapsed", number: true, title: "seeds that reached 80 % and later fell below 50 %", value: (row) => row.at.collapsed, cell: (row) => `${row.at.collapsed} of ${row.seeds.length}` },
    { name: "Hours", number: true, title: "training time of a run, mean over seeds", value: (row) => row.hours, cell: (row) => fixed(row.hours, 2) },
  ];
  return table({ label: "Every number", columns, rows, filter: rows.length > 8 });
}

const brief = (values) => (values.length <= 6 ? values.join(" ") : `${values.slice(0, 5).join(" ")} … (${values.length})`);
