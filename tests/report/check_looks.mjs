// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The page fits windows and paper, and can be read in light and dark.
import assert from "node:assert/strict";
import { kWide, settled } from "./browser.mjs";

const kA4Height_px = (297 - 2 * 14) * (96 / 25.4);
const kPaperWidth_px = (210 - 2 * 12) * (96 / 25.4);

/** Texts among the pair's facts that lie over each other. */
const overprinted = () => {
  const boxes = [...document.querySelectorAll("#pair .facts :is(dt, dd)")].map((one) => {
    const range = document.createRange();
    range.selectNodeContents(one);
    return { text: one.textContent, box: range.getBoundingClientRect() };
  });
  const isOver = (a, b) =>
    Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
    Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 8;
  return boxes.flatMap((a, i) =>
    boxes.slice(i + 1).flatMap((b) => (isOver(a.box, b.box) ? [`${a.text}, ${b.text}`] : [])),
  );
};

/** Names of runs may be long: the bars still have room, and the table all of its columns. */
async function checkLongNames(page) {
  const over = await page.$$eval(".scroll", (all) =>
    all.map((table) => table.scrollWidth - table.clientWidth),
  );
  for (const px of over) assert.ok(px <= 0, `${px} px of a table are not to be seen`);
  const bars = await page.$$eval("#times .bar", (all) => all.map((bar) => bar.clientWidth));
  for (const width of bars) assert.ok(width >= 120, `a bar of ${width} px`);
}

export async function checkWidths(page) {
  for (const width of [1440, 1080, 1079, 768, 390, 360]) {
    await page.setViewportSize({ width, height: 800 });
    await settled(page);
    const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(over <= 0, `${width} px wide: ${over} px stick out`);
    const [plot, pair] = await Promise.all(
      ["#trajectory", "#pair"].map((id) => page.locator(id).boundingBox()),
    );
    const isBeside = pair.x >= plot.x + plot.width;
    const isBeneath = pair.y >= plot.y + plot.height - 1;
    assert.ok(width >= 1080 ? isBeside : isBeneath, `${width} px wide: the pair is misplaced`);
    assert.deepEqual(await page.evaluate(overprinted), [], `${width} px wide: facts overprinted`);
  }
  await page.setViewportSize(kWide);
  await settled(page);
  await checkLongNames(page);
}

/** Text that is too faint on what is behind it (WCAG 2, 1.4.3: 4.5 to 1). */
const faintText = () => {
  const rgb = (text) => (text.match(/[\d.]+/g) ?? []).map(Number);
  const luminance = (colour) => {
    const [r, g, b] = colour
      .slice(0, 3)
      .map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const colour = rgb(getComputedStyle(at).backgroundColor);
      if (colour.length === 3 || colour[3] > 0.5) return colour;
    }
    return [255, 255, 255];
  };
  const faint = [];
  for (const element of document.querySelectorAll("main *")) {
    const hasText = [...element.childNodes].some(
      (node) => node.nodeType === 3 && node.textContent.trim(),
    );
    if (!hasText || !element.checkVisibility() || element.closest(":disabled")) continue;
    const [a, b] = [luminance(rgb(getComputedStyle(element).color)), luminance(behind(element))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) faint.push(`${ratio.toFixed(2)}: ${element.textContent.slice(0, 40)}`);
  }
  return faint;
};

export async function checkThemes(page) {
  const paper = () =>
    page.evaluate(() => getComputedStyle(document.documentElement).backgroundColor);
  const canvas = () => page.$eval("#score canvas", (plot) => plot.toDataURL());
  await page.emulateMedia({ colorScheme: "light" });
  const light = [await paper(), await canvas()];
  assert.deepEqual(await page.evaluate(faintText), [], "too faint in light");
  await page.emulateMedia({ colorScheme: "dark" });
  await settled(page);
  const dark = [await paper(), await canvas()];
  assert.notEqual(dark[0], light[0], "the page stays light in the dark");
  assert.notEqual(dark[1], light[1], "the plots stay light in the dark");
  assert.deepEqual(await page.evaluate(faintText), [], "too faint in dark");
  await page.locator("#theme").press("Enter");
  await settled(page);
  assert.equal(await paper(), light[0], "the switch changes nothing");
  await page.locator("#theme").press("Enter");
  await page.emulateMedia({ colorScheme: "light" });
  await page.locator("#theme").press("Enter");
  await settled(page);
}

export async function checkPaper(page) {
  await page.emulateMedia({ media: "print", colorScheme: "dark" });
  await settled(page);
  const seen = await page.evaluate(() => ({
    controls: [...document.querySelectorAll("#pair button, .zoom, .bar-top, #frame-number")].filter(
      (one) => one.checkVisibility(),
    ).length,
    paper: getComputedStyle(document.documentElement).backgroundColor,
    tables: [...document.querySelectorAll(".scroll")].map(
      (table) => table.scrollWidth - table.clientWidth,
    ),
    blocks: [...document.querySelectorAll("#summary, section")].map((one) => {
      const { width, height } = one.getBoundingClientRect();
      return { name: one.id, width, height };
    }),
  }));
  assert.equal(seen.controls, 0, "controls on paper");
  assert.equal(seen.paper, "rgb(255, 255, 255)", "paper is not white");
  for (const over of seen.tables) assert.ok(over <= 0, `${over} px of a table stick out`);
  for (const { name, width, height } of seen.blocks) {
    assert.ok(height <= kA4Height_px, `${name} is cut: ${height.toFixed(0)} px high`);
    assert.ok(width <= kPaperWidth_px, `${name} is too wide: ${width.toFixed(0)} px`);
  }
  await page.emulateMedia({ media: "screen", colorScheme: "light" });
  await settled(page);
  const pdf = await page.pdf({ preferCSSPageSize: true, printBackground: true });
  assert.ok(pdf.length > 20_000, "the print is empty");
  await settled(page);
}
