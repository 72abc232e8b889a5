// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import * as format from "./format.ts";
import type { RunModel } from "./run_model.ts";
import { meaningOfStatus, nameOfStatus } from "./status_text.ts";
import { isMarked, markIcon, nameOf } from "./verdicts.ts";

function fact(name: string, key: string, ...value: Child[]): HTMLElement {
  return html("div", {}, html("dt", {}, name), html("dd", { "data-key": `pair.${key}` }, ...value));
}

/** What was decided about the frame, and on what numbers. */
export function pairFacts(model: RunModel, frame: number): HTMLElement[] {
  const { run } = model;
  const status = model.status(frame);
  const verdict = model.verdict(frame);
  const time = run.timestamp_s?.[frame];
  const line = html(
    "p",
    { class: `verdict ${verdict}`, "data-key": "pair.verdict" },
    isMarked(verdict) ? markIcon(verdict) : null,
    html("strong", {}, isMarked(verdict) ? nameOf(verdict) : nameOfStatus(status)),
    verdict === "ignored" ? " Left out of the score." : null,
  );
  const why = html(
    "p",
    { class: "why" },
    isMarked(verdict) && status !== "loop" ? `${nameOfStatus(status)}: ` : null,
    meaningOfStatus(status),
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
