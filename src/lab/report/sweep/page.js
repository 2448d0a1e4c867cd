// Choices of the reader: kept in the address, offered by selects, and the figures that follow them.
/** What the sweep's file asks for; axes that no figure shows are held at the best setting, so that a curve compares one thing. */
function firstState() {
  const { x, y, series, panel, heat, cost } = sweep.figures;
  const known = (of, name, instead = "") => (of.has(name) ? name : instead);
  const first = known(axisOf, x, (varied[0] ?? axes[0])?.name);
  const [hx, hy] = heat ?? [first, varied.find((axis) => axis.name !== first)?.name];
  const hold = {};
  // Values drawn from a range meet too few runs for that.
  if (sweep.best !== null) for (const axis of varied) if (!axis.binned && axis.codes[sweep.best] >= 0) hold[axis.name] = axis.codes[sweep.best];
  const learner = [series, x].find((name) => axisOf.has(name) && axisOf.get(name).varies && !axisOf.get(name).binned) ?? "";
  return { learner, x: first ?? "", y: known(resultOf, y, results[0]?.name) ?? "", series: known(axisOf, series), panel: known(axisOf, panel), hx: hx ?? "", hy: hy ?? "",
    cost: known(resultOf, cost, results.find((column) => column.less && column.name !== y)?.name) ?? "", hold, find: "", sort: "", down: false, page: 0 };
}

const initial = firstState();
const state = { ...initial, hold: { ...initial.hold } };

/** Reads the address; what it names and the table has not is left as it was. */
function recall() {
  const given = new URLSearchParams(location.hash.slice(1));
  const fits = { x: axisOf, learner: axisOf, series: axisOf, panel: axisOf, hx: axisOf, hy: axisOf, y: resultOf, cost: resultOf, sort: columnOf };
  for (const [key, value] of given) {
    if (key in fits && (fits[key].has(value) || (value === "" && ["series", "panel", "learner"].includes(key)))) state[key] = value;
    if (key === "find") state.find = value;
    if (key === "down") state.down = value === "1";
    if (key === "page") state.page = Math.max(0, Math.floor(Number(value)) || 0);
    if (key.startsWith("hold.")) {
      const axis = axisOf.get(key.slice(5));
      const at = axis ? axis.texts.indexOf(value) : -1;
      if (axis && value === "*") delete state.hold[axis.name];
      if (at >= 0) state.hold[axis.name] = at;
    }
  }
}

/** Writes what differs from the first state into the address. */
function remember() {
  const out = new URLSearchParams();
  for (const key of ["y", "x", "series", "panel", "hx", "hy", "cost", "learner", "find", "sort"]) if (state[key] !== initial[key]) out.set(key, state[key]);
  if (state.down) out.set("down", "1");
  if (state.page) out.set("page", String(state.page));
  for (const axis of varied) {
    if (state.hold[axis.name] !== initial.hold[axis.name]) out.set(`hold.${axis.name}`, axis.texts[state.hold[axis.name]] ?? "*");
  }
  const hash = out.toString();
  history.replaceState(null, "", hash ? `#${hash}` : `${location.pathname}${location.search}`);
}

function fill(select, options, value) {
  select.replaceChildren(...options.map(([key, text]) => {
    const one = element("option", text);
    one.value = key;
    one.selected = key === value;
    return one;
  }));
}

function choose(key, options, ids) {
  const select = document.getElementById(`choose-${key}`);
  fill(select, options, state[key]);
  select.closest("label").hidden = options.length < 2;
  select.addEventListener("change", () => {
    state[key] = select.value;
    changed(ids);
  });
}

/** A curve for each value of the abscissa, or of the panels, would say nothing. */
function settle() {
  if (state.series === state.x) state.series = "";
  if (state.panel === state.x || (state.panel && state.panel === state.series)) state.panel = "";
}

function changed(ids) {
  settle();
  for (const key of ["series", "panel"]) document.getElementById(`choose-${key}`).value = state[key];
  for (const one of figures) if (!ids || ids.includes(one.id)) draw(one);
  remember();
}

function wireChoices() {
  const list = (all) => all.map((column) => [column.name, column.label]);
  const maybe = [["", "none"], ...list(varied)];
  choose("y", list(results), null);
  choose("x", list(varied.length ? varied : axes), ["curves"]);
  choose("series", maybe, ["curves", "pareto"]);
  choose("panel", maybe, ["curves"]);
  choose("hx", list(varied), ["heat"]);
  choose("hy", list(varied), ["heat"]);
  choose("cost", list(results), ["pareto", "parallel"]);
  choose("learner", maybe, ["learning"]);
  const holds = document.getElementById("holds");
  for (const axis of varied) {
    // One axis is always shown; a range of values is always pooled.
    if (varied.length < 2 || axis.binned) continue;
    const label = document.createElement("label");
    label.className = "choice";
    const select = document.createElement("select");
    select.dataset.hold = axis.name;
    const own = state.hold[axis.name];
    fill(select, [["*", "all, pooled"], ...axis.texts.map((text, at) => [String(at), short(text, 40)])], own === undefined ? "*" : String(own));
    select.addEventListener("change", () => {
      if (select.value === "*") delete state.hold[axis.name];
      else state.hold[axis.name] = Number(select.value);
      changed(["curves", "heat", "learning"]);
    });
    label.append(element("span", axis.label), select);
    holds.append(label);
  }
  if (holds.children.length) holds.prepend(element("p", "Where a figure does not show an axis, it holds it at", "note"));
  for (const key of ["series", "panel"]) document.getElementById(`choose-${key}`).closest("label").hidden = varied.length < 2;
  document.getElementById("shared").hidden = results.length < 2 && holds.children.length === 0;
}

// --- start ---

performance.mark("table read");
recall();
settle();
wireChoices();
wireRows();
performance.mark("rows listed");
figure("curves", curves);
figure("heat", heat);
figure("pareto", pareto);
figure("learning", learning);
figure("importance", importance);
figure("parallel", parallel);

// Names of sections would take the place of the choices in the address.
document.querySelectorAll("[data-jump]").forEach((link) => link.addEventListener("click", (event) => {
  event.preventDefault();
  document.querySelector(link.getAttribute("href")).scrollIntoView();
}));

/** One figure after another, so that the page answers in between. */
function drawFrom(at) {
  if (at === figures.length) {
    document.documentElement.dataset.ready = String(Math.round(performance.now()));
    return;
  }
  draw(figures[at]);
  performance.mark(`drawn ${figures[at].id}`);
  setTimeout(() => drawFrom(at + 1), 0);
}
drawFrom(0);

const redraw = () => figures.forEach(draw);
let lastWidth = innerWidth;
let later = 0;
addEventListener("resize", () => {
  if (innerWidth === lastWidth || onPaper) return;
  lastWidth = innerWidth;
  clearTimeout(later);
  later = setTimeout(() => { redraw(); drawRows(); }, 120);
});
addEventListener("beforeprint", () => { onPaper = true; redraw(); drawRows(); });
addEventListener("afterprint", () => { onPaper = false; redraw(); drawRows(); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
document.getElementById("theme").addEventListener("click", () => setTimeout(redraw, 0));
addEventListener("hashchange", () => {
  Object.assign(state, initial, { hold: { ...initial.hold } });
  recall();
  settle();
  for (const key of ["y", "x", "series", "panel", "hx", "hy", "cost", "learner"]) document.getElementById(`choose-${key}`).value = state[key];
  document.querySelectorAll("[data-hold]").forEach((select) => { select.value = String(state.hold[select.dataset.hold] ?? "*"); });
  document.getElementById("find").value = state.find;
  redraw();
  drawRows();
});
