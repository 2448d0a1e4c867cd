// Values of the maps of cells, under the pointer and under the keyboard: they are the pixels of the pictures themselves.
const maps = new WeakMap();

/** Palette indices of a PNG of eight bits a pixel, row by row. */
async function indicesOf(uri) {
  const bytes = Uint8Array.from(atob(uri.slice(uri.indexOf(",") + 1)), (one) => one.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  const parts = [];
  let wide = 0;
  for (let at = 8; at < bytes.length; at += 12 + view.getUint32(at)) {
    const kind = String.fromCharCode(...bytes.subarray(at + 4, at + 8));
    if (kind === "IHDR") wide = view.getUint32(at + 8);
    if (kind === "IDAT") parts.push(bytes.subarray(at + 8, at + 8 + view.getUint32(at)));
  }
  const stream = new Blob(parts).stream().pipeThrough(new DecompressionStream("deflate"));
  const raw = new Uint8Array(await new Response(stream).arrayBuffer());
  const high = raw.length / (wide + 1);
  const out = new Uint8Array(wide * high);
  // each line was written as differences to what lies left, above, or between
  for (let y = 0; y < high; y++) {
    const filter = raw[y * (wide + 1)];
    for (let x = 0; x < wide; x++) {
      const left = x ? out[y * wide + x - 1] : 0;
      const up = y ? out[(y - 1) * wide + x] : 0;
      const corner = x && y ? out[(y - 1) * wide + x - 1] : 0;
      const guess = left + up - corner;
      const [a, b, c] = [left, up, corner].map((one) => Math.abs(guess - one));
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      out[y * wide + x] = raw[y * (wide + 1) + 1 + x] + [0, left, up, (left + up) >> 1, paeth][filter];
    }
  }
  return { out, wide, high };
}

/** `x`, `y`: a pixel of the picture. */
function valueAt(image, { out, wide }, x, y) {
  const { rows, columns, down, across, top } = JSON.parse(image.dataset.map);
  const index = out[y * wide + x];
  const span = (at, each, all) => {
    const [from, to] = [at * each, Math.min(all, (at + 1) * each) - 1];
    return from === to ? ` ${from}` : `s ${from} to ${to}`;
  };
  const where = `row${span(y, down, rows)}, column${span(x, across, columns)}`;
  // one of 64 shades of the square root, or the level itself
  return top ? `${where}\nmean level about ${(top * ((index >> 2) / 63) ** 2).toPrecision(3)}` : `${where}\nlevel ${index}`;
}

for (const image of document.querySelectorAll("img[data-map]")) {
  if (!("DecompressionStream" in window)) break;
  let at = [0, 0];
  const load = async () => {
    if (!maps.has(image)) maps.set(image, indicesOf(image.src));
    return maps.get(image);
  };
  const say = (map) => {
    const box = image.getBoundingClientRect();
    tell(valueAt(image, map, ...at), box.left + ((at[0] + 0.5) / map.wide) * box.width, box.top + ((at[1] + 0.5) / map.high) * box.height);
  };
  image.setAttribute("tabindex", "0");
  image.addEventListener("pointermove", async (event) => {
    const map = await load();
    const box = image.getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) / box.width) * map.wide, ((event.clientY - box.top) / box.height) * map.high].map(Math.floor);
    at = [Math.min(map.wide - 1, Math.max(0, x)), Math.min(map.high - 1, Math.max(0, y))];
    tell(valueAt(image, map, ...at), event.clientX, event.clientY);
  });
  image.addEventListener("pointerleave", () => tell(""));
  image.addEventListener("focus", async () => {
    if (image.matches(":focus-visible")) say(await load());
  });
  image.addEventListener("blur", () => tell(""));
  image.addEventListener("keydown", async (event) => {
    const step = arrows[event.key];
    if (!step) return;
    event.preventDefault();
    const map = await load();
    at = [Math.min(map.wide - 1, Math.max(0, at[0] + step[0])), Math.min(map.high - 1, Math.max(0, at[1] + step[1]))];
    say(map);
  });
}
