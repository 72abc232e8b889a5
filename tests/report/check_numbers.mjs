// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The numbers on the page are those of the data and of run.json.
import assert from "node:assert/strict";
import { assertShows, embedded, goTo, settled, textOf } from "./browser.mjs";

const kSteps = ["content", "retrieval", "features", "verification"];
const kFilters = ["loops", "right", "wrong", "missed", "tolerated"];

/** The nth readable time from below, as run.json counts. */
function summaryOf(run, times) {
  const readable = times.filter((_, i) => run.status_names[run.status[i]] !== "unreadable");
  readable.sort((a, b) => a - b);
  const at = (q) => readable[Math.floor(q * (readable.length - 1))] ?? 0;
  const mean = readable.reduce((sum, time) => sum + time, 0) / Math.max(1, readable.length);
  return { mean, p50: at(0.5), p99: at(0.99), max: at(1) };
}

function totalOf(run) {
  const total = run.times_ms.content.map((_, i) =>
    kSteps.reduce((sum, step) => sum + run.times_ms[step][i], 0),
  );
  return run.record?.times_ms.total ?? summaryOf(run, total);
}

const loopsOf = (run) => run.status.filter((status) => run.status_names[status] === "loop").length;

async function checkScore(page, run) {
  const { evaluation } = run;
  if (!evaluation) {
    assert.equal(await textOf(page, "recall"), null, "a recall without truth");
    assert.match(await textOf(page, "sentence"), /no truth/);
    return;
  }
  const tally = (name) => run.verdict.filter((verdict) => verdict === name).length;
  for (const name of ["right", "wrong"])
    assert.equal(tally(name), evaluation[name], `verdicts: ${name}`);
  const sentence = await textOf(page, "sentence");
  const wrong = evaluation.wrong === 0 ? "no" : String(evaluation.wrong);
  assert.ok(sentence.includes(`${wrong} wrong loop`), sentence);
  if (evaluation.positives > 0) {
    const found = new RegExp(`^${evaluation.right} of ${evaluation.positives} revisits? found`);
    assert.match(
      sentence.replaceAll(",", (comma, at) => (/\d/.test(sentence[at + 1]) ? "" : comma)),
      found,
    );
  }
  const numbers = {
    recall_at_full_precision: evaluation.recall_at_full_precision,
    average_precision: evaluation.average_precision,
    "pairs.recall": evaluation.pairs.recall,
  };
  if (evaluation.positives > 0) numbers.recall = evaluation.recall;
  if (evaluation.right + evaluation.wrong > 0) numbers.precision = evaluation.precision;
  for (const [key, value] of Object.entries(numbers))
    assertShows(await textOf(page, key), value, key);
  if (numbers.precision !== undefined) {
    const note = await textOf(page, "precision.note");
    const [low, high] = note.match(/([\d.]+) to ([\d.]+)/).slice(1);
    assertShows(low, evaluation.precision_interval[0], "low end of the interval");
    assertShows(high, evaluation.precision_interval[1], "high end of the interval");
    assert.ok(
      note
        .replaceAll(",", "")
        .startsWith(`${evaluation.wrong} wrong of ${evaluation.right + evaluation.wrong}`),
      note,
    );
  }
}

async function checkTimes(page, run) {
  if (!run.times_ms) return;
  const shown = { total: totalOf(run) };
  for (const step of kSteps) {
    shown[step] = run.record?.times_ms[step] ?? summaryOf(run, run.times_ms[step]);
  }
  for (const [step, summary] of Object.entries(shown)) {
    for (const figure of ["mean", "p50", "p99", "max"]) {
      const key = `times.${step}.${figure}`;
      assertShows(await textOf(page, key), summary[figure], key);
    }
  }
  assertShows(await textOf(page, "time.mean"), shown.total.mean, "mean ms");
  assertShows((await textOf(page, "time.mean.note")).replace("p99", ""), shown.total.p99, "p99 ms");
}

async function checkRecord(page, run) {
  if (!run.record) return;
  assertShows(await textOf(page, "frames_per_s"), run.record.frames_per_s, "frames a second");
  const settings = Object.entries(run.record.options).flatMap(([part, of]) =>
    Object.entries(of).map(([name, value]) => [`options.${part}.${name}`, String(value)]),
  );
  for (const [key, value] of settings) assert.equal(await textOf(page, key), value, key);
}

/** `runJson`: run.json's content, if there is one to compare with. */
export async function checkNumbers(page, runJson) {
  const { runs } = await embedded(page);
  const run = runs[0];
  if (runJson) assert.deepEqual(run.record, runJson, "the page's record is not run.json");
  assertShows(await textOf(page, "frames"), run.frames, "frames");
  if (run.record) assert.equal(run.frames, run.record.counts.frames, "frames of run.json");
  assertShows(await textOf(page, "loops"), loopsOf(run), "loops");
  if (runs.length === 1) await checkScore(page, run);
  else await checkComparison(page, runs);
  await checkTimes(page, run);
  await checkRecord(page, run);
  const counts = { all: run.frames, loops: loopsOf(run) };
  for (const name of kFilters.slice(1)) {
    counts[name] = run.verdict.filter((verdict) => verdict === name).length;
  }
  for (const [name, count] of Object.entries(counts)) {
    assertShows(await textOf(page, `filter.${name}`), count, `frames that are ${name}`);
  }
}

/** The table of several runs: its numbers, the order it sorts into, and the best of a column. */
async function checkComparison(page, runs) {
  for (const [i, { evaluation }] of runs.entries()) {
    for (const key of ["recall", "precision", "wrong", "average_precision"]) {
      assertShows(await textOf(page, `run.${i}.${key}`), evaluation[key], `run ${i}: ${key}`);
    }
  }
  const sort = page.locator(".comparison thead button", { hasText: /^recall$/ });
  const column = () =>
    page.$$eval(".comparison tbody [data-key$='.recall']:not([data-key*='pairs'])", (cells) =>
      cells.map((cell) => Number.parseFloat(cell.textContent)),
    );
  await sort.press("Enter");
  const falling = await column();
  assert.deepEqual(
    falling,
    [...falling].sort((a, b) => b - a),
    "falling recall",
  );
  await sort.press("Enter");
  assert.deepEqual(
    await column(),
    [...falling].reverse().sort((a, b) => a - b),
    "rising recall",
  );
  const best = Math.max(...runs.map(({ evaluation }) => evaluation.recall));
  for (const [i, { evaluation }] of runs.entries()) {
    const isBest = await page.$eval(`[data-key="run.${i}.recall"]`, (cell) =>
      cell.classList.contains("best"),
    );
    assert.equal(isBest, evaluation.recall === best, `run ${i} is the best`);
  }
}

/** At most `count` of `frames`, spread evenly. */
export function spread(frames, count) {
  const step = Math.max(1, frames.length / count);
  return Array.from(
    { length: Math.min(count, frames.length) },
    (_, i) => frames[Math.floor(i * step)],
  );
}

/** Of some pairs all that the pair browser says. */
export async function checkPairs(page) {
  const run = (await embedded(page)).runs[0];
  const loops = run.status.flatMap((status, i) => (run.status_names[status] === "loop" ? [i] : []));
  const others = run.match.flatMap((match, i) => (match >= 0 && !loops.includes(i) ? [i] : []));
  let compared = 0;
  for (const frame of [...spread(loops, 12), ...spread(others, 6)]) {
    await goTo(page, frame);
    const match = run.match[frame];
    assertShows(
      (await textOf(page, "pair.score")).split(/[≥<]/)[0],
      run.score[frame],
      `score of ${frame}`,
    );
    for (const name of ["matches", "inliers", "similarity"]) {
      if (run[name])
        assertShows(await textOf(page, `pair.${name}`), run[name][frame], `${name} of ${frame}`);
    }
    const pictures = [run.pictures[frame], run.pictures[match]];
    const shown = await page.$$eval(
      "#pair .picture img",
      (all) => all.filter((one) => one.naturalWidth > 0).length,
    );
    assert.equal(shown, pictures.filter(Boolean).length, `pictures of ${frame} and ${match}`);
    if (!pictures[0] || !pictures[1]) continue;
    const inliers = Buffer.from(pictures[0].inliers ?? "", "base64").length / 16;
    const lines = await page.$$eval("#pair .inliers line", (all) => all.length);
    assert.equal(lines, inliers, `inlier lines of ${frame}`);
    if (!run.similarity || !pictures[0].content || !pictures[1].content) continue;
    const xi = Number(await textOf(page, "pair.xi"));
    assert.ok(
      Math.abs(xi - run.similarity[frame]) <= 0.00051,
      `xi of ${frame} and ${match}: ${xi}, not ${run.similarity[frame]}`,
    );
    ++compared;
  }
  await settled(page);
  return compared;
}
