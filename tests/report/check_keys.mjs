// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The page works without a pointer, and says what it is to those who do not see it.
import assert from "node:assert/strict";
import {
  address,
  assertShows,
  drawn,
  embedded,
  framesAfter,
  goTo,
  isMissed,
  kWide,
  settled,
  shownFrame,
  textOf,
} from "./browser.mjs";

const framesWith = (run, filter) =>
  run.verdict.flatMap((verdict, i) => {
    if (filter === "all") return [i];
    if (filter === "missed") return isMissed(run, i) ? [i] : [];
    const isIn =
      filter === "loops" ? run.status_names[run.status[i]] === "loop" : verdict === filter;
    return isIn ? [i] : [];
  });

/**
 * Arrow keys, Home and End walk exactly the frames that the filter lets through. `isBrief`: the page
 * gets the keys all at once, because drawing every frame takes most of the time.
 */
export async function checkFilters(page, isBrief) {
  const run = (await embedded(page)).runs[0];
  for (const filter of ["all", "loops", "right", "wrong", "missed", "tolerated", "elsewhere"]) {
    const frames = framesWith(run, filter);
    const button = page.locator(`[data-filter=${filter}]`);
    if (frames.length === 0) {
      assert.ok((await button.isDisabled()) || !(await button.isVisible()), `${filter} of nothing`);
      continue;
    }
    await button.press("Enter");
    assert.equal(await button.getAttribute("aria-pressed"), "true", filter);
    assert.ok(frames.includes(await shownFrame(page)), `${filter}: a frame that it leaves out`);
    const steps = Math.min(5, frames.length);
    const keys = ["Home", ...Array(steps - 1).fill("ArrowRight"), "End", "ArrowLeft"];
    const walked = await framesAfter(page, keys, isBrief);
    const [last, lastButOne] = walked.splice(steps);
    assert.deepEqual(walked, frames.slice(0, steps), `${filter}: walked`);
    assert.equal(last, frames.at(-1), `${filter}: the last`);
    assert.equal(lastButOne, frames.at(-2) ?? frames.at(-1), `${filter}: the last but one`);
    const gap = frames.findIndex((frame, i) => frames[i + 1] > frame + 1);
    if (gap < 0) continue;
    await goTo(page, frames[gap] + 1);
    const [next, back] = await framesAfter(page, ["ArrowRight", "ArrowLeft"], isBrief);
    assert.equal(next, frames[gap + 1], `${filter}: from a frame it leaves out`);
    assert.equal(back, frames[gap], `${filter}: back over a gap`);
  }
  await page.locator("[data-filter=all]").press("Enter");
}

/** A missed frame beside its best candidate or its true place, where these are different. */
export async function checkTruePlace(page) {
  const run = (await embedded(page)).runs[0];
  const triples = run.truth?.same_place ?? [];
  const isTruePlace = (frame, place) =>
    triples.some(
      (query, i) =>
        i % 3 === 0 && query === frame && place >= triples[i + 1] && place <= triples[i + 2],
    );
  const missed = run.verdict.findIndex(
    (verdict, frame) => verdict === "missed" && !isTruePlace(frame, run.match[frame]),
  );
  if (missed < 0) return;
  await goTo(page, missed);
  await page.locator(".partners button", { hasText: "true place" }).press("Enter");
  await settled(page);
  const tag = await page.textContent("#pair .picture:nth-child(2) .tag");
  assert.match(tag, /^true place \d+$/, "the picture is called another name");
  const shown = Number(tag.match(/\d+/)[0]);
  const names = await page.$$eval("#pair .contents :is(img, canvas)", (all) =>
    all.map((one) => one.alt ?? one.getAttribute("aria-label")),
  );
  assert.ok(!names.some((name) => /match|candidate/.test(name)), `maps are called ${names}`);
  const earlier = run.earlier_match?.[missed];
  if (run.inliers && (earlier || run.match[missed] >= 0)) {
    const whose = await textOf(page, "pair.whose");
    const candidate = earlier?.join(":") ?? run.match[missed];
    assert.match(whose, new RegExp(` ${candidate}, which is not shown`), "whose numbers");
    assertShows(await textOf(page, "pair.inliers"), run.inliers[missed], "the match's inliers");
  } else {
    assert.equal(await textOf(page, "pair.inliers"), "–", "inliers of nothing");
  }
  assert.ok(isTruePlace(missed, shown), `${shown} is no true place of ${missed}`);
  assert.equal((await address(page)).with, "truth");
  const focused = await page.evaluate(() => document.activeElement.textContent);
  assert.match(focused, /true place/, "the choice loses the focus");
}

export async function checkAddress(page) {
  const run = (await embedded(page)).runs[0];
  const frame = Math.floor(run.frames / 2);
  await goTo(page, frame);
  if (run.frames > 1) assert.equal((await address(page)).frame, String(frame));
  await page.reload();
  await drawn(page);
  assert.equal(await shownFrame(page), frame, "after a reload");
  await page.evaluate(() => {
    location.hash = "#frame=0";
  });
  await page.waitForFunction(() => document.getElementById("frame-number").value === "0");
}

/** Arrow keys move the table where it is too wide, else they walk. */
export async function checkTable(page) {
  if ((await page.$(".scroll .comparison")) === null) return;
  const table = page.locator(".scroll", { has: page.locator(".comparison") });
  await goTo(page, 0);
  await page.setViewportSize({ width: 390, height: 800 });
  await table.focus();
  for (const key of ["ArrowRight", "End"]) await page.keyboard.press(key);
  assert.equal(await shownFrame(page), 0, "a key for the table walks, too");
  await page.waitForFunction((element) => element.scrollLeft > 0, await table.elementHandle());
  await page.setViewportSize(kWide);
  await settled(page);
  await table.focus();
  await page.keyboard.press("ArrowRight");
  assert.equal(await shownFrame(page), 1, "a table that shows all of itself takes keys");
}

export async function checkHelp(page) {
  await page.keyboard.press("?");
  assert.ok(await page.isVisible("#keys"), "? shows no keys");
  await page.keyboard.press("Escape");
  assert.ok(!(await page.isVisible("#keys")), "Esc leaves the keys open");
  const before = await shownFrame(page);
  await page.focus("#frame-number");
  await page.keyboard.press("ArrowRight");
  assert.equal(await shownFrame(page), before, "arrow keys walk while a number is typed");
  await page.fill("#frame-number", "nonsense");
  await page.keyboard.press("Enter");
  assert.equal(await shownFrame(page), before, "nonsense selects a frame");
  await page.evaluate(() => document.activeElement.blur());
}

/** By Tab alone one comes to every control, and sees where one is. */
export async function checkTabs(page) {
  await page.evaluate(() => document.activeElement.blur());
  const reached = new Set();
  for (let i = 0; i < 120; ++i) {
    await page.keyboard.press("Tab");
    const state = await page.evaluate(() => {
      const focused = document.activeElement;
      if (!focused || focused === document.body) return null;
      focused.dataset.reached = "";
      return {
        name: focused.outerHTML.slice(0, 80),
        outline: getComputedStyle(focused).outlineStyle,
      };
    });
    if (!state) break;
    assert.notEqual(state.outline, "none", `the focus cannot be seen: ${state.name}`);
    reached.add(state.name);
  }
  const missed = await page.$$eval("button, input, summary, [tabindex='0']", (all) =>
    all
      .filter((one) => one.checkVisibility() && !one.disabled && !("reached" in one.dataset))
      .map((one) => one.outerHTML.slice(0, 90)),
  );
  assert.deepEqual(missed, [], "Tab never comes to these");
  return reached.size;
}

/** Names for controls, captions for tables, alternatives for pictures. */
export async function checkNames(page) {
  const nameless = await page.evaluate(() => {
    const problems = [];
    for (const one of document.querySelectorAll(
      "button, input, summary, section, [role=group], [role=img]",
    )) {
      const labelled = one.getAttribute("aria-labelledby");
      const name =
        one.getAttribute("aria-label") ??
        (labelled ? document.getElementById(labelled)?.textContent : one.textContent);
      if (!name?.trim()) problems.push(one.outerHTML.slice(0, 90));
    }
    for (const table of document.querySelectorAll("table")) {
      if (!table.caption && !table.hasAttribute("aria-labelledby"))
        problems.push("a table without caption");
    }
    for (const image of document.images)
      if (!image.hasAttribute("alt")) problems.push("a picture without alt");
    return problems;
  });
  assert.deepEqual(nameless, [], "without a name");
}
