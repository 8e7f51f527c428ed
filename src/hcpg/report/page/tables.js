// Tables that are sorted by their headings, filtered by a word, and built a screenful at a time.

const AT_ONCE = 200;

// A column: name, value(row) to sort by, cell(row) to show (default: the value), number, title, ascending, fixed.
function table({ label, columns, rows, foot = [], filter = false }) {
  const state = { by: null, down: false, word: "", all: rows.length <= AT_ONCE };
  const body = make("tbody");
  const count = make("span", { class: "count", "aria-live": "polite" });
  const heads = columns.map((column) => heading(column, () => {
    const again = state.by === column;
    state.down = again ? !state.down : Boolean(column.number) && !column.ascending;
    state.by = column;
    show();
  }));
  const more = make("button", { type: "button", class: "more", hidden: state.all, onclick: () => { state.all = true; show(); } },
    `Show all ${thousands(rows.length)} rows`);

  function show() {
    const found = rows.filter((row) => !state.word || columns.some((column) => text(column, row).includes(state.word)));
    const ordered = state.by ? sorted(found, state.by, state.down) : found;
    body.replaceChildren(...(state.all ? ordered : ordered.slice(0, AT_ONCE)).map((row) => line(columns, row)));
    more.hidden = state.all || ordered.length <= AT_ONCE;
    count.textContent = state.word ? `${thousands(found.length)} of ${thousands(rows.length)}` : "";
    heads.forEach((head, place) => head.setAttribute("aria-sort",
      columns[place] === state.by ? (state.down ? "descending" : "ascending") : "none"));
  }
  show();
  const grid = make("table", {}, make("caption", { class: "unseen" }, label), make("thead", {}, make("tr", {}, heads)), body,
    foot.length ? make("tfoot", {}, foot.map((row) => line(columns, row))) : null);
  const search = filter ? make("div", { class: "toolbar" }, make("input", { type: "search", placeholder: "Filter rows",
    "aria-label": `Filter: ${label}`, oninput: (event) => { state.word = event.target.value.trim().toLowerCase(); show(); } }), count) : null;
  const frame = make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": label }, grid);
  return make("div", { class: "card table" }, search, frame, more);
}

function heading(column, sort) {
  const button = make("button", { type: "button", title: column.title ?? `Sort by ${column.name}`, onclick: sort },
    column.mark ? column.mark() : null, make("span", {}, column.name), make("span", { class: "arrow", "aria-hidden": "true" }));
  return make("th", { scope: "col", "aria-sort": "none", class: column.number ? "number" : null }, button);
}

function line(columns, row) {
  return make("tr", {}, columns.map((column, place) => {
    const shown = column.cell ? column.cell(row) : column.value(row);
    const options = { class: column.number ? "number" : null };
    return place === 0 ? make("th", { scope: "row", ...options }, shown) : make("td", options, shown ?? ABSENT);
  }));
}

const text = (column, row) => String(column.value(row) ?? "").toLowerCase();

// What is absent comes last in either direction.
function sorted(rows, column, down) {
  const sign = down ? -1 : 1;
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b
    : String(a).localeCompare(String(b), "en", { numeric: true }));
  return rows.map((row) => [column.value(row) ?? null, row])
    .sort(([a], [b]) => (a === null || b === null ? (a === null) - (b === null) : sign * compare(a, b)))
    .map(([, row]) => row);
}
