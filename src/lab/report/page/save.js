// A figure as a file: what a card shows, on white, as SVG of plain shapes and words, or as PNG.
const light = {};
for (const [, name, colour] of document.querySelector("style").textContent.matchAll(/--([\w-]+):light-dark\(([^,]+),/g)) light[name] = colour;
const onWhite = (text) => text.replace(/var\(--([\w-]+)\)/g, (all, name) => light[name] ?? all);
const chartStyle = onWhite(document.getElementById("charts").textContent);
const scribe = document.createElement("canvas").getContext("2d");
const escaped = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/"/g, "&quot;");
const near = (number) => Math.round(number * 10) / 10;
const clear = (colour) => colour === "transparent" || /[,/] ?0(%|\))/.test(colour);

/** Lines of a text on the page: their words and boxes. */
function linesOf(node) {
  const range = document.createRange();
  const lines = [];
  for (const { 0: word, index } of node.data.matchAll(/\S+/g)) {
    range.setStart(node, index);
    range.setEnd(node, index + word.length);
    const boxes = range.getClientRects();
    // a word that is broken is written where it begins
    const box = boxes[0];
    if (!box?.width) continue;
    const last = lines.at(-1);
    if (last && Math.abs(last.top - box.top) < 2 && boxes.length === 1) Object.assign(last, { words: `${last.words} ${word}`, right: box.right });
    else lines.push({ words: word, left: box.left, right: box.right, top: box.top, height: box.height });
  }
  return lines;
}

function wordsOf(node, place) {
  const style = getComputedStyle(node.parentElement);
  scribe.font = `${style.fontStyle} ${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  return linesOf(node).map((line) => {
    let { words } = line;
    if (style.textTransform === "capitalize") words = words.replace(/\b\w/g, (letter) => letter.toUpperCase());
    const { fontBoundingBoxAscent: up, fontBoundingBoxDescent: down } = scribe.measureText(words);
    const [x, y] = place(line.left, line.top + (line.height * up) / (up + down));
    const family = style.fontFamily.replaceAll('"', "'");
    return `<text class="own" x="${x}" y="${y}" textLength="${near(line.right - line.left)}" lengthAdjust="spacingAndGlyphs" style="font:${style.fontWeight} ${style.fontSize} ${family};fill:${style.color}">${escaped(words)}</text>`;
  });
}

/** The box of an element: what lies under its words. */
function boxOf(one, place) {
  const { left, top, right, bottom, width, height } = one.getBoundingClientRect();
  const style = getComputedStyle(one);
  const out = [];
  const [x, y] = place(left, top);
  const rect = (w, h, fill) => out.push(`<rect x="${x}" y="${y}" width="${near(w)}" height="${near(h)}" style="fill:${fill}"/>`);
  if (width && height && !clear(style.backgroundColor)) rect(width, height, style.backgroundColor);
  if (one.matches(".swatch")) rect(0.72 * parseFloat(style.fontSize), 0.72 * parseFloat(style.fontSize), getComputedStyle(one, "::before").backgroundColor);
  if (one.matches("td, th") && parseFloat(style.borderBottomWidth) && !clear(style.borderBottomColor)) {
    const [[x0, base], [x1]] = [place(left, bottom), place(right, bottom)];
    out.push(`<path d="M${x0} ${base}H${x1}" style="stroke:${style.borderBottomColor};stroke-width:1"/>`);
  }
  return out;
}

function drawingOf(svg, place) {
  const { left, top, width, height } = svg.getBoundingClientRect();
  if (!width) return "";
  const copy = svg.cloneNode(true);
  copy.querySelectorAll(".tip").forEach((one) => one.remove());
  copy.querySelectorAll("[data-tip]").forEach((one) => one.removeAttribute("data-tip"));
  const [x, y] = place(left, top);
  const box = { x, y, width: near(width), height: near(height), overflow: "visible" };
  copy.removeAttribute("style");
  copy.removeAttribute("tabindex");
  for (const [name, value] of Object.entries(box)) copy.setAttribute(name, value);
  return onWhite(new XMLSerializer().serializeToString(copy));
}

function pictureOf(image, place) {
  const { left, top, width, height } = image.getBoundingClientRect();
  const [x, y] = place(left, top);
  return `<image x="${x}" y="${y}" width="${near(width)}" height="${near(height)}" preserveAspectRatio="none" style="image-rendering:${getComputedStyle(image).imageRendering}" href="${image.src}"/>`;
}

/** A card as a drawing: `{ svg, width, height }`. */
function snapshot(card) {
  const root = document.documentElement.style;
  const before = root.colorScheme;
  root.colorScheme = "light";
  const frame = card.getBoundingClientRect();
  const place = (x, y) => [near(x - frame.left), near(y - frame.top)];
  const parts = [];
  const visit = (one) => {
    for (const node of one.childNodes) {
      if (node.nodeType === Node.TEXT_NODE) parts.push(...wordsOf(node, place));
      if (node.nodeType !== Node.ELEMENT_NODE || node.matches(".save, button, script")) continue;
      if (node.matches("svg")) parts.push(drawingOf(node, place));
      else if (node.matches("img")) parts.push(pictureOf(node, place));
      else {
        parts.push(...boxOf(node, place));
        visit(node);
      }
    }
  };
  visit(card);
  root.colorScheme = before;
  const [width, height] = [Math.ceil(Math.max(frame.width, card.scrollWidth)), Math.ceil(frame.height)];
  const own = `.own{white-space:pre}svg text{font-family:${getComputedStyle(document.body).fontFamily}}`;
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"><title>${escaped(document.title)}</title><style>${chartStyle}${own}</style><rect width="${width}" height="${height}" fill="#fff"/>${parts.join("")}</svg>\n`;
  return { svg, width, height };
}

function keep(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

async function asPng({ svg, width, height }) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  // such that the longer side stays within what browsers draw
  const scale = Math.min(3, 8000 / Math.max(width, height));
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height].map((side) => Math.round(side * scale));
  const ink = canvas.getContext("2d");
  ink.scale(scale, scale);
  ink.drawImage(image, 0, 0, width, height);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

const pageName = document.title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
for (const buttons of document.querySelectorAll(".card > .top > .save[hidden]")) {
  const card = buttons.closest(".card");
  if (!card.querySelector("svg, img, table")) continue;
  buttons.hidden = false;
  for (const button of buttons.querySelectorAll("[data-save]")) {
    button.addEventListener("click", async () => {
      const drawing = snapshot(card);
      const png = button.dataset.save === "png";
      const blob = png ? await asPng(drawing) : new Blob([drawing.svg], { type: "image/svg+xml" });
      keep(`${pageName}-${card.id}.${button.dataset.save}`, blob);
    });
  }
}
