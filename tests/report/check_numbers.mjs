// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The numbers on the page are those of the data and of run.json.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { assertShows, embedded, goTo, isMissed, settled, textOf } from "./browser.mjs";

const kSteps = ["content", "retrieval", "features", "verification"];
const kFilters = ["loops", "right", "wrong", "missed", "tolerated", "elsewhere"];

/** The nth readable time from below, as run.json counts. */
function summaryOf(run, times) {
  const readable = times.filter((_, i) => run.status_names[run.status[i]] !== "unreadable");
  readable.sort((a, b) => a - b);
  const at = (q) => readable[Math.ceil(q * readable.length) - 1] ?? 0;
  const mean = readable.reduce((sum, time) => sum + time, 0) / Math.max(1, readable.length);
  return { mean, p50: at(0.5), p99: at(0.99), max: at(1) };
}

function totalOf(run) {
  const total = run.times_ms.content.map((_, i) =>
    kSteps.reduce((sum, step) => sum + run.times_ms[step][i], 0),
  );
  return run.record?.times_ms?.total ?? summaryOf(run, total);
}

const isLoop = (run, frame) => run.status_names[run.status[frame]] === "loop";
const loopsOf = (run) => run.status.filter((_, frame) => isLoop(run, frame)).length;

/** Shares of nothing are null. */
function figuresOf(evaluation) {
  const { positives, right, wrong, pairs } = evaluation;
  return {
    recall: positives > 0 ? evaluation.recall : null,
    precision: right + wrong > 0 ? evaluation.precision : null,
    recall_at_full_precision: positives > 0 ? evaluation.recall_at_full_precision : null,
    average_precision: positives > 0 ? evaluation.average_precision : null,
    "pairs.recall": pairs.positives > 0 ? pairs.recall : null,
  };
}

async function assertFigure(page, key, value) {
  const text = await textOf(page, key);
  if (value === null) assert.equal(text, "–", `${key} is a share of nothing`);
  else assertShows(text, value, key);
}

async function checkScore(page, run) {
  const { evaluation } = run;
  const elsewhere =
    loopsOf(run) - run.match.filter((match, i) => isLoop(run, i) && match >= 0).length;
  const sentence = await textOf(page, "sentence");
  assert.equal(sentence.includes("into earlier sessions"), elsewhere > 0, sentence);
  if (elsewhere > 0) assert.ok(sentence.includes(String(elsewhere)), sentence);
  if (!evaluation) {
    assert.equal(await textOf(page, "recall"), null, "a recall without truth");
    assert.match(sentence, /no truth/);
    return;
  }
  const tally = (name) => run.verdict.filter((verdict) => verdict === name).length;
  for (const name of ["right", "wrong"])
    assert.equal(tally(name), evaluation[name], `verdicts: ${name}`);
  const wrong = evaluation.wrong === 0 ? "no" : String(evaluation.wrong);
  assert.ok(sentence.includes(`${wrong} wrong loop`), sentence);
  if (evaluation.positives === 0) {
    const none =
      run.truth.same_place.length > 0 ? /^No revisit is scored/ : /^No place was visited/;
    assert.match(sentence, none);
  } else {
    const found = new RegExp(`^${evaluation.right} of ${evaluation.positives} revisits? found`);
    assert.match(
      sentence.replaceAll(",", (comma, at) => (/\d/.test(sentence[at + 1]) ? "" : comma)),
      found,
    );
  }
  const [, tolerated = "0", , apart = "0"] =
    sentence.match(
      /(\d+) tolerated( \((\d+) of them at (?:a missed revisit|missed revisits)\))?/,
    ) ?? [];
  assert.equal(Number(tolerated), evaluation.tolerated, sentence);
  assert.equal(Number(tolerated) - Number(apart), tally("tolerated"), sentence);
  for (const [key, value] of Object.entries(figuresOf(evaluation)))
    await assertFigure(page, key, value);
  assert.equal(
    await page.isVisible("#precision-recall .plot"),
    evaluation.positives > 0 && evaluation.curve.some(({ right, wrong }) => right + wrong > 0),
    "a curve of nothing",
  );
  if (evaluation.right + evaluation.wrong > 0) {
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
    shown[step] = run.record?.times_ms?.[step] ?? summaryOf(run, run.times_ms[step]);
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
  if (run.record.frames_per_s === undefined) {
    assert.equal(await textOf(page, "frames_per_s"), null, "a rate of a run that did not end");
    assert.match(await page.textContent(".notice"), /not ended/);
  } else {
    assertShows(await textOf(page, "frames_per_s"), run.record.frames_per_s, "frames a second");
  }
  const settings = Object.entries(run.record.options).flatMap(([part, of]) =>
    Object.entries(of).map(([name, value]) => [`options.${part}.${name}`, String(value)]),
  );
  for (const [key, value] of settings) assert.equal(await textOf(page, key), value, key);
}

/** The words of a command, as the shell takes them. */
const wordsOf = (command) =>
  execFileSync("sh", ["-c", `printf '%s\\n' ${command}`], { encoding: "utf8" })
    .split("\n")
    .slice(0, -1);

/** The page's command is the run's, but for the folder that it writes to. */
async function checkCommand(page, run) {
  const command = await textOf(page, "command");
  const given = run.record?.arguments ?? [];
  if (given.length === 0) {
    assert.equal(command, null, "a command that nobody gave");
    return;
  }
  const words = given.filter((word) => word !== "--overwrite");
  const out = words.indexOf("--out");
  if (out < 0) words.push("--out", "again");
  else words[out + 1] = "again";
  assert.deepEqual(wordsOf(command), ["loopbit", ...words], "the command to run it again");
}

/** `runJson`: run.json's content, if there is one to compare with. */
export async function checkNumbers(page, runJson) {
  const { runs } = await embedded(page);
  const run = runs[0];
  if (runJson) assert.deepEqual(run.record, runJson, "the page's record is not run.json");
  if (run.frames_known) {
    assertShows(await textOf(page, "frames"), run.frames, "frames");
  } else {
    assert.equal(await textOf(page, "frames"), "not known");
    assertShows(await textOf(page, "frames.note"), run.frames, "frames at least");
    assert.doesNotMatch(await textOf(page, "loops.note"), /%/, "a share of nobody knows what");
  }
  if (run.record?.counts) assert.equal(run.frames, run.record.counts.frames, "frames of run.json");
  assertShows(await textOf(page, "loops"), loopsOf(run), "loops");
  if (runs.length === 1) await checkScore(page, run);
  else await checkComparison(page, runs);
  await checkTimes(page, run);
  await checkRecord(page, run);
  await checkCommand(page, run);
  const counts = { all: run.frames, loops: loopsOf(run) };
  for (const name of kFilters.slice(1)) {
    counts[name] = run.verdict.filter((verdict) => verdict === name).length;
  }
  counts.missed = run.verdict.filter((_, frame) => isMissed(run, frame)).length;
  if (run.evaluation) {
    const { positives, right } = run.evaluation;
    assert.equal(counts.missed, positives - right, "revisits without a right loop");
  }
  for (const [name, count] of Object.entries(counts)) {
    assertShows(await textOf(page, `filter.${name}`), count, `frames that are ${name}`);
  }
  const isOffered = await page.isVisible("[data-filter=elsewhere]");
  assert.equal(isOffered, counts.elsewhere > 0, "the filter of loops elsewhere");
}

/** The table of several runs: its numbers, the order it sorts into, and the best of a column. */
async function checkComparison(page, runs) {
  for (const [i, { evaluation }] of runs.entries()) {
    assertShows(await textOf(page, `run.${i}.wrong`), evaluation.wrong, `run ${i}: wrong`);
    for (const [key, value] of Object.entries(figuresOf(evaluation))) {
      await assertFigure(page, `run.${i}.${key}`, value);
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
  for (const key of ["recall", "precision"]) await checkBest(page, runs, key);
  const byTime = page.locator(".comparison thead button", { hasText: "mean ms" });
  for (const _ of ["rising", "falling"]) {
    await byTime.press("Enter");
    const times = await page.$$eval(".comparison tbody [data-key$='time.mean']", (cells) =>
      cells.map((cell) => cell.textContent),
    );
    const known = times.filter((time) => time !== "–").length;
    assert.ok(!times.slice(0, known).includes("–"), `a run without times comes first: ${times}`);
  }
}

/** Bold is what is the best of those that are known. */
async function checkBest(page, runs, key) {
  const values = runs.map(({ evaluation }) => figuresOf(evaluation)[key]);
  const best = Math.max(...values.filter((value) => value !== null));
  for (const [i, value] of values.entries()) {
    const isBest = await page.$eval(`[data-key="run.${i}.${key}"]`, (cell) =>
      cell.classList.contains("best"),
    );
    assert.equal(isBest, value !== null && value === best, `run ${i} has the best ${key}`);
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

/** What is beside a frame, by its name; why it has no picture; and when the frame was. */
async function checkTag(page, run, frame) {
  const earlier = run.earlier_match?.[frame];
  const kind = isLoop(run, frame) ? "match" : "best candidate";
  const tag = await page.textContent("#pair .picture:nth-child(2) .tag");
  assert.equal(tag, `${kind} ${earlier?.join(":") ?? run.match[frame]}`, `beside ${frame}`);
  if (earlier) {
    const why = await page.textContent("#pair .picture:nth-child(2) .absent");
    const [session, number] = earlier;
    const { path } = run.record.map;
    assert.ok(why.startsWith(`Frame ${number} of session ${session} of ${path};`), why);
  }
  const time = run.timestamp_s?.[frame] ?? null;
  if (time !== null) {
    const first = run.timestamp_s.find((one) => one !== null);
    assertShows(await textOf(page, "pair.time"), time - first, `time of ${frame}`);
  }
}

/** Pictures of the pair that are stretched, and ends of inlier lines outside of their picture. */
const misdrawn = () => {
  const images = [...document.querySelectorAll("#pair .picture img")];
  const boxes = images.map((image) => image.getBoundingClientRect());
  const stretched = images.flatMap(({ naturalWidth, naturalHeight }, i) => {
    const { width, height } = boxes[i];
    const isSame = Math.abs((width * naturalHeight) / naturalWidth - height) <= 1;
    return isSame ? [] : [`${naturalWidth} x ${naturalHeight} as ${width} x ${height}`];
  });
  const outside = [...document.querySelectorAll("#pair .inliers circle")].flatMap((dot, i) => {
    const { left, right, top, bottom } = dot.getBoundingClientRect();
    const [x, y] = [(left + right) / 2, (top + bottom) / 2];
    const box = boxes[i % 2];
    const isWithin = x >= box.left && x <= box.right && y >= box.top && y <= box.bottom;
    return isWithin ? [] : [`${x}, ${y}`];
  });
  return [...stretched, ...outside];
};

/** The terms are those of the frame, and their sum is the log odds of its score. */
async function checkTerms(page, run, frame) {
  const terms = ["votes", "geometry", "path", "rivals", "prior"].map((n) => run.terms?.[n][frame]);
  const shown = page.locator("[data-key='pair.terms']");
  if (terms.some((term) => typeof term !== "number")) {
    assert.equal(await shown.count(), 0, `terms of ${frame}`);
    return;
  }
  const text = (await textOf(page, "pair.terms")).replaceAll("−", "-");
  const numbers = text.replaceAll("- ", "-").match(/-?[a-z]* ?-?\d+\.\d/g);
  const values = numbers.map((word) => Number(word.replace(/[a-z ]/g, "")));
  const sum = terms.reduce((a, b) => a + b, 0);
  [sum, ...terms].forEach((value, i) => {
    assert.ok(Math.abs(values[i] - value) <= 0.0501, `term ${i} of ${frame}: ${text}`);
  });
  const score = 1 / (1 + Math.exp(-sum));
  assert.ok(Math.abs(score - run.score[frame]) < 0.01, `terms of ${frame}: ${text}`);
}

/** The relative pose of the pair is told as far as it is known. */
async function checkPose(page, run, frame) {
  const pose = run.poses?.[frame];
  const shown = page.locator("[data-key='pair.pose']");
  if (!pose || pose.match !== run.match[frame]) {
    assert.equal(await shown.count(), 0, `pose of ${frame}`);
    return;
  }
  const text = await textOf(page, "pair.pose");
  const turned = text.match(/turned by ([\d.]+)°/);
  assert.equal(turned !== null, pose.known !== "nothing", text);
  if (turned) {
    assert.ok(Math.abs(Number(turned[1]) - (pose.rotation_rad * 180) / Math.PI) <= 0.051, text);
  }
  const moved = text.match(/moved ([\d.]+) m ±/);
  assert.equal(moved !== null, pose.known === "metric", text);
  if (moved)
    assert.ok(Math.abs(Number(moved[1]) - Math.hypot(...pose.translation)) <= 0.0051, text);
  assert.equal(await shown.locator("ellipse").count(), pose.translation ? 1 : 0, text);
  const isDrawn = run.pictures[frame] && run.pictures[pose.match] && pose.epipolar?.length > 0;
  if (!isDrawn) return;
  const lines = page.getByRole("button", { name: "epipolar lines" });
  await lines.click();
  const points = page.locator("#pair .epipolar circle");
  await points.first().waitFor();
  assert.equal(await points.count(), pose.epipolar.length);
  await lines.click();
  await points.first().waitFor({ state: "detached" });
  await page.getByRole("button", { name: "inlier lines" }).click();
}

/** Late and withdrawn loops of the frame are told, with the frame that changed them. */
async function checkChanges(page, run, frame) {
  const texts = await page.locator("[data-key='pair.change']").allTextContents();
  const changes = (run.late_loops ?? []).flatMap((loops, by) =>
    (loops ?? []).filter((loop) => loop[0] === frame).map((loop) => [by, ...loop]),
  );
  assert.equal(texts.length, changes.length, `changes of ${frame}: ${texts}`);
  changes.forEach(([by, , match, , isWithdrawn], i) => {
    assert.equal(texts[i].includes("withdrew"), isWithdrawn, texts[i]);
    assert.match(texts[i], new RegExp(`with ${[match].flat().join(":")}:`));
    assert.match(texts[i], new RegExp(`rame ${by} `));
  });
}

/** Of some pairs all that the pair browser says; of fewer, if `isBrief`. */
export async function checkPairs(page, isBrief) {
  const run = (await embedded(page)).runs[0];
  const loops = run.status.flatMap((status, i) => (run.status_names[status] === "loop" ? [i] : []));
  const others = run.match.flatMap((match, i) => (match >= 0 && !loops.includes(i) ? [i] : []));
  const close = others.filter((frame) => Math.abs(run.score[frame] - run.threshold) < 0.01);
  let compared = 0;
  const [some, few, one] = isBrief ? [5, 2, 1] : [12, 6, 2];
  const changed = [
    ...new Set((run.late_loops ?? []).flat().flatMap((loop) => (loop ? [loop[0]] : []))),
  ];
  const frames = [...spread(loops, some), ...spread(others, few), ...spread(close, one)];
  for (const frame of [...frames, ...spread(changed, few)]) {
    await goTo(page, frame);
    const match = run.match[frame];
    await checkTag(page, run, frame);
    const [score] = (await textOf(page, "pair.score")).split(/[≥<]/);
    assertShows(score, run.score[frame], `score of ${frame}`);
    if (run.threshold !== null) {
      const isAccepted = Number(score.replaceAll(",", "")) >= run.threshold;
      assert.equal(isAccepted, run.score[frame] >= run.threshold, `side of ${score} of ${frame}`);
    }
    for (const name of ["matches", "inliers", "similarity"]) {
      if (run[name])
        assertShows(await textOf(page, `pair.${name}`), run[name][frame], `${name} of ${frame}`);
    }
    await checkTerms(page, run, frame);
    await checkPose(page, run, frame);
    await checkChanges(page, run, frame);
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
    assert.deepEqual(await page.evaluate(misdrawn), [], `pictures of ${frame} and ${match}`);
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
