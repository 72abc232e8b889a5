// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The live page in a real browser, while a run goes on at a camera's rate:
//
//   node live_test.mjs --run LIVE_RUN --loopbit LOOPBIT [--frames N] [--rate N] [--viewers N]
//                      [--playwright DIR] [--screenshots DIR] [--strict yes]
//
// --run: the program of live_run.cpp. It prints what a frame costs with and without viewers. The full form:
// --frames 1000 --rate 30 --strict yes,
// which fails if a frame is dropped; a machine with other work may drop some.
import assert from "node:assert/strict";
import { execFileSync, spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { get } from "node:http";
import { tmpdir } from "node:os";
import path from "node:path";
import { createInterface } from "node:readline";
import { drawn, goTo, kWide, launch, shownFrame, textOf } from "./browser.mjs";
import { checkNumbers } from "./check_numbers.mjs";

const kPhone = { width: 390, height: 844 };

function argumentsOf(words) {
  const found = { run: null, loopbit: null, frames: "80", rate: "10", viewers: "3" };
  found.playwright = "node_modules";
  found.screenshots = null;
  found.strict = null;
  for (let i = 0; i < words.length; i += 2) {
    const name = words[i].slice(2);
    assert.ok(name in found && words[i + 1], `unknown argument, or without a value: ${words[i]}`);
    found[name] = words[i + 1];
  }
  assert.ok(found.run && found.loopbit, "--run LIVE_RUN --loopbit LOOPBIT");
  return found;
}

/** Frames are lost only where that is asked for: the page cannot show them. */
const buffers = (given) => (given.strict ? "4" : given.frames);

/** A program, and its lines of output one by one. */
function start(program, ...words) {
  const child = spawn(program, words, { stdio: ["pipe", "pipe", "pipe"] });
  const told = [];
  createInterface({ input: child.stderr }).on("line", (line) => told.push(line));
  const lines = createInterface({ input: child.stdout })[Symbol.asyncIterator]();
  const ended = new Promise((done) => child.on("close", done));
  return { child, told, ended, line: async () => (await lines.next()).value };
}

/** A page at `url`, and what it did wrong so far. */
async function visit(browser, url, viewport = kWide) {
  const context = await browser.newContext({ viewport });
  const page = await context.newPage();
  page.setDefaultTimeout(120_000);
  const faults = [];
  page.on("pageerror", (error) => faults.push(`exception: ${error.message}`));
  page.on("console", (message) => {
    // A picture that is not there yet is no fault.
    const isFault = message.type() === "error" && !/pictures\/|404/.test(message.text());
    if (isFault) faults.push(message.text());
  });
  page.on("request", (request) => {
    const to = request.url();
    if (!to.startsWith(url) && !/^(data|blob):/.test(to)) faults.push(`request: ${to}`);
  });
  await page.goto(url);
  return { page, faults, close: () => context.close() };
}

/** Waits for the live page to show `frames`. */
const shows = (page, frames) =>
  page.waitForFunction(
    (least) => {
      const shown = document.querySelector("[data-key=frames]")?.textContent ?? "0";
      return Number(shown.replaceAll(",", "")) >= least;
    },
    frames,
    { polling: 50 },
  );

/** The page shows the finished report, and its numbers are those of run.json. */
async function checkFinished(page, folder) {
  await page.waitForFunction(
    () =>
      performance.getEntriesByName("report-drawn").length > 0 &&
      document.querySelector("[data-key=live]") === null,
  );
  await drawn(page);
  await checkNumbers(page, JSON.parse(readFileSync(path.join(folder, "run.json"), "utf8")));
}

async function pictureOf(page, folder, name) {
  if (folder) await page.screenshot({ path: path.join(folder, `${name}.png`), fullPage: true });
}

/** The answer to a request, and the first `bytes` of its body. */
const ask = (url, headers = {}, bytes = 300) =>
  new Promise((done, failed) => {
    get(url, { headers }, (answer) => {
      let body = "";
      answer.on("data", (part) => {
        body += part;
        if (body.length >= bytes) answer.destroy();
      });
      answer.on("close", () => done({ status: answer.statusCode, body: body.slice(0, bytes) }));
    }).on("error", failed);
  });

/** A viewer that comes back goes on where it was; pages of elsewhere get nothing. */
async function checkServer(page, url) {
  const data = JSON.parse(await page.textContent("#report-data"));
  const events = `${url}events/${data.live}`;
  assert.match((await ask(events)).body, /^id: \d+\ndata: {"from":0,/);
  assert.match((await ask(events, { "Last-Event-ID": "7" })).body, /^id: \d+\ndata: {"from":7,/);
  assert.equal((await ask(`${url}events/0123`)).body, "event: end\ndata: load\n\n", "another run");
  assert.equal((await ask(`${url}pictures/999999`)).status, 404);
  assert.equal((await ask(`${url}pictures/x`)).status, 404);
  assert.equal((await ask(url, { Host: "127.0.0.1.example.org" })).status, 403);
  assert.equal((await ask(url, { Host: "localhost" })).status, 200);
}

/** A run at a camera's rate with viewers who look at it; returns what it cost. */
async function checkCamera(browser, given, images, scratch) {
  const frames = Number(given.frames);
  const folder = path.join(scratch, "watched");
  const run = start(given.run, images, folder, given.rate, buffers(given), "live");
  const url = await run.line();
  const viewers = [];
  for (let i = 0; i < Number(given.viewers); ++i)
    viewers.push(await visit(browser, url, i === 1 ? kPhone : kWide));
  const [first, phone] = viewers;
  for (const { page } of viewers) await page.waitForSelector("[data-key=live]");
  run.child.stdin.write("\n");
  await shows(first.page, frames / 4);
  await first.page.waitForSelector("#pair .picture img");
  assert.match(await textOf(first.page, "live"), /live, [\d.]+ frames\/s/);
  // Another frame is looked at meanwhile: the page no longer follows, and grows all the same.
  await goTo(first.page, 3);
  await shows(first.page, frames / 3);
  assert.equal(await shownFrame(first.page), 3, "leaves the frame that was chosen");
  await first.page.click("[data-key=live] button");
  await shows(first.page, frames / 2);
  await first.page.waitForFunction(() => Number(document.getElementById("frame-number").value) > 3);
  await checkServer(first.page, url);
  await shows(first.page, (3 * frames) / 4);
  await pictureOf(first.page, given.screenshots, "live");
  if (phone) await pictureOf(phone.page, given.screenshots, "live_phone");
  run.child.stdin.write("\n");
  const cost = JSON.parse(await run.line());
  for (const { page, faults, close } of viewers) {
    await checkFinished(page, folder);
    assert.deepEqual(faults, []);
    if (page === first.page) await pictureOf(page, given.screenshots, "finished");
    await close();
  }
  assert.equal(await run.ended, 0);
  return cost;
}

/** The command, for others than this machine: the token, the port, and Ctrl-C, which ends all in order. */
async function checkCommand(browser, given, images, scratch) {
  const folder = path.join(scratch, "command");
  const list = path.join(scratch, "long.txt");
  const names = Array.from({ length: Number(given.frames) }, (_, i) =>
    path.join(images, `${String(i).padStart(6, "0")}.png`),
  );
  writeFileSync(list, Array(50).fill(names.join("\n")).join("\n"));
  const flags = ["--out", folder, "--live", "0", "--live-address", "0.0.0.0", "--quiet"];
  const run = start(given.loopbit, "run", list, ...flags);
  while (run.told.length === 0) await new Promise((done) => setTimeout(done, 20));
  const url = run.told[0].match(/http:\S+/)[0].replace(/\/\/[^:]+:/, "//127.0.0.1:");
  const { port, pathname, origin } = new URL(url);
  assert.match(pathname, /^\/[0-9a-f]{32}\/$/, "no token");
  assert.equal((await ask(`${origin}/`)).status, 404);
  const second = spawnSync(given.loopbit, ["run", list, "--live", port], { encoding: "utf8" });
  assert.equal(second.status, 2);
  assert.match(second.stderr, new RegExp(`cannot be served on 127.0.0.1 port ${port} \\(`));
  const swallowed = spawnSync(given.loopbit, ["run", "--live", list, "--json"], {
    encoding: "utf8",
  });
  assert.equal(swallowed.status, 2);
  assert.match(
    swallowed.stderr,
    /is not a whole number from 0 to 65535; write INPUT before --live/,
  );
  const viewer = await visit(browser, url);
  await shows(viewer.page, 20);
  run.child.kill("SIGINT");
  assert.equal(await run.ended, 130, run.told.join("\n"));
  await checkFinished(viewer.page, folder);
  assert.match(await viewer.page.textContent(".notice"), /interrupted/);
  assert.deepEqual(viewer.faults, []);
  await viewer.close();
}

const given = argumentsOf(process.argv.slice(2));
const scratch = mkdtempSync(path.join(tmpdir(), "loopbit-live-"));
try {
  const spacing_m = Math.max(0.9, 225 / Number(given.frames));
  const town = ["width_px=320", "height_px=240", "laps=2", `spacing_m=${spacing_m}`];
  execFileSync(given.loopbit, [
    ...["demo", "--frames", given.frames, "--write-images", path.join(scratch, "town")],
    ...town.flatMap((setting) => ["--world", setting]),
  ]);
  const images = path.join(scratch, "town", "images");
  const alone = start(given.run, images, path.join(scratch, "alone"), given.rate, buffers(given));
  const without = JSON.parse(await alone.line());
  const browser = await launch(given.playwright);
  const watched = await checkCamera(browser, given, images, scratch);
  console.log("alone  ", JSON.stringify(without));
  console.log("watched", JSON.stringify(watched));
  await checkCommand(browser, given, images, scratch);
  await browser.close();
  assert.equal(watched.frames + watched.dropped, Number(given.frames));
  if (given.strict) assert.equal(watched.dropped, 0, "frames were dropped");
} finally {
  rmSync(scratch, { recursive: true, force: true });
}
