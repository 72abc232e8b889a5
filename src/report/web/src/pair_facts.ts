// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import * as format from "./format.ts";
import type { RunModel } from "./run_model.ts";
import { meaningOfLoop, meaningOfStatus, nameOfStatus } from "./status_text.ts";
import { markIcon, nameOf } from "./verdicts.ts";

function fact(name: string, key: string, ...value: Child[]): HTMLElement {
  return html("div", {}, html("dt", {}, name), html("dd", { "data-key": `pair.${key}` }, ...value));
}

/** What was decided about the frame, and on what numbers. */
export function pairFacts(model: RunModel, frame: number): HTMLElement[] {
  const { run } = model;
  const status = model.status(frame);
  const mark = model.mark(frame);
  const time = run.timestamp_s?.[frame];
  const line = html(
    "p",
    { class: `verdict ${mark ?? "none"}`, "data-key": "pair.verdict" },
    mark ? markIcon(mark) : null,
    html("strong", {}, mark ? nameOf(mark) : nameOfStatus(status)),
    !mark && model.verdict(frame) === "ignored" ? "(not scored)" : null,
  );
  const why = html(
    "p",
    { class: "why" },
    mark && status !== "loop" ? `${nameOfStatus(status)}: ` : null,
    model.isLoop(frame) ? meaningOfLoop(model.verdict(frame)) : meaningOfStatus(status),
  );
  const threshold = run.threshold;
  const limit =
    threshold === null
      ? null
      : html(
          "span",
          { class: "small" },
          ` ${model.score(frame) >= threshold ? "≥" : "<"} ${format.score(threshold)}`,
        );
  const has = model.match(frame) !== null;
  const number = (column: number[] | null) =>
    column && has ? format.count(column[frame] ?? 0) : "–";
  const facts = html(
    "dl",
    { class: "facts" },
    fact("score", "score", has ? format.score(model.score(frame)) : "–", has ? limit : null),
    fact(
      "similarity ξ",
      "similarity",
      format.similarity(has ? (run.similarity?.[frame] ?? null) : null),
    ),
    fact("matches", "matches", number(run.matches)),
    fact("inliers", "inliers", number(run.inliers)),
  );
  if (time !== undefined && time !== null)
    facts.append(fact("time", "time", format.timestamp(time)));
  if (model.totals_ms && model.isReadable(frame)) {
    facts.append(fact("took", "took", `${format.milliseconds(model.totals_ms[frame] ?? 0)} ms`));
  }
  return [line, why, facts];
}
