// Tables that are sorted by their headings, filtered by a word, and built a screenful at a time.

const AT_ONCE = 200;

// A column: name, value(row) to sort by, cell(row) to show (else the value), number, ascending, title, mark.
class Table {
  constructor({ label, columns, rows, foot = [], filter = false }) {
    Object.assign(this, { columns, rows, by: null, down: false, word: "", all: rows.length <= AT_ONCE });
    this.body = make("tbody");
    this.heads = columns.map((column) => heading(column, () => this.sort(column)));
    this.more = make(
      "button",
      { type: "button", class: "more", onclick: () => this.showAll() },
      `Show all ${thousands(rows.length)} rows`,
    );
    const grid = make(
      "table",
      {},
      make("caption", { class: "unseen" }, label),
      make("thead", {}, make("tr", {}, this.heads)),
      this.body,
      foot.length
        ? make(
            "tfoot",
            {},
            foot.map((row) => line(columns, row)),
          )
        : null,
    );
    const frame = make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": label }, grid);
    this.node = make("div", { class: "card table" }, filter ? this.search(label) : null, frame, this.more);
    this.show();
  }

  search(label) {
    this.count = make("span", { class: "count", "aria-live": "polite" });
    const type = (event) => {
      this.word = event.target.value.trim().toLowerCase();
      this.show();
    };
    const field = {
      type: "search",
      placeholder: "Filter rows",
      "aria-label": `Filter: ${label}`,
      oninput: type,
    };
    return make("div", { class: "toolbar" }, make("input", field), this.count);
  }

  // Numbers begin with the largest, unless their column says otherwise.
  sort(column) {
    this.down = this.by === column ? !this.down : Boolean(column.number) && !column.ascending;
    this.by = column;
    this.show();
  }

  showAll() {
    this.all = true;
    this.show();
  }

  show() {
    const found = this.rows.filter(
      (row) => !this.word || this.columns.some((column) => words(column, row).includes(this.word)),
    );
    const rows = this.by ? sorted(found, this.by, this.down) : found;
    this.body.replaceChildren(
      ...(this.all ? rows : rows.slice(0, AT_ONCE)).map((row) => line(this.columns, row)),
    );
    this.more.hidden = this.all || rows.length <= AT_ONCE;
    if (this.count)
      this.count.textContent = this.word
        ? `${thousands(found.length)} of ${thousands(this.rows.length)}`
        : "";
    const direction = this.down ? "descending" : "ascending";
    this.heads.forEach((head, place) =>
      head.setAttribute("aria-sort", this.columns[place] === this.by ? direction : "none"),
    );
  }
}

const table = (options) => new Table(options).node;

function heading(column, sort) {
  const title = column.title ?? `Sort by ${column.name}`;
  const arrow = make("span", { class: "arrow", "aria-hidden": "true" });
  const mark = column.mark ? column.mark() : null;
  const button = make(
    "button",
    { type: "button", title, onclick: sort },
    mark,
    make("span", {}, column.name),
    arrow,
  );
  return make("th", { scope: "col", "aria-sort": "none", class: column.number ? "number" : null }, button);
}

function line(columns, row) {
  const cells = columns.map((column, place) => {
    const shown = (column.cell ? column.cell(row) : column.value(row)) ?? ABSENT;
    const options = { class: column.number ? "number" : null };
    return place ? make("td", options, shown) : make("th", { scope: "row", ...options }, shown);
  });
  return make("tr", {}, cells);
}

const words = (column, row) => String(column.value(row) ?? "").toLowerCase();

// What is absent comes last in either direction.
function sorted(rows, column, down) {
  const sign = down ? -1 : 1;
  const compare = (a, b) =>
    typeof a === "number" && typeof b === "number"
      ? a - b
      : String(a).localeCompare(String(b), "en", { numeric: true });
  return rows
    .map((row) => [column.value(row) ?? null, row])
    .sort(([a], [b]) => (a === null || b === null ? (a === null) - (b === null) : sign * compare(a, b)))
    .map(([, row]) => row);
}
