// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The documentation site in a headless Chromium, from disk and without a network:
//
//   node site_test.mjs SITE [--playwright DIR] [--screenshots DIR]
//
// No page may log an error, ask for anything that is not there, or be wider than its window, and
// the button for the theme changes the colours.
import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { launch } from "../report/browser.mjs";

const kLooks = [
  [1440, "light"],
  [1440, "dark"],
  [390, "light"],
  [390, "dark"],
];

/** The value after a name on the command line. */
const argumentOf = (words, name) => (words.includes(name) ? words[words.indexOf(name) + 1] : null);

/** Brightness of a colour as the browser writes it, from 0 to 255. */
const brightness = (colour) => {
  const [r, g, b] = colour.match(/[\d.]+/g).map(Number);
  return 0.299 * r + 0.587 * g + 0.114 * b;
};

const coloursOf = (page) =>
  page.evaluate(() => {
    const of = (element) => element && getComputedStyle(element).backgroundColor;
    return { body: of(document.body), code: of(document.querySelector(".highlight")) };
  });

async function checkColours(page, isDark) {
  const { body, code } = await coloursOf(page);
  assert.equal(brightness(body) < 128, isDark, `the page is ${body}`);
  if (code) assert.equal(brightness(code) < 128, isDark, `code is ${code} on ${body}`);
}

async function checkPage(browser, file, screenshots) {
  const page = await browser.newPage({ offline: true });
  const faults = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) faults.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => faults.push(`exception: ${error.message}`));
  page.on("requestfailed", (request) => faults.push(`request: ${request.url()}`));
  await page.goto(pathToFileURL(file).href);
  for (const [width, colorScheme] of kLooks) {
    await page.setViewportSize({ width, height: 900 });
    await page.emulateMedia({ colorScheme });
    await checkColours(page, colorScheme === "dark");
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(wide <= width, `${wide} px wide in a window of ${width} px`);
    if (!screenshots) continue;
    const name = `${path.basename(file, ".html")}_${width}_${colorScheme}.png`;
    await page.screenshot({ path: path.join(screenshots, name) });
  }
  assert.deepEqual(faults, []);
  await page.close();
}

/** From the system's theme to the other one, by the button. */
async function checkThemeButton(browser, file) {
  const page = await browser.newPage({ viewport: { width: 1440, height: 900 } });
  await page.goto(pathToFileURL(file).href);
  await page.locator(".theme-toggle:visible").first().click();
  const first = await coloursOf(page);
  await page.locator(".theme-toggle:visible").first().click();
  assert.notDeepEqual(await coloursOf(page), first, "the button for the theme does nothing");
  await page.close();
}

async function main() {
  const words = process.argv.slice(2);
  const site = path.resolve(words[0] ?? assert.fail("which site?"));
  const browser = await launch(argumentOf(words, "--playwright") ?? "node_modules");
  const files = readdirSync(site).filter((name) => name.endsWith(".html"));
  assert.ok(files.length > 0, `${site} has no pages`);
  const failed = [];
  const run = async (what, check) => {
    try {
      await check();
    } catch (error) {
      failed.push(what);
      console.log(`FAILED  ${what}\n        ${error.message.replaceAll("\n", "\n        ")}`);
    }
  };
  const screenshots = argumentOf(words, "--screenshots");
  for (const name of files) {
    await run(name, () => checkPage(browser, path.join(site, name), screenshots));
  }
  await run("theme", () => checkThemeButton(browser, path.join(site, "index.html")));
  await browser.close();
  console.log(`site: ${files.length} pages, ${failed.length} checks failed`);
  process.exitCode = failed.length > 0 ? 1 : 0;
}

await main();
