// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import { figuresOf } from "./figures.ts";
import * as format from "./format.ts";
import type { Evaluation, RunRecord } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";

const kNoRevisits = "no revisits scored";

/** Frames of the built-in world are rendered, not decoded. */
const isBuiltInWorld = ({ input }: RunRecord) => input.description.startsWith("built-in world");

function number(name: string, key: string, value: string, ...note: Child[]): HTMLElement {
  return html(
    "div",
    { class: "number" },
    html("dt", {}, name),
    html("dd", { class: "value", "data-key": key }, value),
    html("dd", { class: "note", "data-key": `${key}.note` }, ...note),
  );
}

function judged(e: Evaluation): HTMLElement[] {
  const [low, high] = e.precision_interval;
  const figures = figuresOf(e);
  const loops = e.right + e.wrong;
  const ofRevisits = (note: string) => (e.positives === 0 ? kNoRevisits : note);
  return [
    number(
      "recall",
      "recall",
      format.share(figures.recall),
      ofRevisits(`${format.count(e.right)} of ${format.count(e.positives)}`),
    ),
    number(
      "precision",
      "precision",
      format.share(figures.precision),
      loops === 0
        ? "no loops to judge"
        : `${format.count(e.wrong)} wrong of ${format.count(loops)}; 95 %: ${format.share(low)} to ${format.share(high)}`,
    ),
    number(
      "recall at 100 % precision",
      "recall_at_full_precision",
      format.share(figures.recallAtFullPrecision),
      ofRevisits(limitOf(e)),
    ),
    number(
      "average precision",
      "average_precision",
      format.share(figures.averagePrecision),
      ofRevisits("area under the curve"),
    ),
    number(
      "pair recall",
      "pairs.recall",
      format.share(figures.pairRecall),
      figures.pairRecall === null
        ? "no true pairs scored"
        : `${format.count(e.pairs.right)} of ${format.counted(e.pairs.positives, "pair")}`,
    ),
  ];
}

/** The score from which every loop would be right. */
function limitOf({ score_at_full_precision: score, curve }: Evaluation): string {
  if (score !== null) return `from score ${format.score(score)}`;
  return curve.length === 0 ? "no candidates" : "the highest score is wrong";
}

/** The number of frames, if it is known. */
function framesOf(model: RunModel): HTMLElement {
  const { frames } = model;
  if (!model.run.frames_known) {
    return number("frames", "frames", "not known", `at least ${format.count(frames)}`);
  }
  let note = `${format.count(model.framesWithCandidate())} with a match`;
  if (model.tellsUnreadable()) {
    const unreadable = model.unreadable();
    note = unreadable > 0 ? `${format.count(unreadable)} unreadable` : "all readable";
  }
  return number("frames", "frames", format.count(frames), note);
}

/** Their share of the frames, and in how many revisits they are. */
function notesOf(model: RunModel): string[] {
  const share = (100 * model.framesIn("loops").length) / Math.max(1, model.frames);
  const { revisits, frames_known } = model.run;
  return [
    ...(frames_known ? [`${share.toFixed(1)} % of frames`] : []),
    ...(revisits.length > 0 ? [format.counted(revisits.length, "revisit")] : []),
    ...(model.countChanges(false) > 0 ? [`${format.count(model.countChanges(false))} late`] : []),
    ...(model.countChanges(true) > 0
      ? [`${format.count(model.countChanges(true))} withdrawn`]
      : []),
  ];
}

/** The most important numbers. Those that the comparison already shows are left out. */
export function keyNumbers(model: RunModel, isCompared: boolean): HTMLElement[] {
  const { evaluation, record } = model.run;
  const time = model.totalTime();
  const loops = model.framesIn("loops").length;
  const found = evaluation && !isCompared ? judged(evaluation) : [];
  const spent = [
    framesOf(model),
    number("loops", "loops", format.count(loops), notesOf(model).join(", ")),
  ];
  if (time) {
    spent.push(
      number(
        "ms per frame",
        "time.mean",
        format.milliseconds(time.mean),
        `p99 ${format.milliseconds(time.p99)}`,
      ),
    );
  }
  if (record?.frames_per_s !== undefined) {
    const source = isBuiltInWorld(record) ? "including rendering" : "including decoding";
    const memory = `${format.count(Math.round(record.peak_memory_mib ?? 0))} MiB`;
    spent.push(
      number(
        "frames per second",
        "frames_per_s",
        format.rate(record.frames_per_s),
        `${source}, ${memory}`,
      ),
    );
  }
  return [html("dl", {}, ...found), html("dl", {}, ...spent)];
}
