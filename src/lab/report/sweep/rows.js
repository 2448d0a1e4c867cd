// The table of all rows: find, sort, pages, CSV.
const pageRows = 50;
const listedColumns = columns.filter((column) => column.name !== "run");
let found = [];

/** Columns by how much they are wanted: what came out, what was varied, what it cost; then the others as they stand. */
function wantedColumns() {
  const chosen = [state.y, state.sort, ...varied.map((axis) => axis.name), "validation_accuracy", "test_accuracy", "seed", state.cost];
  const rank = (column) => (chosen.includes(column.name) ? chosen.indexOf(column.name) : 100 + (column.role === "result" ? 0 : column.role === "name" ? 200 : 100) + listedColumns.indexOf(column));
  return listedColumns.toSorted((a, b) => rank(a) - rank(b));
}

/** As many columns as fit their frame, in the order of the table; all of them where a reader asks. */
function shownColumns() {
  if (document.getElementById("every").checked) return listedColumns;
  const wide = (column) => {
    const cells = found.slice(state.page * pageRows, (state.page + 1) * pageRows).map((row) => Math.min(24, column.show(row).length));
    // a head may break between words
    const head = Math.max(...column.label.split(" ").map((word) => word.length), column.label.length / 2.2);
    return (innerWidth > 620 || onPaper ? 21 : 13) + 7.7 * Math.max(head, 1, ...cells);
  };
  let room = (onPaper ? 700 : document.querySelector("#rows .scroll").clientWidth) - 74;
  const kept = new Set();
  for (const column of wantedColumns()) {
    room -= wide(column);
    if (room < 0 && kept.size > 1) break;
    kept.add(column);
  }
  return listedColumns.filter((column) => kept.has(column));
}

/** Rows that every word fits: a word anywhere in the row, or `column=value`. */
function find(text) {
  const wanted = text.trim().toLowerCase().split(/\s+/).filter(Boolean).map((word) => {
    const [name, ...rest] = word.split("=");
    const column = rest.length ? columnOf.get(name) : null;
    return column ? { column, value: rest.join("=") } : { word };
  });
  const kept = [];
  for (let row = 0; row < rowCount; row++) {
    const fits = wanted.every(({ column, value, word }) => (column
      ? column.text(row).toLowerCase() === value
      : listedColumns.some((one) => one.text(row).toLowerCase().includes(word) || (!one.words && one.show(row).toLowerCase().includes(word)))));
    if (fits) kept.push(row);
  }
  return kept;
}

/** Missing cells last, whichever way. */
function sorted(rows, column, down) {
  if (!column) return rows;
  const way = down ? -1 : 1;
  const axis = axisOf.get(column.name);
  const key = (row) => (axis && !axis.numeric ? (axis.codes[sweep.setting[row]] < 0 ? null : axis.codes[sweep.setting[row]]) : column.words ? column.text(row) || null : column.number(row));
  return rows.map((row) => [key(row), row]).sort(([a, i], [b, j]) => {
    if (a === null || b === null) return (a === null) - (b === null) || i - j;
    return (a < b ? -way : a > b ? way : 0) || i - j;
  }).map(([, row]) => row);
}

function csv(rows) {
  const quote = (text) => (/[",\n\r]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
  const lines = [columns.map((column) => quote(column.name)).join(",")];
  for (const row of rows) lines.push(columns.map((column) => quote(column.text(row))).join(","));
  return `${lines.join("\n")}\n`;
}

function drawHead(shown) {
  const head = document.querySelector("#table thead");
  const line = document.createElement("tr");
  line.append(element("th", "run"));
  for (const column of shown) {
    const button = element("button", column.label);
    const one = element("th", button, column.words ? "word" : "");
    button.type = "button";
    if (column.meaning) button.dataset.tip = `${column.label} (${column.name})\n${column.meaning}`;
    button.addEventListener("focus", () => tell(button.dataset.tip, ...middle(button)));
    button.addEventListener("blur", () => tell(""));
    const own = state.sort === column.name;
    one.setAttribute("aria-sort", own ? (state.down ? "descending" : "ascending") : "none");
    button.addEventListener("click", () => {
      // Results are wanted best first.
      const first = column.role === "result" && !column.less;
      state.down = state.sort === column.name ? !state.down : first;
      state.sort = column.name;
      state.page = 0;
      drawRows();
      remember();
    });
    line.append(one);
  }
  head.replaceChildren(line);
}

function drawRows() {
  found = sorted(find(state.find), columnOf.get(state.sort), state.down);
  const pages = Math.max(1, Math.ceil(found.length / pageRows));
  state.page = Math.min(state.page, pages - 1);
  const shown = shownColumns();
  drawHead(shown);
  const body = document.createElement("tbody");
  for (const row of found.slice(state.page * pageRows, (state.page + 1) * pageRows)) {
    const line = body.insertRow();
    line.dataset.row = row;
    line.append(element("td", isDone(row) ? runLink(row) : element("span", `${row + 1}, no result`, "note")));
    for (const column of shown) {
      const one = element("td", column.show(row), column.words ? "word" : "");
      one.title = column.text(row);
      line.append(one);
    }
  }
  document.querySelector("#table tbody").replaceWith(body);
  document.getElementById("found").textContent = found.length === rowCount ? `${plain(rowCount)} rows` : `${plain(found.length)} of ${plain(rowCount)} rows`;
  const hidden = listedColumns.length - shown.length;
  document.getElementById("found").textContent += hidden ? `, ${shown.length} of ${listedColumns.length} columns` : "";
  const pager = document.getElementById("pager");
  const go = (text, to, label) => {
    const button = element("button", text);
    button.type = "button";
    button.setAttribute("aria-label", label);
    button.disabled = to < 0 || to >= pages || to === state.page;
    button.addEventListener("click", () => { state.page = to; drawRows(); remember(); });
    return button;
  };
  pager.hidden = pages === 1;
  pager.replaceChildren(go("first", 0, "first page"), go("back", state.page - 1, "page before"), element("span", `page ${state.page + 1} of ${pages}`),
    go("next", state.page + 1, "next page"), go("last", pages - 1, "last page"));
}

function wireRows() {
  const box = document.getElementById("find");
  box.value = state.find;
  let wait = 0;
  box.addEventListener("input", () => {
    clearTimeout(wait);
    wait = setTimeout(() => { state.find = box.value; state.page = 0; drawRows(); remember(); }, 150);
  });
  document.getElementById("every").addEventListener("change", drawRows);
  document.getElementById("csv-save").addEventListener("click", () => {
    const address = URL.createObjectURL(new Blob([csv(found)], { type: "text/csv" }));
    download(`${sweep.name}.csv`, address);
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  });
  const copy = document.getElementById("csv-copy");
  copy.addEventListener("click", async () => {
    const text = csv(found);
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    copy.textContent = "copied";
    setTimeout(() => (copy.textContent = "copy CSV"), 1500);
  });
  drawRows();
}
