// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A headless Chromium that tells of everything a report may not do.
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";

const kFlags = [
  "--headless",
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

export const kWide = { width: 1440, height: 900 };

/** `modules`: the node_modules that holds playwright-core. */
export async function launch(modules) {
  const require = createRequire(path.join(path.resolve(modules), "anchor.js"));
  const { chromium } = require("playwright-core");
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium-headless-shell",
    args: kFlags,
  });
}

/** A page that shows `file`, and the list of what it did wrong so far. */
export async function open(
  browser,
  file,
  { hash = "", viewport = kWide, colorScheme = "light" } = {},
) {
  const context = await browser.newContext({ viewport, colorScheme, offline: true });
  const page = await context.newPage();
  // A busy machine may take longer than the 30 s that are usual.
  page.setDefaultTimeout(120_000);
  const faults = [];
  const url = pathToFileURL(path.resolve(file)).href;
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) faults.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => faults.push(`exception: ${error.message}`));
  page.on("request", (request) => {
    const to = request.url().split("#")[0];
    if (to !== url && !/^(data|blob):/.test(to)) faults.push(`request: ${to}`);
  });
  await page.goto(url + hash);
  await drawn(page);
  return { page, faults, close: () => context.close() };
}

/** After loading: everything is there. */
export async function drawn(page) {
  await page.waitForFunction(() => performance.getEntriesByName("report-drawn").length > 0);
  await page.waitForSelector("#pair .picture");
  await settled(page);
}

/** Pictures are decoded and plots drawn. */
export async function settled(page) {
  await page.evaluate(async () => {
    const frame = () => new Promise((done) => requestAnimationFrame(done));
    await Promise.all([...document.images].map((image) => image.decode().catch(() => {})));
    await frame();
    await frame();
  });
}

const embeddedData = new WeakMap();

/** The report's data; a page keeps them for as long as it is open, and fetching megabytes takes time. */
export async function embedded(page) {
  if (!embeddedData.has(page)) {
    const text = await page.textContent("#report-data");
    embeddedData.set(page, JSON.parse(text));
  }
  return embeddedData.get(page);
}

export const textOf = (page, key) =>
  page.evaluate((name) => document.querySelector(`[data-key="${name}"]`)?.textContent ?? null, key);

/** The text shows `value`, rounded to as many digits as it has. */
export function assertShows(text, value, what) {
  assert.ok(text !== null, `${what} is not on the page`);
  const digits = text.replaceAll(",", "").match(/-?\d+(?:\.(\d+))?/);
  assert.ok(digits, `${what}: '${text}' holds no number, not ${value}`);
  const unit = 10 ** -(digits[1]?.length ?? 0);
  const apart = Math.abs(Number(digits[0]) - value);
  assert.ok(apart <= 0.5001 * unit, `${what}: the page says '${text}', the data ${value}`);
}

/** Selects a frame by its number, without the keys that enter it: checkSearch() presses those. */
export async function goTo(page, frame) {
  await page.evaluate((number) => {
    const field = document.getElementById("frame-number");
    field.value = number;
    field.dispatchEvent(new Event("change"));
    document.activeElement.blur();
  }, String(frame));
  await settled(page);
}

export const shownFrame = (page) =>
  page.evaluate(() => Number(document.getElementById("frame-number").value));

/** The selected frame after each of `keys`. If `isAtOnce`, nothing is drawn in between. */
export async function framesAfter(page, keys, isAtOnce) {
  if (isAtOnce) {
    return page.evaluate((all) => {
      const field = document.getElementById("frame-number");
      return all.map((key) => {
        dispatchEvent(new KeyboardEvent("keydown", { key }));
        return Number(field.value);
      });
    }, keys);
  }
  const frames = [];
  for (const key of keys) {
    await page.keyboard.press(key);
    frames.push(await shownFrame(page));
  }
  return frames;
}

/** Name and value of the address after '#'. */
export const address = async (page) =>
  Object.fromEntries(new URLSearchParams(new URL(page.url()).hash.slice(1)));

/** Whether truth lists an earlier place for the frame, and its loop, if any, is not right. */
export function isMissed(run, frame) {
  const verdict = run.verdict[frame];
  const isRevisit = run.truth?.same_place.some((query, i) => i % 3 === 0 && query === frame);
  return verdict === "missed" || (verdict === "wrong" && isRevisit === true);
}
