// What may be said of each method against the reference: intervals drawn around zero, and the sentence.

const VERDICTS = { better: "better", worse: "worse", undecided: "undecided" };

function contrastsSection(data) {
  const looks = looksOf(data);
  const names = namesOf(data);
  const reference = looks.get(data.reference).name;
  if (!data.contrasts.length) return null;
  const columns = [
    { name: "Task", value: (row) => names.get(row.task) },
    {
      name: "Method",
      value: (row) => looks.get(row.preset).name,
      cell: (row) => methodCell(looks.get(row.preset)),
    },
    {
      name: "Difference",
      number: true,
      title: `of the last evaluation's success to ${reference}, in points`,
      value: (row) => row.paired.estimate,
      cell: (row) => make("span", { class: "mean" }, signed(row.paired.estimate)),
    },
    {
      name: "−100 … 0 … +100",
      title: "Sort by the difference",
      value: (row) => row.paired.estimate,
      cell: (row) => forest(row),
    },
    {
      name: "95 % intervals",
      title: "paired: seeds and start states resampled; Newcombe: episodes taken as independent",
      value: (row) => row.paired.low,
      cell: (row) =>
        make(
          "dl",
          { class: "intervals" },
          make("dt", {}, "paired"),
          make("dd", {}, bounds(row.paired, signed)),
          make("dt", {}, "Newcombe"),
          make("dd", {}, bounds(row.independent, signed)),
        ),
    },
    {
      name: "Verdict",
      value: (row) => row.verdict,
      cell: (row) => make("span", { class: `verdict ${row.verdict}` }, VERDICTS[row.verdict]),
    },
    {
      name: "What may be said",
      value: (row) => row.conclusion,
      cell: (row) => make("span", { class: "sentence" }, row.conclusion),
    },
  ];
  return section(
    "differences",
    `Differences to ${reference}`,
    table({
      label: `Differences to ${reference}`,
      columns,
      rows: data.contrasts,
      filter: data.contrasts.length > 8,
    }),
    note(
      "Points of success at the last evaluation, on the same seeds and start states; right of zero the method ",
      "is better than ",
      reference,
      ". The wide bar is the paired 95 % interval (seeds and start states resampled), the thin line Newcombe's, ",
      "for which episodes are independent. What is decided here is decided for these start states; few seeds say ",
      "little of others.",
    ),
  );
}

function forest(row) {
  const x = (points) => 80 + 0.76 * points;
  return draw(
    "svg",
    {
      viewBox: "0 0 160 18",
      class: `forest ${row.verdict}`,
      role: "img",
      "aria-label": `${signed(row.paired.estimate)} points, ${bounds(row.paired, signed)}`,
    },
    draw("line", { x1: 4, x2: 156, y1: 9, y2: 9, class: "track" }),
    draw("line", { x1: 80, x2: 80, y1: 1, y2: 17, class: "zero" }),
    draw("line", { x1: x(row.independent.low), x2: x(row.independent.high), y1: 9, y2: 9, class: "thin" }),
    draw("rect", {
      x: x(row.paired.low),
      width: Math.max(x(row.paired.high) - x(row.paired.low), 1.5),
      y: 6,
      height: 6,
      rx: 2,
      class: "wide-bar",
    }),
    draw("circle", { cx: x(row.paired.estimate), cy: 9, r: 4, class: "dot" }),
  );
}
