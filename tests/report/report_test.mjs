// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The report page in a real browser:
//
//   node report_test.mjs [--report FILE [--run-json FILE]]... [--brief FILE [--run-json FILE]]...
//                        [--page FILE] [--playwright DIR] [--screenshots DIR] [--opens FILE]
//                        [--exports DIR]
//
// --report: a page as the command writes it, and the run.json it must agree with.
// --brief: another one, which differs in its data: looks and keys are not tested again.
// --page: the page before data is put into it; it is tested with made-up data of many kinds.
// --opens: a page of which only that is asked: that it opens without a fault.
// --exports: where judgements of the first report are saved as truth.csv and not_false.csv.
// --playwright: the node_modules that holds playwright-core. CHROMIUM names the browser.
import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { embedded, launch, open, settled } from "./browser.mjs";
import {
  checkAddress,
  checkFilters,
  checkHelp,
  checkNames,
  checkTable,
  checkTabs,
  checkTruePlace,
} from "./check_keys.mjs";
import { checkPaper, checkThemes, checkWidths } from "./check_looks.mjs";
import { checkNumbers, checkPairs } from "./check_numbers.mjs";
import {
  checkCorrection,
  checkEnlarge,
  checkFigures,
  checkPlay,
  checkReview,
  checkRevisits,
  checkSearch,
  checkWeakest,
} from "./check_review.mjs";
import { checkCell, checkDrawn, checkViews } from "./check_views.mjs";
import { pageWith, sampleData } from "./sample.mjs";

const kSamples = {
  "several revisits": {},
  "no truth": { truth: false },
  "no poses": { poses: false },
  "no pictures": { pictures: false },
  "no loops": { noLoops: true },
  "no revisits": { noRevisits: true },
  "neither loops nor revisits": { noRevisits: true, noLoops: true },
  "a map's later session": { map: true },
  "a map's later session, no truth": { map: true, truth: false },
  "a run that was killed": { cutOff: true },
  "one slow frame": { slowFrame: true },
  "no room for pictures": { picturesMb: 0.2 },
  "unreadable frames": { frames: 150, unreadable: true },
  "another detector": { external: true },
  "another detector, frames not known": { external: true, truth: false, poses: false },
  "three runs": { runs: 3, external: true, longNames: true },
  "one frame": { frames: 1 },
  "a wrong loop at a revisit": { frames: 600 },
  "two frames": { frames: 2, truth: false, poses: false },
};
/** Most of a check is waiting for what is on the screen. */
const kReportsAtOnce = 3;
/** The samples that also stand for looks and keys; the others differ in data only, and are looked at in
 * fewer places. */
const kInFull = ["several revisits", "three runs", "one frame"];

function argumentsOf(words) {
  const found = {
    reports: [],
    page: null,
    playwright: "node_modules",
    screenshots: null,
    opens: null,
    exports: null,
  };
  for (let i = 0; i < words.length; i += 2) {
    const [name, value] = [words[i], words[i + 1]];
    assert.ok(value, `${name} needs a value`);
    if (["--report", "--brief"].includes(name))
      found.reports.push({ file: value, runJson: null, isBrief: name === "--brief" });
    else if (name === "--run-json") found.reports.at(-1).runJson = value;
    else if (["--page", "--playwright", "--screenshots", "--opens", "--exports"].includes(name))
      found[name.slice(2)] = value;
    else assert.fail(`unknown argument ${name}`);
  }
  assert.ok(
    found.reports.length > 0 || found.page || found.opens,
    "nothing to test: --report, --page or --opens FILE",
  );
  return found;
}

async function takePictures(page, folder, name) {
  if (!folder) return;
  mkdirSync(folder, { recursive: true });
  for (const [width, colorScheme] of [
    [1440, "light"],
    [1440, "dark"],
    [390, "light"],
  ]) {
    await page.setViewportSize({ width, height: 900 });
    await page.emulateMedia({ colorScheme });
    await settled(page);
    const file = `${name.replaceAll(/\W+/g, "_")}_${width}_${colorScheme}.png`;
    await page.screenshot({ path: path.join(folder, file), fullPage: true });
  }
}

/**
 * All checks of one report, or those that depend on the data; returns the names of the failed. They
 * share a page, for opening it takes longer than most of them; after a failure it is opened anew.
 */
async function checkReport(
  browser,
  file,
  name,
  { runJson = null, screenshots = null, exports = null, isBrief = false } = {},
) {
  const failed = [];
  const passed = [];
  let opened = null;
  const close = async () => {
    await opened?.close();
    opened = null;
  };
  // A busy machine may show the page later than a check expects, so that a check has a second try; but
  // not where the page did what it may not do.
  const run = async (what, check) => {
    for (const isLastTry of [false, true]) {
      try {
        opened ??= await open(browser, file);
        const said = await check(opened.page);
        assert.deepEqual(opened.faults, [], "the page did what it may not do");
        passed.push(said === undefined ? what : `${what} (${said})`);
        return;
      } catch (error) {
        const isFailed = isLastTry || (opened?.faults.length ?? 0) > 0;
        const message = String(error.message).replaceAll("\n", "\n        ");
        console.log(`${isFailed ? "FAILED" : "again "}  ${name}: ${what}\n        ${message}`);
        await close();
        if (!isFailed) continue;
        failed.push(`${name}: ${what}`);
        return;
      }
    }
  };
  await run("drawn", checkDrawn);
  await run("numbers", (page) => checkNumbers(page, runJson));
  await run("pairs", async (page) => `${await checkPairs(page, isBrief)} times xi compared`);
  await run("clicks, hovering, zoom", (page) => checkViews(page, isBrief));
  await run("filters and arrow keys", (page) => checkFilters(page, isBrief));
  await run("true place", checkTruePlace);
  await run("search", checkSearch);
  await run("revisits", checkRevisits);
  await run("correction", checkCorrection);
  await run("weakest first", checkWeakest);
  if (!isBrief) {
    await run("play", checkPlay);
    await run("enlarge", checkEnlarge);
    await run("figures as files", checkFigures);
    await run("judgements", (page) => checkReview(page, exports));
    // It loads the page again, which the next needs: Tab goes on from where one was last.
    await run("address", checkAddress);
    await run("by Tab alone", async (page) => `${await checkTabs(page)} controls`);
    await run("help and number", checkHelp);
    await run("keys in the table", checkTable);
    await run("names", checkNames);
    await run("widths", checkWidths);
    await run("paper", checkPaper);
    // Last, for it leaves a theme chosen.
    await run("themes and contrast", checkThemes);
    await close();
    if (screenshots) await run("pictures of it", (page) => takePictures(page, screenshots, name));
  }
  await close();
  if (passed.length > 0) console.log(`ok      ${name}: ${passed.join(", ")}`);
  return failed;
}

/** 10,000 frames: how large, how soon on the screen, how soon after a key. */
async function checkSpeed(browser, template, scratch) {
  const file = path.join(scratch, "large.html");
  const data = sampleData({ frames: 10_000, picturesMb: 12 });
  writeFileSync(file, pageWith(template, data));
  let opened = null;
  try {
    opened = await open(browser, file);
    const { page, faults } = opened;
    const { paint, done } = await page.evaluate(() => ({
      paint: performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? Number.NaN,
      done: performance.getEntriesByName("report-drawn")[0]?.startTime ?? Number.NaN,
    }));
    const times = [];
    for (let i = 0; i < 21; ++i) {
      times.push(
        await page.evaluate(async () => {
          const begin = performance.now();
          dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
          await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
          return performance.now() - begin;
        }),
      );
    }
    const select = times.sort((a, b) => a - b)[10];
    const size = statSync(file).size / 1e6;
    console.log(
      `        10,000 frames: ${size.toFixed(1)} MB, first paint ${paint.toFixed(0)} ms, all drawn ${done.toFixed(0)} ms, a key ${select.toFixed(0)} ms`,
    );
    const { runs } = await embedded(page);
    assert.equal(runs[0].frames, 10_000);
    await checkDrawn(page);
    await checkCell(page, runs[0]);
    assert.deepEqual(faults, []);
    console.log("ok      10,000 frames: speed");
    return [];
  } catch (error) {
    console.log(`FAILED  10,000 frames: speed\n        ${error.message}`);
    return ["10,000 frames: speed"];
  } finally {
    await opened?.close();
  }
}

async function checkOpens(browser, file) {
  try {
    const { faults, close } = await open(browser, file);
    assert.deepEqual(faults, []);
    await close();
    console.log(`ok      ${path.basename(file)}: opens`);
    return [];
  } catch (error) {
    console.log(`FAILED  ${path.basename(file)}: opens\n        ${error.message}`);
    return [`${path.basename(file)}: opens`];
  }
}

/** A function for each report, which checks it in a browser. */
function* checksOfReports({ reports, page, screenshots, opens, exports }, scratch) {
  if (opens) yield (browser) => checkOpens(browser, opens);
  for (const [i, { file, runJson, isBrief }] of reports.entries()) {
    const record = runJson ? JSON.parse(readFileSync(runJson, "utf8")) : null;
    const name = path.basename(path.dirname(path.resolve(file)));
    const saved = i === 0 ? exports : null;
    yield (browser) =>
      checkReport(browser, file, name, { runJson: record, screenshots, exports: saved, isBrief });
  }
  if (!page) return;
  const template = readFileSync(page, "utf8");
  for (const [i, [name, options]] of Object.entries(kSamples).entries()) {
    const isBrief = !kInFull.includes(name);
    yield (browser) => {
      const file = path.join(scratch, `${i}.html`);
      writeFileSync(file, pageWith(template, sampleData(options)));
      return checkReport(browser, file, name, { screenshots, isBrief });
    };
  }
  yield (browser) => checkSpeed(browser, template, scratch);
}

async function main() {
  const wanted = argumentsOf(process.argv.slice(2));
  const scratch = mkdtempSync(path.join(tmpdir(), "loopbit_report_"));
  const failed = [];
  const checks = [...checksOfReports(wanted, scratch)].values();
  const takeTurns = async () => {
    const browser = await launch(wanted.playwright);
    try {
      for (const check of checks) failed.push(...(await check(browser)));
    } finally {
      await browser.close();
    }
  };
  try {
    await Promise.all(Array.from({ length: kReportsAtOnce }, takeTurns));
  } finally {
    rmSync(scratch, { recursive: true });
  }
  if (failed.length > 0) console.log(`\n${failed.length} failed:\n  ${failed.join("\n  ")}`);
  process.exitCode = failed.length > 0 ? 1 : 0;
}

await main();
