// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Every view reacts, by pointer and by keys.
import assert from "node:assert/strict";
import { address, embedded, goTo, settled, shownFrame } from "./browser.mjs";
import { spread } from "./check_numbers.mjs";

/** The middle of a mark of the selection, in the window; null where the view has none. */
async function ringOf(page, view) {
  await page.$eval(`${view} .u-over`, (plot) => plot.scrollIntoView({ block: "center" }));
  return page.evaluate((name) => {
    const ring = document.querySelector(`${name} .overlay .selected`);
    if (!ring) return null;
    const { left, top, width, height } = ring.getBoundingClientRect();
    return { x: left + width / 2, y: top + height / 2, frame: Number(ring.dataset.frame) };
  }, view);
}

/** Where a frame is drawn, a click selects it, or one that is drawn at the same place. */
async function checkClicks(page, view, frames) {
  const kSamePlace_px = 9;
  let exact = 0;
  let clicked = 0;
  for (const frame of frames) {
    await goTo(page, frame);
    const ring = await ringOf(page, view);
    if (!ring) continue;
    assert.equal(ring.frame, frame, `${view} marks another frame`);
    await page.keyboard.press("Home");
    await page.mouse.click(ring.x, ring.y);
    await settled(page);
    const now = await ringOf(page, view);
    assert.ok(now, `${view}: nothing is marked after a click at frame ${frame}`);
    assert.equal(now.frame, await shownFrame(page), `${view} and the pair browser disagree`);
    const apart = Math.hypot(now.x - ring.x, now.y - ring.y);
    assert.ok(
      apart <= kSamePlace_px,
      `${view}: a click at frame ${frame} selects ${now.frame}, ${apart.toFixed(0)} px away`,
    );
    exact += now.frame === frame ? 1 : 0;
    ++clicked;
  }
  if (clicked > 1) assert.ok(exact > 0, `${view}: no click selected the very frame`);
}

async function checkHover(page, view, frame) {
  await goTo(page, frame);
  const ring = await ringOf(page, view);
  if (!ring) return;
  await page.mouse.move(ring.x, ring.y);
  const tip = await page.textContent(".tip:not([hidden])");
  assert.match(tip, /frame|query|score/, `${view}: the note says '${tip}'`);
  await page.mouse.move(2, 2);
}

/** Zooming moves what is drawn; showing all brings it back. */
async function checkZoom(page, view) {
  const before = await ringOf(page, view);
  if (!before) return;
  const moved = async (what) => {
    const now = await ringOf(page, view);
    assert.ok(
      Math.hypot(now.x - before.x, now.y - before.y) > 3,
      `${view}: ${what} changes nothing`,
    );
  };
  const reset = async () => {
    await page.focus(`${view} .plot`);
    await page.keyboard.press("0");
    const now = await ringOf(page, view);
    assert.ok(Math.hypot(now.x - before.x, now.y - before.y) < 1, `${view}: 0 does not show all`);
  };
  await page.click(`${view} .zoom button >> nth=0`);
  await page.click(`${view} .zoom button >> nth=0`);
  await moved("the button");
  await reset();
  const box = await page.locator(`${view} .u-over`).boundingBox();
  const corner = [box.x + 0.9 * box.width, box.y + 0.2 * box.height];
  await page.mouse.move(...corner);
  await page.mouse.wheel(0, -500);
  await settled(page);
  await moved("the wheel");
  await page.mouse.down();
  await page.mouse.move(corner[0] - 0.4 * box.width, corner[1], { steps: 4 });
  const frame = await shownFrame(page);
  await page.mouse.up();
  assert.equal(await shownFrame(page), frame, `${view}: dragging selects`);
  await reset();
}

/** A cell far from every loop shows just its two frames. */
async function checkCell(page, run) {
  if (run.frames < 60) return;
  const isFree = (row, column) =>
    run.status.every((status, i) => {
      if (run.status_names[status] !== "loop") return true;
      return Math.hypot(i - row, run.match[i] - column) > 0.06 * run.frames;
    });
  const row = Math.floor(run.frames * 0.8);
  const column = [0.3, 0.15, 0.5, 0.65, 0.05]
    .map((share) => Math.floor(share * run.frames))
    .find((c) => isFree(row, c));
  if (column === undefined) return;
  await ringOf(page, "#matrix");
  const box = await page.locator("#matrix .u-over").boundingBox();
  const place = (i, size) => ((i + 0.5) / run.frames) * size;
  await page.mouse.click(box.x + place(column, box.width), box.y + place(row, box.height));
  await settled(page);
  const { frame, with: against } = await address(page);
  const kCell = Math.ceil(run.frames / box.width) + 1;
  assert.ok(Math.abs(Number(frame) - row) <= kCell, `matrix: row ${row} selects ${frame}`);
  const shown = Number(against ?? run.match[Number(frame)]);
  assert.ok(Math.abs(shown - column) <= kCell, `matrix: column ${column} selects ${shown}`);
}

async function checkTimeBars(page, run) {
  if (!run.times_ms || run.frames < 10) return;
  for (const nth of [0, 1]) {
    await goTo(page, 0);
    const over = page.locator("#times .u-over").nth(nth);
    await over.scrollIntoViewIfNeeded();
    const box = await over.boundingBox();
    let selected = 0;
    for (let share = 0.9; share > 0.1 && selected === 0; share -= 0.04) {
      await page.mouse.click(box.x + share * box.width, box.y + 0.9 * box.height);
      selected = await shownFrame(page);
    }
    assert.ok(selected > 0, `times, plot ${nth}: no bar selects a frame`);
    const marks = await page.$$eval("#times .overlay .pointer", (all) =>
      all.map((one) => one.dataset.frame),
    );
    assert.deepEqual(marks, [String(selected), String(selected)], "times: the marks");
  }
}

export async function checkViews(page) {
  const run = (await embedded(page)).runs[0];
  const loops = run.status.flatMap((status, i) => (run.status_names[status] === "loop" ? [i] : []));
  const frames = spread(loops.length > 0 ? loops : run.status.map((_, i) => i), 5);
  for (const view of ["#trajectory", "#score", "#matrix", "#precision-recall"]) {
    if ((await page.$(view)) === null) continue;
    const marked = view === "#matrix" || view === "#precision-recall" ? spread(loops, 5) : frames;
    await checkClicks(page, view, marked);
    if (marked[0] !== undefined) await checkHover(page, view, marked[0]);
  }
  if (run.frames > 10) {
    await goTo(page, frames.at(-1));
    for (const view of ["#trajectory", "#score", "#matrix"]) await checkZoom(page, view);
  }
  await checkCell(page, run);
  await checkTimeBars(page, run);
}

/** The canvases are not blank: each holds a few colours. */
export async function checkDrawn(page) {
  const colours = await page.$$eval(".plot canvas", (canvases) =>
    canvases.map((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return new Set(new Uint32Array(data.buffer)).size;
    }),
  );
  for (const [i, count] of colours.entries()) assert.ok(count > 8, `plot ${i} is blank`);
}
