// Opens the page in headless Chromium and does what people do:
// node test/browser.mjs PAGE NATIVE PLAYWRIGHT [SHOT]
//
// PAGE is the built page; NATIVE, what `compare --size 256x256 --texture-size 512` wrote; PLAYWRIGHT, the
// folder that playwright-core is installed in; SHOT, a JPEG of the page to be written.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { extname, join, normalize } from "node:path";

const [root, native, playwright, shot] = process.argv.slice(2);
const { chromium } = createRequire(join(playwright, "x"))("playwright-core");
const TYPES = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".css": "text/css",
  ".wasm": "application/wasm",
};
// A software driver compiles and draws for seconds.
const PATIENCE_MS = 240_000;
// Pictures are drawn at twice the size of the native ones, which are anti-aliased so.
const SIZE = 512;
const MODES = {
  "no scattering": "none",
  "texture space": "texture_space",
  "screen space, a plan": "screen_planned",
  "screen space, exact sum": "screen_space",
};

const server = createServer(async (request, response) => {
  const path = normalize(new URL(request.url, "http://localhost").pathname);
  try {
    const body = await readFile(join(root, path === "/" ? "index.html" : path));
    response
      .writeHead(200, { "content-type": TYPES[extname(path === "/" ? ".html" : path)] ?? "text/html" })
      .end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((resume) => server.listen(0, "127.0.0.1", resume));
const address = `http://127.0.0.1:${server.address().port}/`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: [
    "--no-sandbox",
    "--disable-background-networking",
    "--enable-unsafe-webgpu",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--use-webgpu-adapter=swiftshader",
  ],
});

const complaints = [];
let passed = 0;

/// A page whose console is listened to.
async function open(query, viewport, before = () => {}) {
  const context = await browser.newContext({ viewport, permissions: ["clipboard-read", "clipboard-write"] });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("requestfailed", (request) => complaints.push(`${request.url()} failed`));
  page.on("request", (request) => {
    if (!request.url().startsWith(address) && !/^(data|blob):/.test(request.url()))
      complaints.push(request.url());
  });
  await before(page);
  await page.goto(address + query);
  return page;
}

async function test(name, work) {
  const since = performance.now();
  const more = await work();
  assert.deepEqual(complaints, [], `${name}: the console is not empty`);
  passed += 1;
  console.log(`ok ${name}${more ? `: ${more}` : ""} (${((performance.now() - since) / 1000).toFixed(1)} s)`);
}

/// Does something, and waits until the page has drawn what it asks for.
async function drawn(page, work) {
  const before = await page.evaluate(() => subsurface.state.frames);
  await work();
  await page.waitForFunction((before) => {
    const message = document.getElementById("message");
    if (message.classList.contains("error")) throw new Error(message.textContent);
    return subsurface.state.frames > before && !subsurface.state.isBusy;
  }, before);
  // What was asked for meanwhile is drawn, too.
  await page.waitForFunction(async () => {
    const { frames } = subsurface.state;
    await new Promise((resume) => setTimeout(resume, 100));
    return frames === subsurface.state.frames;
  });
}

const bytes = async (page) =>
  Buffer.from(
    await page.evaluate(async () => {
      const picture = await subsurface.page.picture();
      let text = "";
      for (let i = 0; i < picture.length; i += 32768)
        text += String.fromCharCode(...picture.subarray(i, i + 32768));
      return btoa(text);
    }),
    "base64",
  );

const choose = (page, what, value) => drawn(page, () => page.selectOption(what, value));

/// As sRGB bytes, red, green, blue and alpha.
const decoded = async (page, file) =>
  Buffer.from(
    await page.evaluate(
      async (base64) => {
        const blob = await (await fetch(`data:image/png;base64,${base64}`)).blob();
        const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
        const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
        context.drawImage(bitmap, 0, 0);
        return [...context.getImageData(0, 0, bitmap.width, bitmap.height).data];
      },
      (await readFile(file)).toString("base64"),
    ),
  );

/// Half as large: each pixel the mean of the light of four.
function halved(picture, size) {
  const linear = (byte) => (byte <= 10 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
  const srgb = (light) => 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
  const half = size / 2;
  const at = (x, y, c) => linear(picture[4 * (y * size + x) + c]);
  return Buffer.from(
    Array.from({ length: half * half * 4 }, (_, i) => {
      const [c, x, y] = [i % 4, 2 * ((i >> 2) % half), 2 * Math.floor((i >> 2) / half)];
      return c === 3
        ? 255
        : Math.round(srgb((at(x, y, c) + at(x + 1, y, c) + at(x, y + 1, c) + at(x + 1, y + 1, c)) / 4));
    }),
  );
}

const pictures = {};
let page;

await test("the first picture comes", async () => {
  const since = performance.now();
  page = await open(`?size=${SIZE}x${SIZE}&atlas=512&rounds=1`, { width: 1000, height: 700 });
  await page.waitForFunction(() => subsurface.state.frames > 0);
  return `${((performance.now() - since) / 1000).toFixed(1)} s after it was asked for`;
});

await test("no frame is drawn when nothing moves", async () => {
  const frames = () => page.evaluate(() => subsurface.state.frames);
  await drawn(page, () => page.evaluate(() => document.getElementById("reset").click()));
  const before = await frames();
  await page.waitForTimeout(2000);
  assert.equal(await frames(), before);
});

for (const [title, name] of Object.entries(MODES)) {
  await test(`${title} is as the native one`, async () => {
    await choose(page, "#left", title);
    await choose(page, "#right", title);
    pictures[name] = await bytes(page);
    const ours = halved(pictures[name], SIZE);
    const theirs = await decoded(page, join(native, `${name}_picture.png`));
    assert.equal(ours.length, theirs.length);
    let [beyond, sum, count] = [0, 0, ours.length / 4];
    for (let i = 0; i < ours.length; i += 4) {
      const most = Math.max(...[0, 1, 2].map((c) => Math.abs(ours[i + c] - theirs[i + c]))) / 255;
      beyond += most > 0.01;
      sum += most;
    }
    const share = beyond / count;
    // Along silhouettes and shadows two rasterizers choose other pixels: lines, not areas.
    assert.ok(share < 0.003, `${(100 * share).toFixed(2)} % of the pixels are off by more than .01`);
    // Half a step of a byte.
    assert.ok(sum / count < 0.5 / 255, `off by ${sum / count} on average`);
    const [percent, mean] = [(100 * share).toFixed(3), (sum / count).toFixed(5)];
    return `${percent} % of the pixels are off by more than .01; ${mean} on average`;
  });
}

await test("modes differ", () => {
  const all = Object.values(pictures);
  all.forEach((a, i) => all.slice(i + 1).forEach((b) => assert.ok(!a.equals(b))));
});

await test("the divider parts two modes", async () => {
  await choose(page, "#left", "no scattering");
  await choose(page, "#right", "screen space, a plan");
  const box = await page.locator("#canvas").boundingBox();
  await drawn(page, async () => {
    await page.mouse.move(box.x + box.width / 2, box.y + 100);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width * 0.25, box.y + 100, { steps: 3 });
    await page.mouse.up();
  });
  const at = Math.round(SIZE * (await page.evaluate(() => subsurface.state.divider)));
  assert.ok(Math.abs(at - SIZE / 4) <= 2, `${at}`);
  const both = await bytes(page);
  for (let y = 0; y < SIZE; y++) {
    const row = (picture, from, to) => picture.subarray(4 * (y * SIZE + from), 4 * (y * SIZE + to));
    assert.ok(row(both, 0, at).equals(row(pictures.none, 0, at)));
    assert.ok(row(both, at, SIZE).equals(row(pictures.screen_planned, at, SIZE)));
  }
});

await test("views show something else", async () => {
  const seen = [await bytes(page)];
  for (const show of await page.locator("#show option").allTextContents()) {
    if (show === "the picture") continue;
    await choose(page, "#show", show);
    const picture = await bytes(page);
    assert.ok(
      seen.every((other) => !other.equals(picture)),
      show,
    );
    seen.push(picture);
  }
  await choose(page, "#show", "the picture");
  assert.ok((await bytes(page)).equals(seen[0]));
});

await test("mouse, wheel and fingers move the view and the light; reset brings it back", async () => {
  const before = await bytes(page);
  const changes = async (what, work) => {
    const last = await bytes(page);
    await drawn(page, work);
    assert.ok(!(await bytes(page)).equals(last), what);
  };
  const drag = (button) => async () => {
    await page.mouse.move(300, 300);
    await page.mouse.down({ button });
    await page.mouse.move(340, 310, { steps: 2 });
    await page.mouse.up({ button });
  };
  await changes("turn", drag("left"));
  await changes("light", drag("right"));
  await changes("shift", drag("middle"));
  await changes("zoom", () => page.mouse.wheel(0, -300));
  const touch = await page.context().newCDPSession(page);
  const fingers = (type, ...points) =>
    touch.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  await changes("one finger", async () => {
    await fingers("touchStart", [300, 300]);
    await fingers("touchMove", [320, 320]);
    await fingers("touchEnd");
  });
  await changes("two fingers", async () => {
    await fingers("touchStart", [280, 300], [320, 300]);
    await fingers("touchMove", [240, 300], [360, 300]);
    await fingers("touchEnd");
  });
  await changes("radius", () => page.locator("#radius").fill("8"));
  await drawn(page, () => page.click("#reset"));
  assert.ok((await bytes(page)).equals(before));
});

const drop = (name, content) =>
  page.evaluate(
    async ([name, base64]) => {
      const blob = await (await fetch(`data:;base64,${base64}`)).blob();
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([blob], name));
      document.body.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
    },
    [name, Buffer.from(content).toString("base64")],
  );

const message = () => page.locator("#message").textContent();

const slide = (slider, value) =>
  drawn(page, () =>
    page.locator(slider).evaluate((input, value) => {
      input.value = value;
      for (const event of ["input", "change"]) input.dispatchEvent(new Event(event));
    }, value),
  );

await test("a plan is fitted for another error, and for another width", async () => {
  const before = await bytes(page);
  await slide("#max-error", Math.log2(1 / 50));
  const coarse = await bytes(page);
  assert.ok(!coarse.equals(before));
  await slide("#scale", 1);
  assert.ok(!(await bytes(page)).equals(coarse));
  await slide("#scale", 0);
  await slide("#max-error", Math.log2(1 / 255));
  assert.ok((await bytes(page)).equals(before));
});

await test("a dropped head is drawn; a broken one is refused and changes nothing", async () => {
  const before = await bytes(page);
  const head = await readFile(new URL("../../lab/src/compare/head.glb", import.meta.url));
  await drop("cut.glb", head.subarray(0, 4000));
  await page.waitForFunction(() => document.getElementById("message").classList.contains("error"));
  assert.match(await message(), /glTF/);
  assert.ok((await bytes(page)).equals(before));
  await drawn(page, () => drop("head.glb", head));
  await page.waitForFunction(() => /Skin: /.test(document.getElementById("message").textContent));
  assert.ok((await bytes(page)).equals(before));
});

await test("a dropped profile scatters; one that cannot is refused", async () => {
  const before = await bytes(page);
  const profile = (...variances) =>
    JSON.stringify({
      gaussians: variances.map((variance_mm2) => ({ variance_mm2, weight: [1, 1, 1] })),
    });
  await drawn(page, () => drop("grey.json", profile(0.02, 0.1, 0.5, 2)));
  const grey = await bytes(page);
  assert.ok(!grey.equals(before));
  for (const [text, why] of [
    [profile(-1), /variance/],
    [profile(9), /max_error/],
    ["{}", /gaussians/],
  ]) {
    await drop("no.json", text);
    await page.waitForFunction(() => document.getElementById("message").classList.contains("error"));
    assert.match(await message(), why);
    assert.ok((await bytes(page)).equals(grey));
    await page.evaluate(() => document.getElementById("message").classList.remove("error"));
  }
  assert.match(await page.locator("#profile-name").textContent(), /grey/);
});

await test("the chart has a row for every method", async () => {
  await page.evaluate(() => subsurface.page.set_atlas_size(256));
  await page.selectOption("#chart-size", "256×144");
  await page.click("#chart");
  await page.waitForFunction(() => subsurface.chart && !subsurface.state.isBusy);
  await page.click("#copy");
  const chart = JSON.parse(await page.evaluate(() => navigator.clipboard.readText()));
  const row = (method, setting = "") => chart.rows.find((r) => r.method === method && r.setting === setting);
  assert.deepEqual(chart.unavailable, []);
  assert.equal(chart.rows.length, 17);
  assert.ok(chart.adapter.vendor, JSON.stringify(chart.adapter));
  assert.equal(row("screen_exact").rel_rmse, 0);
  assert.ok(Math.abs(row("copy").rel_rmse - row("none").rel_rmse) < 1e-6);
  for (const setting of ["1/255", "1/100", "1/50"]) {
    const { rel_rmse } = row("screen_planned", setting);
    assert.ok(rel_rmse < 0.5 * row("none").rel_rmse, `${setting}: ${rel_rmse}`);
  }
  for (const { method, ms } of chart.rows) assert.ok(method === "none" || ms > 0, `${method}: ${ms} ms`);
  assert.equal(await page.locator("#plot circle").count(), 14);
  const list = chart.rows.map(
    (r) => `${r.method} ${r.setting} ${r.ms.toFixed(1)} ms ${(100 * r.rel_rmse).toFixed(3)} %`,
  );
  return `${Object.values(chart.adapter).join(" ")}, ${chart.rows[1].clock}\n  ${list.join("\n  ")}`;
});

await test("this view is measured", async () => {
  await page.click("#measure");
  await page.waitForFunction(() => document.querySelectorAll("#measured tr").length === 5);
  return page
    .locator("#measured")
    .innerText()
    .then((text) => text.replaceAll(/\s+/g, " "));
});

await page.context().close();

await test("without WebGPU the page says so", async () => {
  const none = () => Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });
  page = await open("", { width: 800, height: 600 }, (page) => page.addInitScript(none));
  await page.waitForFunction(() => document.getElementById("message").classList.contains("error"));
  assert.match(await message(), /WebGPU/);
  await page.context().close();
});

await test("on a narrow screen the canvas and the panel have their places", async () => {
  page = await open("?atlas=256", { width: 360, height: 640 });
  await page.waitForFunction(() => subsurface.state.frames > 0);
  const canvas = await page.locator("#canvas").boundingBox();
  const panel = await page.locator("#panel").boundingBox();
  assert.ok(canvas.width === 360 && canvas.height > 300 && panel.y >= canvas.y + canvas.height - 1);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 360);
  // Another size is another canvas.
  await drawn(page, () => page.setViewportSize({ width: 640, height: 360 }));
  const size = await page.evaluate(() => [subsurface.state.frames, canvas.width, canvas.height]);
  assert.equal(size[1], 640);
  await page.context().close();
});

if (shot) {
  page = await open("?rounds=1&atlas=256", { width: 1280, height: 800 });
  await page.waitForFunction(() => subsurface.state.frames > 0);
  await page.selectOption("#chart-size", "256×144");
  await page.click("#chart");
  await page.waitForFunction(() => subsurface.chart && !subsurface.state.isBusy);
  await page.evaluate(() => document.getElementById("panel").scrollTo(0, 1e4));
  await page.screenshot({ path: shot, type: "jpeg", quality: 80 });
}

await browser.close();
server.close();
console.log(`${passed} passed, 0 failed`);
