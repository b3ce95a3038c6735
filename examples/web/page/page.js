// The controls of the page, and its chart. All that draws or measures is in the wasm beside it (src/lib.rs).
//
// In the address: ?size=512x512 fixes the canvas's pixels, ?atlas=512 the texels of texture space, ?rounds=3
// how often the chart times each method.

import init, { Mode, Page, Show } from "./subsurface_web.js";

const MODES = {
  "no scattering": Mode.None,
  "texture space": Mode.Texture,
  "screen space, a plan": Mode.Screen,
  "screen space, exact sum": Mode.Exact,
};
const SHOWS = {
  "the picture": [Show.Picture, ""],
  "diffuse light, no albedo": [Show.Diffuse, ""],
  "pixels per mm": [
    Show.PxPerMm,
    "Of a surface that faces the camera: blue up to 0.25, cyan to 1, green to 4, yellow to 16, red beyond.",
  ],
  "levels of the plan": [
    Show.Level,
    "The coarsest level that a pixel is blurred at: dark blue, the frame itself, to red.",
  ],
  "kinds of tiles": [
    Show.Class,
    "Green: blurred as planar surfaces; yellow: by the depth of each pixel; red: each pixel by its own sum.",
  ],
};
// As in the lab's chart (examples/lab/src/chart/plot/style.rs), on a dark ground.
const METHODS = {
  none: ["no scattering", "#999999"],
  copy: ["copy", "#999999"],
  screen_exact: ["exact sum", "#ffffff"],
  screen_planned: ["a plan", "#2f9be0"],
  texture_separable: ["texture space", "#009e73"],
  jimenez_2009: ["Jimenez 2009", "#e69f00"],
  jimenez_separable: ["Jimenez separable", "#d55e00"],
  fitted_separable: ["fitted separable", "#cc5fa0"],
  burley_disk: ["Burley disk", "#9d7bd0"],
};
const MOST_PIXELS = 4 << 20;
const ROUNDS = 5;

const id = (name) => document.getElementById(name);
const address = new URLSearchParams(location.search);
const canvas = id("canvas");
const state = {
  left: Mode.None,
  right: Mode.Screen,
  divider: 0.5,
  show: Show.Picture,
  frames: 0,
  isBusy: false,
};
let page, profile, chart;

function say(text, isError = false) {
  id("message").textContent = text;
  id("message").classList.toggle("error", isError);
}
const fail = (error) => say(error.message ?? String(error), true);

/// Does something, and says what is wrong with it if it cannot be done.
const attempt =
  (work) =>
  async (...given) => {
    try {
      await work(...given);
    } catch (error) {
      fail(error);
    }
  };

// Frames are drawn when something was asked for, one at a time; then the page rests.
let isWanted = false,
  isDrawing = false;
const draw = attempt(async () => {
  isWanted = true;
  if (isDrawing || !page) return;
  isDrawing = true;
  try {
    while (isWanted) {
      await new Promise(requestAnimationFrame);
      isWanted = false;
      const { left, right, divider, show } = state;
      page.draw(left, right, left === right ? 1 : divider, show);
      await page.done();
      state.frames += 1;
    }
  } finally {
    isDrawing = isWanted = false;
  }
});

/// Says what is done, lets the browser show it, and does it.
const slowly = (text, work) =>
  attempt(async () => {
    if (state.isBusy) return;
    state.isBusy = true;
    say(text);
    try {
      await new Promise((resume) => setTimeout(resume, 50));
      await work();
      if (id("message").textContent === text) say("");
    } finally {
      state.isBusy = false;
    }
  })();

// The canvas.

function pixels() {
  const fixed = address.get("size")?.match(/^(\d+)x(\d+)$/);
  if (fixed) return [Number(fixed[1]), Number(fixed[2])];
  const box = canvas.getBoundingClientRect();
  const all = box.width * box.height * devicePixelRatio ** 2;
  const scale = devicePixelRatio * Math.min(1, Math.sqrt(MOST_PIXELS / Math.max(all, 1)));
  return [box.width, box.height].map((side) => Math.max(1, Math.round(side * scale)));
}

const resize = attempt(async () => {
  const [width, height] = pixels();
  if (!page || (canvas.width === width && canvas.height === height)) return;
  [canvas.width, canvas.height] = [width, height];
  page.resize(width, height);
  await draw();
});

function place() {
  const isSplit = state.left !== state.right;
  const title = (mode) => Object.keys(MODES).find((name) => MODES[name] === mode);
  id("divider").hidden = !isSplit;
  id("divider").style.left = `${100 * state.divider}%`;
  id("divider").ariaValueNow = Math.round(100 * state.divider);
  id("left-title").textContent = title(state.left);
  id("right-title").textContent = isSplit ? title(state.right) : "";
}

function split(at) {
  state.divider = Math.min(1, Math.max(0, at));
  place();
  draw();
}

const pointers = new Map();

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  const isLight = event.button === 2 || event.shiftKey || id("drag-light").checked;
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, isLight, isShift: event.button === 1 });
});
canvas.addEventListener("pointermove", (event) => {
  const from = pointers.get(event.pointerId);
  if (!from || !page) return;
  const [x, y] = [event.clientX, event.clientY];
  const height = canvas.clientHeight;
  const [right, down] = [(x - from.x) / height, (y - from.y) / height];
  if (pointers.size === 2) {
    // Two fingers pinch and shift.
    const other = [...pointers].find(([key]) => key !== event.pointerId)[1];
    const apart = (point) => Math.max(1, Math.hypot(point.x - other.x, point.y - other.y));
    page.zoom(Math.log(apart({ x, y }) / apart(from)) / -Math.log(0.9));
    page.shift(right / 2, down / 2);
  } else if (from.isLight) {
    page.turn_light(right, down);
  } else if (from.isShift) {
    page.shift(right, down);
  } else {
    page.turn(right, down);
  }
  [from.x, from.y] = [x, y];
  draw();
});
for (const end of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
}
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener(
  "wheel",
  (event) => {
    event.preventDefault();
    page?.zoom(-event.deltaY / (event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 100 : 3));
    draw();
  },
  { passive: false },
);

id("divider").addEventListener("pointerdown", (event) => id("divider").setPointerCapture(event.pointerId));
id("divider").addEventListener("pointermove", (event) => {
  if (!id("divider").hasPointerCapture(event.pointerId)) return;
  const box = canvas.getBoundingClientRect();
  split((event.clientX - box.left) / box.width);
});
id("divider").addEventListener("keydown", (event) => {
  const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
  if (step) split(state.divider + step);
});

// The panel.

function choices(select, names, chosen, take) {
  id(select).replaceChildren(
    ...names.map((name) => new Option(name, name, name === chosen, name === chosen)),
  );
  id(select).addEventListener("change", () => take(id(select).value));
}

function side(name) {
  return (value) => {
    state[name] = MODES[value];
    place();
    slowly(`${value}…`, draw);
  };
}

const maxError = () => {
  const error = 2 ** id("max-error").valueAsNumber;
  // The two that need not be fitted.
  return [255, 100].map((n) => 1 / n).find((known) => Math.abs(error / known - 1) < 0.04) ?? error;
};

function values() {
  id("max-error-value").textContent = `1/${Math.round(1 / maxError())}`;
  id("scale-value").textContent = (2 ** id("scale").valueAsNumber).toFixed(2);
  id("radius-value").textContent = `${id("radius").valueAsNumber.toFixed(1)}°`;
  id("profile-name").textContent = profile?.name ?? "";
}

const plan = (wanted = profile) =>
  slowly("Fitting a plan…", async () => {
    page.plan(wanted.gaussians, 2 ** id("scale").valueAsNumber, Math.fround(maxError()));
    profile = wanted;
    values();
    await draw();
  });

/// A profile as Profile::from_json reads it: of each Gaussian the variance and three weights.
function gaussians(name, text) {
  let terms;
  try {
    terms = JSON.parse(text).gaussians.map((g) => [g.variance_mm2, ...g.weight]);
  } catch {
    /* told below */
  }
  if (!terms?.every((term) => term.length === 4 && term.every(Number.isFinite))) {
    throw new Error(`${name}: needs {"gaussians": [{"variance_mm2": v, "weight": [r, g, b]}, …]}`);
  }
  return new Float32Array(terms.flat());
}

/// A dropped file: a head, or a profile.
async function take(file) {
  if (file.name.endsWith(".json")) {
    return plan({ name: file.name, gaussians: gaussians(file.name, await file.text()) });
  }
  const bytes = new Uint8Array(await file.arrayBuffer());
  return slowly(`Reading ${file.name}…`, async () => {
    const notes = page.load(bytes, id("mm-per-unit").valueAsNumber);
    await draw();
    say(`${file.name}. ${notes}`);
  });
}

// Measurements.

const median = (list) => list.toSorted((a, b) => a - b)[list.length >> 1];
const number = (value, digits = 3) => Number(value.toPrecision(digits)).toString();

/// All of a bench's figures; `step` is told how far it got.
async function figures(bench, rounds, step) {
  const rows = [],
    unavailable = [];
  const steps = bench.length * (rounds + 1);
  let done = 0;
  for (let i = 0; i < bench.length; i++) {
    const row = { i, method: bench.name(i), setting: bench.setting(i) };
    try {
      [row.rel_rmse, row.max_error] = await bench.errors(i);
      rows.push({ ...row, ms_of_rounds: [] });
    } catch (error) {
      unavailable.push({ method: row.method, why: error.message });
    }
    step((done += 1), steps, row.method);
  }
  // In turn, there and back, so that a clock that drifts drifts for all.
  for (let round = 0; round < rounds; round++) {
    for (const row of round % 2 ? rows.toReversed() : rows) {
      row.ms_of_rounds.push(await bench.ms(row.i));
      step((done += 1), steps, row.method);
    }
  }
  for (const row of rows) {
    row.clock = bench.clock(row.i);
    row.ms = median(row.ms_of_rounds);
    delete row.i;
  }
  bench.free();
  return { rows, unavailable };
}

const titled = ({ method, setting }) => `${METHODS[method]?.[0] ?? method} ${setting}`.trim();

const color = ({ method }) => METHODS[method]?.[1] ?? "#aaa";

function table({ rows, unavailable }, size) {
  const cells = (tag, list) => `<tr>${list.map((text) => `<${tag}>${text}</${tag}>`).join("")}</tr>`;
  const name = (row) => `<i style="background:${color(row)}"></i>${titled(row)}`;
  return (
    cells("th", [size.join("×"), "ms", "rel. RMSE", "largest error"]) +
    rows
      .map((row) =>
        cells("td", [name(row), number(row.ms), `${number(100 * row.rel_rmse)} %`, number(row.max_error, 2)]),
      )
      .join("") +
    unavailable.map((row) => cells("td", [name({ setting: "", ...row }), "–", "–", "–"])).join("")
  );
}

const measure = () =>
  slowly("Measuring this view…", async () => {
    const size = [canvas.width, canvas.height];
    const result = await figures(await page.measure(), Number(address.get("rounds") ?? 3), () => {});
    id("measured").innerHTML = table(result, size);
  });

const runChart = () =>
  slowly("Timing every method…", async () => {
    const [width, height] = id("chart-size").value.split("×").map(Number);
    const rounds = Number(address.get("rounds") ?? ROUNDS);
    id("progress").removeAttribute("value");
    id("progress").hidden = false;
    try {
      const bench = await page.chart(width, height);
      const result = await figures(bench, rounds, (done, steps, name) => {
        [id("progress").value, id("progress").max] = [done, steps];
        say(`Timing every method: ${titled({ method: name, setting: "" })}`);
      });
      chart = {
        what: "subsurface, built-in head from the front, skin; errors against the exact sum",
        adapter: state.adapter,
        browser: navigator.userAgent,
        size: [width, height],
        rounds,
        ...result,
      };
      id("plot").innerHTML = plot(chart);
      id("charted").innerHTML = table(chart, [width, height]);
      id("copy").disabled = false;
      say("");
    } finally {
      id("progress").hidden = true;
    }
  });

/// Error against time, both on logarithmic scales, as SVG.
function plot({ rows, size }) {
  const [W, H, left, bottom, top, right] = [340, 280, 46, 34, 18, 8];
  const known = (method) => rows.find((row) => row.method === method);
  const points = rows.filter((row) => !["none", "copy", "screen_exact"].includes(row.method));
  const range = (list) => [0.8 * Math.min(...list), 1.25 * Math.max(...list)];
  const x = range(rows.filter((row) => row.method !== "none").map((row) => row.ms));
  const y = range([known("none"), ...points].map((row) => 100 * row.rel_rmse));
  const at = ([low, high], value, from, to) =>
    from + ((to - from) * Math.log(value / low)) / Math.log(high / low);
  const px = (row) => at(x, row.ms, left, W - right);
  const py = (row) => at(y, 100 * row.rel_rmse, H - bottom, top);
  const ticks = ([low, high]) => {
    const all = [];
    const steps = high / low > 200 ? [1] : [1, 2, 5];
    for (let decade = 10 ** Math.floor(Math.log10(low)); decade <= high; decade *= 10) {
      all.push(...steps.map((n) => n * decade).filter((tick) => tick >= low && tick <= high));
    }
    return all;
  };
  const text = (x, y, words, more = "") => `<text x="${x}" y="${y}" fill="#ccc" ${more}>${words}</text>`;
  const line = (x1, y1, x2, y2, more) => `<line x1="${x1}" y1="${y1}" x2="${x2}" y2="${y2}" ${more}/>`;
  const dashed = (row) => `stroke="${color(row)}" stroke-dasharray="4 3"`;
  const parts = [
    ...ticks(x).map((tick) => {
      const across = px({ ms: tick });
      return (
        line(across, top, across, H - bottom, 'stroke="#333"') +
        text(across, H - bottom + 13, number(tick), 'text-anchor="middle"')
      );
    }),
    ...ticks(y).map((tick) => {
      const up = py({ rel_rmse: tick / 100 });
      return (
        line(left, up, W - right, up, 'stroke="#333"') +
        text(left - 4, up + 4, `${number(tick)} %`, 'text-anchor="end"')
      );
    }),
    text((left + W - right) / 2, H - 6, `ms at ${size.join("×")}`, 'text-anchor="middle"'),
    text(4, 11, "relative RMSE to the exact sum; lower left is better"),
  ];
  const none = py(known("none"));
  parts.push(
    line(left, none, W - right, none, dashed(known("none"))),
    text(left + 3, none - 4, "no scattering"),
  );
  for (const row of ["copy", "screen_exact"].map(known)) {
    const across = px(row);
    parts.push(
      line(across, top, across, H - bottom, dashed(row)),
      text(
        across - 4,
        H - bottom - 5,
        row.method === "copy" ? "copy" : "exact sum",
        `transform="rotate(-90 ${across - 4} ${H - bottom - 5})"`,
      ),
    );
  }
  for (const method of new Set(points.map((row) => row.method))) {
    const own = points.filter((row) => row.method === method);
    const spots = own.map((row) => [px(row), py(row)]);
    parts.push(`<polyline points="${spots.join(" ")}" fill="none" stroke="${color(own[0])}"/>`);
    spots.forEach(([x, y], i) =>
      parts.push(
        `<circle cx="${x}" cy="${y}" r="4" fill="${color(own[i])}"><title>${titled(own[i])}</title></circle>`,
      ),
    );
  }
  const font = 'font-size="10.5" font-family="system-ui, sans-serif"';
  return `<svg viewBox="0 0 ${W} ${H}" ${font}>${parts.join("")}</svg>`;
}

// From here on it starts.

const start = attempt(async () => {
  if (!navigator.gpu) {
    throw new Error(
      "This browser has no WebGPU, which the page needs: Chrome or Edge 113, Safari 26, Firefox 141 " +
        "on Windows, or later. It is there on https and localhost only.",
    );
  }
  const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw new Error("This browser has WebGPU, but no GPU that it lets pages use.");
  const { vendor, architecture, device, description } = adapter.info;
  state.adapter = { vendor, architecture, device, description };
  id("adapter").textContent = [vendor, architecture, device, description].filter(Boolean).join(", ");

  choices("left", Object.keys(MODES), "no scattering", side("left"));
  choices("right", Object.keys(MODES), "screen space, a plan", side("right"));
  choices("show", Object.keys(SHOWS), "the picture", (name) => {
    [state.show, id("legend").textContent] = SHOWS[name];
    draw();
  });
  id("max-error").value = Math.log2(1 / 255);
  for (const slider of ["max-error", "scale"]) {
    id(slider).addEventListener("input", values);
    id(slider).addEventListener("change", () => plan());
  }
  id("radius").addEventListener("input", () => {
    values();
    page.set_light_radius(id("radius").valueAsNumber);
    draw();
  });
  id("reset").addEventListener("click", () => {
    page.reset();
    id("radius").value = 3;
    values();
    draw();
  });
  id("measure").addEventListener("click", measure);
  id("chart").addEventListener("click", runChart);
  id("copy").addEventListener(
    "click",
    attempt(() => navigator.clipboard.writeText(JSON.stringify(chart, null, 1))),
  );
  for (const event of ["dragover", "drop"]) addEventListener(event, (e) => e.preventDefault());
  addEventListener(
    "drop",
    attempt(async ({ dataTransfer }) => {
      for (const file of dataTransfer.files) await take(file);
    }),
  );

  await init();
  const [width, height] = pixels();
  [canvas.width, canvas.height] = [width, height];
  if (address.has("size")) {
    const [across, down] = [width, height].map((side) => `${side / devicePixelRatio}px`);
    Object.assign(id("view").style, { flex: `0 0 ${across}`, height: down });
  }
  const opened = await Page.open(canvas);
  if (address.has("atlas")) opened.set_atlas_size(Number(address.get("atlas")));
  profile = { name: "skin", gaussians: Page.skin() };
  page = opened;
  values();
  place();
  say("");
  let resizing;
  new ResizeObserver(() => {
    clearTimeout(resizing);
    resizing = setTimeout(resize, 100);
  }).observe(canvas);
  await draw();
});

// For the console, and the test.
globalThis.subsurface = {
  state,
  get page() {
    return page;
  },
  get chart() {
    return chart;
  },
};
start();
