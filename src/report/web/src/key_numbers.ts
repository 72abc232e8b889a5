// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import * as format from "./format.ts";
import type { Evaluation } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";

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
  const loops = e.right + e.wrong;
  return [
    number(
      "recall",
      "recall",
      e.positives === 0 ? "–" : format.share(e.recall),
      e.positives === 0
        ? "no revisits"
        : `${format.count(e.right)} of ${format.count(e.positives)}`,
    ),
    number(
      "precision",
      "precision",
      loops === 0 ? "–" : format.share(e.precision),
      loops === 0
        ? "no loops to judge"
        : `${format.count(e.wrong)} wrong of ${format.count(loops)}; 95 %: ${format.share(low)} to ${format.share(high)}`,
    ),
    number(
      "recall at 100 % precision",
      "recall_at_full_precision",
      format.share(e.recall_at_full_precision),
      e.score_at_full_precision === null
        ? "the best score is wrong"
        : `from score ${format.score(e.score_at_full_precision)}`,
    ),
    number(
      "average precision",
      "average_precision",
      format.share(e.average_precision),
      "area under the curve",
    ),
    number(
      "pair recall",
      "pairs.recall",
      format.share(e.pairs.recall),
      `${format.count(e.pairs.right)} of ${format.counted(e.pairs.positives, "pair")}`,
    ),
  ];
}

/** The numbers one looks for first. What a table above already says of several runs is left out. */
export function keyNumbers(model: RunModel, isCompared: boolean): HTMLElement[] {
  const { evaluation, record } = model.run;
  const time = model.totalTime();
  const unreadable = model.frames - countReadable(model);
  const loops = model.framesIn("loops").length;
  const found = evaluation && !isCompared ? judged(evaluation) : [];
  const spent = [
    number(
      "frames",
      "frames",
      format.count(model.frames),
      unreadable > 0 ? `${format.count(unreadable)} unreadable` : "all readable",
    ),
    number(
      "loops",
      "loops",
      format.count(loops),
      `${((100 * loops) / Math.max(1, model.frames)).toFixed(1)} % of frames`,
    ),
  ];
  if (time) {
    spent.push(
      number(
        "ms a frame",
        "time.mean",
        format.milliseconds(time.mean),
        `p99 ${format.milliseconds(time.p99)}`,
      ),
    );
  }
  if (record) {
    spent.push(
      number(
        "frames a second",
        "frames_per_s",
        format.rate(record.frames_per_s),
        `with decoding, ${format.count(Math.round(record.peak_memory_mib))} MiB`,
      ),
    );
  }
  return [html("dl", {}, ...found), html("dl", {}, ...spent)];
}

function countReadable(model: RunModel): number {
  let readable = 0;
  for (let frame = 0; frame < model.frames; ++frame) readable += model.isReadable(frame) ? 1 : 0;
  return readable;
}
