// The methods over all tasks, and every number there is.

function acrossTable(data) {
  const looks = looksOf(data);
  const name = looks.get(data.reference).name;
  const columns = [
    {
      name: "Method",
      value: (row) => looks.get(row.preset).name,
      cell: (row) => methodCell(looks.get(row.preset)),
    },
    { name: "Tasks", number: true, value: (row) => row.tasks },
    {
      name: "Mean ± SD",
      number: true,
      title: "of the tasks' means; SD over tasks",
      value: (row) => row.mean?.mean,
      cell: (row) => (row.mean ? withDeviation(row.mean) : ABSENT),
    },
    {
      name: "Interquartile mean",
      number: true,
      title: "of all tasks' seeds, 95 % interval by stratified bootstrap",
      value: (row) => row.middle?.estimate,
      cell: (row) => estimateCell(row.middle),
    },
    {
      name: `Beats ${name}`,
      number: true,
      title: "probability that a run is better, 95 % interval; a tie counts half",
      value: (row) => row.improvement?.estimate,
      cell: (row) => estimateCell(row.improvement, " %"),
    },
    {
      name: "Collapsed",
      number: true,
      title: "runs that reached 80 % and later fell below 50 %",
      value: (row) => row.collapsed[0],
      cell: (row) => `${row.collapsed[0]} of ${row.collapsed[1]}`,
    },
  ];
  return make(
    "div",
    {},
    table({ label: "Methods over all tasks", columns, rows: data.across }),
    note(
      "Last five, in percent. Brackets are 95 % intervals: of the interquartile mean and of the probability that ",
      "a run beats one of ",
      name,
      " on the same task, from seeds resampled within each task.",
    ),
  );
}

const methodCell = (look) => make("span", { class: "method" }, swatch(look), look.name);
const estimateCell = (each, unit = "") =>
  each
    ? make(
        "span",
        {},
        `${fixed(each.estimate)}${unit} `,
        make("span", { class: "interval" }, `[${fixed(each.low)}, ${fixed(each.high)}]`),
      )
    : ABSENT;

function numbersTable(data) {
  const rows = data.results.flatMap((each) =>
    ["own", "bare"].filter((kind) => each[kind]).map((kind) => ({ ...each, at: each[kind], kind })),
  );
  const columns = [
    ...namingColumns(data),
    ...["last_five", "auc", "final"].map(metricColumn),
    ...OTHER_COLUMNS,
  ];
  return table({ label: "Every number", columns, rows, filter: rows.length > 8 });
}

function namingColumns(data) {
  const looks = looksOf(data);
  const names = namesOf(data);
  const selector = (row) => (row.kind === "bare" || !row.selector ? "bare" : row.selector);
  const cell = (row) => [
    methodCell(looks.get(row.preset)),
    " ",
    make("span", { class: "suite" }, selector(row)),
  ];
  return [
    { name: "Task", value: (row) => names.get(row.task) },
    { name: "Method", value: (row) => `${looks.get(row.preset).name} ${selector(row)}`, cell },
  ];
}

const metricColumn = (metric) => ({
  name: METRICS[metric][0],
  number: true,
  title: METRICS[metric][1],
  value: (row) => row.at[metric].mean,
  cell: (row) => withDeviation(row.at[metric]),
});

const OTHER_COLUMNS = [
  {
    name: "Episodes",
    number: true,
    title: "of the last evaluation, all seeds, with the 95 % Wilson interval of their rate",
    value: (row) => row.at.final.successes / row.at.final.episodes,
    cell: (row) => [
      `${row.at.final.successes}/${row.at.final.episodes} `,
      make("span", { class: "interval" }, `[${fixed(row.at.final.low)}, ${fixed(row.at.final.high)}]`),
    ],
  },
  {
    name: "Steps to 80 %",
    number: true,
    ascending: true,
    title: "first evaluation of at least 80 %, each seed",
    value: (row) => mean(row.at.reached.filter((step) => step !== null)),
    cell: (row) => brief(row.at.reached.map((step) => (step === null ? ABSENT : short(step)))),
  },
  {
    name: "Collapsed",
    number: true,
    title: "seeds that reached 80 % and later fell below 50 %",
    value: (row) => row.at.collapsed,
    cell: (row) => `${row.at.collapsed} of ${row.seeds.length}`,
  },
  {
    name: "Hours",
    number: true,
    title: "training time of a run, mean over seeds",
    value: (row) => row.hours,
    cell: (row) => fixed(row.hours, 2),
  },
];

const brief = (values) =>
  values.length <= 6 ? values.join(" ") : `${values.slice(0, 5).join(" ")} … (${values.length})`;
