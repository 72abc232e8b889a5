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

/** The middle of each view's mark of the selection, from the corner of its plot; null without a mark. */
const marksOf = (page, views) =>
  page.evaluate(
    (names) =>
      names.map((name) => {
        const ring = document.querySelector(`${name} .overlay .selected`);
        if (!ring) return null;
        const [mark, plot] = [ring, ring.closest(".u-over")].map((one) =>
          one.getBoundingClientRect(),
        );
        const x = mark.left + mark.width / 2 - plot.left;
        const y = mark.top + mark.height / 2 - plot.top;
        return { x, y, frame: Number(ring.dataset.frame) };
      }),
    views,
  );

/** Where a frame is marked, a click selects it, or one that is drawn at the same place. */
async function checkClicks(page, view, marks) {
  const kSamePlace_px = 9;
  await page.$eval(`${view} .u-over`, (plot) => plot.scrollIntoView({ block: "center" }));
  const plot = await page.locator(`${view} .u-over`).boundingBox();
  await page.keyboard.press("Home");
  let exact = 0;
  for (const { x, y, frame } of marks) {
    await page.mouse.click(plot.x + x, plot.y + y);
    await settled(page);
    const [now] = await marksOf(page, [view]);
    assert.ok(now, `${view}: nothing is marked after a click at frame ${frame}`);
    assert.equal(now.frame, await shownFrame(page), `${view} and the pair browser disagree`);
    const apart = Math.hypot(now.x - x, now.y - y);
    assert.ok(
      apart <= kSamePlace_px,
      `${view}: a click at frame ${frame} selects ${now.frame}, ${apart.toFixed(0)} px away`,
    );
    exact += now.frame === frame ? 1 : 0;
  }
  if (marks.length > 1) assert.ok(exact > 0, `${view}: no click selected the very frame`);
  await page.mouse.move(plot.x + marks[0].x, plot.y + marks[0].y);
  const tip = await page.textContent(".tip:not([hidden])");
  assert.match(tip, /frame|query|score/, `${view}: the note says '${tip}'`);
  await page.mouse.move(2, 2);
}

/** Clicks and hovering at some frames, in every view that marks them. */
async function checkMarks(page, views, frames) {
  const marks = new Map(views.map((view) => [view, []]));
  for (const frame of frames) {
    await goTo(page, frame);
    for (const [i, mark] of (await marksOf(page, views)).entries()) {
      if (!mark) continue;
      assert.equal(mark.frame, frame, `${views[i]} marks another frame`);
      marks.get(views[i]).push(mark);
    }
  }
  for (const [view, its] of marks) if (its.length > 0) await checkClicks(page, view, its);
}

const drawingOf = (page, view) => page.$eval(`${view} canvas`, (canvas) => canvas.toDataURL());

/** The ring, where there is one, lies within the plot. */
async function assertInView(page, view, what) {
  const ring = await ringOf(page, view);
  if (!ring) return;
  const box = await page.locator(`${view} .u-over`).boundingBox();
  const [x, y] = [(ring.x - box.x) / box.width, (ring.y - box.y) / box.height];
  assert.ok(Math.min(x, y) > -0.02 && Math.max(x, y) < 1.02, `${view}: out of view ${what}`);
}

/** Keys and buttons zoom about the selected frame, and the view goes with it to another. */
async function checkKeyZoom(page, view) {
  const before = await ringOf(page, view);
  if (!before) return;
  const drawn = await drawingOf(page, view);
  await page.click(`${view} .zoom button >> nth=0`);
  await page.focus(`${view} .plot`);
  for (let i = 0; i < 6; ++i) await page.keyboard.press("+");
  await settled(page);
  assert.notEqual(await drawingOf(page, view), drawn, `${view}: the keys change nothing`);
  const { height, width } = await page.locator(`${view} .u-over`).boundingBox();
  const now = await ringOf(page, view);
  const away = Math.hypot(now.x - before.x, now.y - before.y);
  assert.ok(away < 0.03 * Math.max(width, height), `${view}: zooming moves the frame ${away} px`);
  for (const key of ["Home", "End"]) {
    await page.locator("[data-filter=loops]").focus();
    await page.keyboard.press(key);
    await assertInView(page, view, `after ${key}`);
  }
  await goTo(page, before.frame);
  await page.focus(`${view} .plot`);
  await page.keyboard.press("0");
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
  await page.focus(`${view} .plot`);
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

/** A cell far from every loop shows just its two frames, and says what its colour stands for. */
export async function checkCell(page, run) {
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
  const cell = [box.x + place(column, box.width), box.y + place(row, box.height)];
  await page.mouse.move(...cell);
  if (run.similarity_matrix) await checkCellText(page, run, row, column);
  await page.mouse.click(...cell);
  await settled(page);
  const { frame, with: against } = await address(page);
  const kCell = Math.ceil(run.frames / box.width) + 1;
  assert.ok(Math.abs(Number(frame) - row) <= kCell, `matrix: row ${row} selects ${frame}`);
  const shown = Number(against ?? run.match[Number(frame)]);
  assert.ok(Math.abs(shown - column) <= kCell, `matrix: column ${column} selects ${shown}`);
}

async function checkCellText(page, run, row, column) {
  const { frames_per_cell: wide, compared_every: step } = run.similarity_matrix;
  const tip = await page.textContent(".tip:not([hidden])");
  const caption = await page.textContent("#matrix .caption");
  if (wide === 1) {
    assert.match(tip, /ξ 0\.\d{3}$/, `the cell says '${tip}'`);
    assert.match(caption, /each query with every earlier frame/);
    return;
  }
  const spans = tip.match(/largest ξ( compared)? of frames (\d+)–(\d+) × (\d+)–(\d+): 0\.\d{3}$/);
  assert.ok(spans, `the cell says '${tip}'`);
  assert.equal(spans[1] !== undefined, step > 1, tip);
  const kNear = Math.max(2 * wide, run.frames / 100);
  for (const [from, to, frame] of [
    [2, 3, row],
    [4, 5, column],
  ]) {
    assert.equal(spans[to] - spans[from], wide - 1, `as many frames as a cell has: ${tip}`);
    assert.ok(Math.abs(spans[from] - frame) <= kNear, `${tip} is not about ${frame}`);
  }
  assert.equal(caption.includes(`one frame in ${step} `), step > 1, caption);
}

/** A loop elsewhere has no place in the matrix: its row holds pairs only. */
async function checkNoMarkElsewhere(page, run) {
  const loop = run.status.findLastIndex(
    (status, i) => run.status_names[status] === "loop" && run.match[i] < 0,
  );
  if (loop < 1) return;
  await page.$eval("#matrix .u-over", (plot) => plot.scrollIntoView({ block: "center" }));
  const box = await page.locator("#matrix .u-over").boundingBox();
  await page.mouse.move(box.x + 2, box.y + ((loop + 0.5) / run.frames) * box.height);
  assert.match(
    await page.textContent(".tip:not([hidden])"),
    /^query/,
    `loop ${loop} in the matrix`,
  );
}

/** The ring shows on the picture as well as on the bare page. */
async function checkMatrixRing(page, run) {
  const seen = await page.$eval("#matrix .overlay .selected", (ring) => ({
    stroke: getComputedStyle(ring).stroke,
    paper: getComputedStyle(document.documentElement).backgroundColor,
  }));
  if (run.similarity_matrix === null) {
    assert.notEqual(seen.stroke, seen.paper, "the ring has the colour of the paper");
  } else {
    assert.equal(seen.stroke, "rgb(255, 255, 255)", "the ring on the picture");
  }
}

/** Where the plot of the distribution ends, ms: from where a frame is marked. */
async function checkTimeEnd(page, run) {
  const totals = run.times_ms.content.map(
    (ms, i) =>
      ms + run.times_ms.retrieval[i] + run.times_ms.features[i] + run.times_ms.verification[i],
  );
  const mean = totals.reduce((sum, ms) => sum + ms, 0) / totals.length;
  const frame = totals.indexOf([...totals].sort((a, b) => a - b)[totals.length >> 1]);
  await goTo(page, frame);
  const [x, width] = await page.$eval("#times .overlay .pointer", (mark) => [
    Number(mark.getAttribute("d").match(/^M([\d.]+)/)[1]),
    mark.closest(".u-over").clientWidth,
  ]);
  const end = (totals[frame] * width) / x;
  assert.ok(
    end >= 0.999 * mean,
    `the plot of times ends at ${end} ms, before the mean, ${mean} ms`,
  );
}

async function checkTimeBars(page, run) {
  if (!run.times_ms || run.frames < 10) return;
  if (run.status_names[run.status[0]] !== "unreadable") await checkTimeEnd(page, run);
  for (const nth of [0, 1]) {
    await goTo(page, 0);
    const over = page.locator("#times .u-over").nth(nth);
    await over.scrollIntoViewIfNeeded();
    const box = await over.boundingBox();
    let selected = 0;
    // Closer together than bars: where two frames were very slow, all others are in few bars.
    for (let share = 0.99; share > 0 && selected === 0; share -= 0.02) {
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

/** `isBrief`: fewer frames are clicked, and only the matrix is zoomed, which depends most on the data. */
export async function checkViews(page, isBrief) {
  const run = (await embedded(page)).runs[0];
  const loops = run.status.flatMap((status, i) => (run.status_names[status] === "loop" ? [i] : []));
  const frames = spread(loops.length > 0 ? loops : run.status.map((_, i) => i), isBrief ? 2 : 5);
  const ofLoops = loops.length > 0 ? ["#matrix", "#precision-recall"] : [];
  const views = [];
  for (const view of ["#trajectory", "#correction", "#score", ...ofLoops])
    if (await page.isVisible(`${view} .plot`)) views.push(view);
  await checkMarks(page, views, frames);
  await checkNoMarkElsewhere(page, run);
  const withMatch = loops.find((frame) => run.match[frame] >= 0);
  if (withMatch !== undefined) {
    await goTo(page, withMatch);
    await checkMatrixRing(page, run);
  }
  if (run.frames > 10) {
    const zoomed = isBrief ? ["#matrix"] : ["#trajectory", "#score", "#matrix"];
    await goTo(page, frames.at(-1));
    for (const view of zoomed) await checkZoom(page, view);
    if (loops.length > 0) await page.locator("[data-filter=loops]").press("Enter");
    await goTo(page, frames.at(-1));
    for (const view of zoomed) await checkKeyZoom(page, view);
    await page.locator("[data-filter=all]").press("Enter");
  }
  await checkCell(page, run);
  await checkTimeBars(page, run);
}

/** Labels that stick out of their canvas, as all plots are drawn anew. */
const cutLabels = () => {
  const cut = [];
  const text = CanvasRenderingContext2D.prototype;
  const { fillText } = text;
  text.fillText = function (label, x, y) {
    const { a, b, e } = this.getTransform();
    const share = { center: 0.5, right: 0, end: 0 }[this.textAlign] ?? 1;
    const right = a * (x + share * this.measureText(label).width) + e;
    if (b === 0 && right > this.canvas.width) cut.push(label);
    fillText.call(this, label, x, y);
  };
  for (const reset of document.querySelectorAll(".zoom button:last-child")) reset.click();
  text.fillText = fillText;
  return cut;
};

/** The canvases are not blank: each holds a few colours; and no label is cut. */
export async function checkDrawn(page) {
  const colours = await page.$$eval(".plot canvas", (canvases) =>
    canvases.map((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return new Set(new Uint32Array(data.buffer)).size;
    }),
  );
  for (const [i, count] of colours.entries()) assert.ok(count > 8, `plot ${i} is blank`);
  assert.deepEqual(await page.evaluate(cutLabels), [], "labels are cut");
}
