// Settings in which the methods differ, and where every run comes from.

function settingsSection(data) {
  const columns = [
    { name: "Setting", value: (row) => row.key, cell: (row) => make("code", {}, row.key) },
    ...data.presets.map((look, place) => ({
      name: look.name,
      mark: () => swatch(look),
      value: (row) => row.values[place],
      cell: (row) => settingCell(row.values, place),
    })),
  ];
  const alike = Object.entries(data.settings.alike);
  const rows = data.settings.differing;
  return section(
    "settings",
    "What differs between the methods",
    rows.length
      ? table({ label: "Settings that differ", columns, rows, filter: rows.length > 12 })
      : note("Nothing: all settings are alike."),
    note(
      "Settings from the runs' own ",
      make("code", {}, "config.json"),
      "; ",
      ABSENT,
      " where a method has no such setting.",
    ),
    alike.length
      ? folded(counted(alike.length, "setting is alike", "settings are alike"), () => facts(alike))
      : null,
  );
}

// A value that only this method has stands out.
function settingCell(values, place) {
  const value = values[place];
  const rare = value !== null && values.length > 2 && values.filter((each) => each === value).length === 1;
  return value === null ? ABSENT : make("code", { class: rare ? "rare" : null }, value);
}

const facts = (entries) =>
  make(
    "div",
    { class: "card scroll", tabindex: 0, role: "region", "aria-label": "Facts" },
    make(
      "table",
      { class: "plain" },
      make(
        "tbody",
        {},
        entries.map(([key, value]) =>
          make(
            "tr",
            {},
            make("th", { scope: "row" }, make("code", {}, key)),
            make("td", {}, Array.isArray(value) ? value.map((each) => make("div", {}, each)) : value),
          ),
        ),
      ),
    ),
  );

function manifestSection(data) {
  const looks = looksOf(data);
  const names = namesOf(data);
  const { alike, differing, runs } = data.manifest;
  const columns = [
    { name: "Task", value: (row) => names.get(row.task) },
    {
      name: "Method",
      value: (row) => looks.get(row.preset).name,
      cell: (row) => methodCell(looks.get(row.preset)),
    },
    { name: "Seed", number: true, ascending: true, value: (row) => row.seed },
    {
      name: "State",
      value: (row) => row.state,
      cell: (row) => make("span", { class: `state ${row.state}` }, row.state ?? ABSENT),
    },
    { name: "Step", number: true, value: (row) => row.step, cell: (row) => thousands(row.step) },
    {
      name: "Commit",
      title: "of the code that trained; a plus: the checkout was altered",
      value: (row) => row.commit,
      cell: (row) => make("code", {}, row.commit),
    },
    { name: "Begun", value: (row) => row.time },
    {
      name: "Folder",
      value: (row) => row.folder,
      cell: (row) => make("code", { class: "path" }, row.folder),
    },
  ];
  return section(
    "manifest",
    "Manifest",
    facts([
      ["command", data.made.command],
      ["code", data.made.commit],
      ["runs", thousands(runs.length)],
      ...Object.entries(data.protocol),
    ]),
    Object.keys(differing).length
      ? [make("h3", {}, "Facts that differ between runs"), facts(Object.entries(differing))]
      : null,
    Object.keys(alike).length
      ? folded(
          counted(Object.keys(alike).length, "fact that all runs share", "facts that all runs share"),
          () => facts(Object.entries(alike)),
        )
      : null,
    folded(counted(runs.length, "run", "runs"), () =>
      table({ label: "Runs", columns, rows: runs, filter: true }),
    ),
  );
}
