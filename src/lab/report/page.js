"use strict";
// Comforts only: the page says everything without this script. Here: values under the pointer and under the keyboard,
// light and dark, copying, names of columns where a table is too narrow for its head, what is folded away in print.
const tip = document.createElement("div");
tip.id = "tip";
tip.hidden = true;
tip.setAttribute("role", "status");
document.body.append(tip);

/** Shows words beside a place of the window; none hides them. */
function tell(words, x, y) {
  tip.hidden = !words;
  if (!words) return;
  tip.textContent = words;
  const right = innerWidth - tip.offsetWidth - 8;
  tip.style.left = `${Math.max(8, Math.min(x + 16, right))}px`;
  const above = y - tip.offsetHeight - 12;
  tip.style.top = `${above > 8 ? above : Math.min(y + 18, innerHeight - tip.offsetHeight - 8)}px`;
}
document.addEventListener("pointermove", (event) => {
  const at = event.target.closest("[data-tip]");
  if (at || !event.target.closest("[data-map]")) tell(at?.dataset.tip, event.clientX, event.clientY);
});

// A drawing is one stop of the tabulator; arrows go from value to value in it, wherever they lie.
const groups = [...document.querySelectorAll("svg.chart, .fields")].filter((one) => one.querySelector("[data-tip]"));
const middle = (one) => {
  const { left, right, top, bottom } = one.getBoundingClientRect();
  return [(left + right) / 2, (top + bottom) / 2];
};
function stop(group, at) {
  group.querySelector(".at")?.classList.remove("at");
  at?.classList.add("at");
  const [x, y] = at ? middle(at) : [0, 0];
  tell(at?.dataset.tip, x, y);
}
/** The nearest value in a direction: what lies aside counts twice. */
function nextOf(all, from, [dx, dy]) {
  const [x, y] = middle(from);
  let [best, least] = [from, Infinity];
  for (const one of all) {
    const [a, b] = middle(one);
    const [along, aside] = [(a - x) * dx + (b - y) * dy, Math.abs((a - x) * dy) + Math.abs((b - y) * dx)];
    if (along > 0.5 && along + 2 * aside < least) [best, least] = [one, along + 2 * aside];
  }
  return best;
}
const arrows = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] };
for (const group of groups) {
  group.setAttribute("tabindex", "0");
  group.addEventListener("focus", () => {
    if (group.matches(":focus-visible")) stop(group, group.querySelector(".at") ?? group.querySelector("[data-tip]"));
  });
  group.addEventListener("blur", () => stop(group, null));
  group.addEventListener("keydown", (event) => {
    const all = [...group.querySelectorAll("[data-tip]")];
    const from = group.querySelector(".at") ?? all[0];
    const to = { Home: all[0], End: all.at(-1) }[event.key] ?? (arrows[event.key] && nextOf(all, from, arrows[event.key]));
    if (!to) return;
    event.preventDefault();
    stop(group, to);
  });
}
for (const one of document.querySelectorAll("[data-tip]")) {
  if (one.closest("svg.chart, .fields")) continue;
  if (!one.matches("a, button")) one.setAttribute("tabindex", "0");
  one.addEventListener("focus", () => tell(one.dataset.tip, ...middle(one)));
  one.addEventListener("blur", () => tell(""));
}
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") tell("");
});

const theme = document.getElementById("theme");
theme.hidden = false;
theme.addEventListener("click", () => {
  const root = document.documentElement.style;
  const dark = root.colorScheme ? root.colorScheme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.colorScheme = dark ? "light" : "dark";
});
const copy = document.getElementById("copy");
if (copy) {
  const field = copy.parentElement.querySelector("input");
  copy.hidden = false;
  copy.addEventListener("click", async () => {
    field.select();
    try {
      await navigator.clipboard.writeText(field.value);
    } catch {
      document.execCommand("copy");
    }
    copy.textContent = "copied";
  });
}

// On a narrow page such tables stand row by row, each value with the name of its column.
for (const table of document.querySelectorAll("table.stack")) {
  const heads = [...table.tHead.rows[0].cells].map((cell) => cell.textContent);
  for (const row of table.tBodies[0].rows) [...row.cells].forEach((cell, at) => cell.setAttribute("data-head", heads[at] ?? ""));
}

let unfolded = [];
addEventListener("beforeprint", () => {
  unfolded = [...document.querySelectorAll("details:not([open])")];
  unfolded.forEach((one) => (one.open = true));
});
addEventListener("afterprint", () => unfolded.forEach((one) => (one.open = false)));
