// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What a person does with a run: find a frame, judge loops, look closer, keep figures.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import path from "node:path";
import {
  address,
  embedded,
  framesAfter,
  goTo,
  kWide,
  settled,
  shownFrame,
  textOf,
} from "./browser.mjs";

const isLoop = (run, frame) => run.status_names[run.status[frame]] === "loop";

async function search(page, text) {
  await page.fill("#frame-number", text);
  await page.press("#frame-number", "Enter");
  await settled(page);
  return shownFrame(page);
}

/** A frame is found by number, by name or part of it, and by time; its name stands at its picture. */
export async function checkSearch(page) {
  const run = (await embedded(page)).runs[0];
  const frame = run.frames >> 1;
  await goTo(page, 0);
  assert.equal(await search(page, String(frame)), frame, "by number");
  if (run.names?.[frame] && run.names[frame] !== String(frame)) {
    await goTo(page, 0);
    assert.equal(await search(page, run.names[frame]), frame, "by name");
    const shown = await page.textContent("#pair .picture .name");
    assert.equal(shown, run.names[frame], "the name at the picture");
    await goTo(page, 0);
    const part = run.names[frame].replace(/\.\w+$/, "");
    assert.equal(await search(page, part), frame, `by ${part}, a part of a name`);
  }
  if (run.timestamp_s && frame > 0) {
    await goTo(page, 0);
    const time = run.timestamp_s[frame] - run.timestamp_s[0];
    assert.equal(await search(page, `${time.toFixed(3)} s`), frame, "by time");
  }
  assert.equal(await search(page, "no such name"), await shownFrame(page));
  assert.match(await page.textContent("#pair .position"), /no frame 'no such name'/);
  await page.evaluate(() => document.activeElement.blur());
}

/** The loops by rising score, by the arrow keys. */
export async function checkWeakest(page) {
  const run = (await embedded(page)).runs[0];
  const loops = run.status.flatMap((_, frame) => (isLoop(run, frame) ? [frame] : []));
  if (loops.length < 3) return;
  loops.sort((a, b) => run.score[a] - run.score[b] || a - b);
  const button = page.locator("#pair button", { hasText: "weakest first" });
  await button.click();
  const first = await shownFrame(page);
  const walked = [first, ...(await framesAfter(page, ["ArrowRight", "ArrowRight"]))];
  assert.deepEqual(walked, loops.slice(0, 3), "the weakest loops");
  assert.equal((await address(page)).order, "weakest");
  await button.click();
  await page.locator("[data-filter=all]").press("Enter");
}

/** The trajectory before and after is there if it was corrected, with the number of loops. */
export async function checkCorrection(page) {
  const run = (await embedded(page)).runs[0];
  const view = page.locator("#correction");
  if (!run.correction) {
    assert.ok((await view.count()) === 0 || (await view.isHidden()), "nothing was corrected");
    return;
  }
  const kept = run.correction.loops.filter((_, i) => i % 3 === 2);
  const shown = (await view.locator(".legend li").allTextContents()).map((text) =>
    text.replaceAll(",", ""),
  );
  const counted = (number) => `${number || "no"} loop${number > 1 ? "s" : ""}`;
  const rejected = kept.filter((isKept) => !isKept).length;
  assert.deepEqual(shown, [
    "corrected",
    "odometry",
    `${counted(kept.length - rejected)} kept`,
    `${counted(rejected)} rejected`,
  ]);
  const errors = run.record.correction ?? {};
  const caption = await view.locator(".caption").textContent();
  for (const error of [errors.odometry_error_m, errors.corrected_error_m]) {
    if (typeof error === "number") assert.ok(caption.includes(`${error.toFixed(2)} m`), caption);
  }
}

/** Revisits are listed, and one of them leads to its first pair. */
export async function checkRevisits(page) {
  const run = (await embedded(page)).runs[0];
  const listed = page.locator(".revisits button");
  assert.equal(await listed.count(), Math.min(8, run.revisits.length), "revisits");
  const title = await page.textContent("#trajectory h2");
  assert.equal(title, run.positions ? "Trajectory" : "Loops", "the title of the plot of loops");
  if (run.revisits.length === 0) return;
  const text = await listed.first().textContent();
  const frame = Number(text.match(/^\d+/)[0]);
  assert.ok(
    run.revisits.some(({ query, match }) => query[0] === frame && text.includes(` is ${match[0]}`)),
    text,
  );
  await listed.first().click();
  assert.equal(await shownFrame(page), frame, text);
}

/** It goes on by itself, to the end of what the filter shows. */
export async function checkPlay(page) {
  const run = (await embedded(page)).runs[0];
  if (run.frames < 3) return;
  await goTo(page, run.frames - 3);
  const play = page.locator("#pair button", { hasText: "play" });
  await play.click();
  await page.waitForFunction(
    (last) => document.getElementById("frame-number").value === String(last),
    run.frames - 1,
  );
  await page.waitForFunction(() =>
    [...document.querySelectorAll("#pair button")].every(
      (one) => one.textContent !== "play" || one.getAttribute("aria-pressed") === "false",
    ),
  );
}

/** A click or a key shows the pictures as large as the window; arrow keys still walk. */
export async function checkEnlarge(page) {
  const width = async () => (await page.locator(".pictures").boundingBox()).width;
  const small = await width();
  await page.keyboard.press("e");
  assert.ok((await width()) > 0.9 * kWide.width, "not as wide as the window");
  const before = await shownFrame(page);
  await page.keyboard.press(before > 0 ? "ArrowLeft" : "ArrowRight");
  const { frames } = (await embedded(page)).runs[0];
  if (frames > 1) assert.notEqual(await shownFrame(page), before, "arrow keys do not walk");
  await page.keyboard.press("Escape");
  await settled(page);
  assert.equal(await width(), small, "not back in its place");
  await page.click("#pair .pictures");
  assert.ok((await width()) > small, "a click does not enlarge");
  await page.click("#enlarged .pictures");
  await settled(page);
}

async function downloaded(page, selector) {
  // Chromium drops what exceeds ten downloads in a second.
  await page.waitForTimeout(100);
  const [file] = await Promise.all([page.waitForEvent("download"), page.click(selector)]);
  return { name: file.suggestedFilename(), bytes: readFileSync(await file.path()), file };
}

/** Judgements by keys; they stay after a reload, and are saved as truth to `folder`, if given. */
export async function checkReview(page, folder = null) {
  const run = (await embedded(page)).runs[0];
  const loops = run.status.flatMap((_, frame) =>
    isLoop(run, frame) && run.match[frame] >= 0 ? [frame] : [],
  );
  if (loops.length < 4) return;
  await page.locator("[data-filter=loops]").press("Enter");
  const judged = loops.slice(0, 3);
  for (const [i, key] of ["r", "w", "n"].entries()) {
    await goTo(page, judged[i]);
    await page.keyboard.press(key);
    assert.ok((await shownFrame(page)) > judged[i], `${key} does not go on`);
  }
  await goTo(page, judged[1]);
  await page.reload();
  await page.waitForSelector("#pair .picture");
  assert.equal(await textOf(page, "review.count"), "3 judged", "after a reload");
  const pressed = await page.textContent('.review [aria-pressed="true"]');
  assert.equal(pressed, "wrong", "the judgement that is shown");
  const truth = await downloaded(page, '.review button:text-is("truth.csv")');
  const notFalse = await downloaded(page, '.review button:text-is("not_false.csv")');
  for (const { name, file } of [truth, notFalse]) {
    if (folder) await file.saveAs(path.join(folder, name));
  }
  const every = run.record?.input.every ?? 1;
  const isIn = ({ bytes }, frame) =>
    bytes
      .toString()
      .split("\n")
      .slice(1)
      .map((row) => row.split(",").map(Number))
      .some(([query, first, last]) => {
        const match = run.match[frame] * every;
        return query === frame * every && match >= first && match <= last;
      });
  assert.deepEqual(
    judged.map((frame) => isIn(truth, frame)),
    [true, false, false],
    "truth.csv",
  );
  assert.equal(isIn(notFalse, judged[1]), false, "a wrong loop in not_false.csv");
  assert.equal(isIn(notFalse, judged[2]), true, "no unsure loop in not_false.csv");
  await goTo(page, judged[0]);
  for (const [i, key] of ["r", "w", "n"].entries()) {
    await goTo(page, judged[i]);
    await page.keyboard.press(key);
  }
  assert.equal(await textOf(page, "review.count"), "0 judged", "taken back");
  await page.locator("[data-filter=all]").press("Enter");
}

/** Every figure as SVG that the browser draws, and as PNG. */
export async function checkFigures(page) {
  const buttons = await page.$$eval(".save button", (all) =>
    all
      .filter((one) => one.checkVisibility() && /^Save as/.test(one.getAttribute("aria-label")))
      .map((one) => one.getAttribute("aria-label")),
  );
  const plots = await page.$$eval(
    ".plot canvas",
    (all) => all.filter((one) => one.checkVisibility()).length,
  );
  assert.equal(buttons.length, 2 * (plots + 1), `buttons for ${plots} plots and the pair`);
  if ((await page.$("#pair .picture img")) === null) return;
  for (const label of buttons) {
    const { name, bytes } = await downloaded(page, `[aria-label="${label}"]`);
    if (name.endsWith(".png")) {
      assert.equal(bytes.toString("latin1", 1, 4), "PNG", label);
      assert.ok(bytes.readUInt32BE(16) >= 600, `${label} is ${bytes.readUInt32BE(16)} px wide`);
    } else {
      await checkSvg(page, label, bytes.toString());
    }
  }
}

async function checkSvg(page, label, text) {
  const fault = await page.evaluate((source) => {
    const parsed = new DOMParser().parseFromString(source, "image/svg+xml");
    return parsed.querySelector("parsererror")?.textContent ?? null;
  }, text);
  assert.equal(fault, null, label);
  const numbers = text.replaceAll(/href="[^"]*"/g, "");
  assert.doesNotMatch(numbers, /NaN|undefined|Infinity/, label);
  const colours = await page.evaluate(async (source) => {
    const image = new Image();
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(source)}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    canvas.width = image.naturalWidth;
    canvas.height = image.naturalHeight;
    const ctx = canvas.getContext("2d");
    ctx.drawImage(image, 0, 0);
    const { data } = ctx.getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size;
  }, text);
  assert.ok(colours > 8, `${label} is blank`);
}
