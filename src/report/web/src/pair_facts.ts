// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import * as format from "./format.ts";
import { candidateName } from "./partner.ts";
import type { RunModel } from "./run_model.ts";
import { meaningOfLoop, meaningOfStatus, nameOfStatus } from "./status_text.ts";
import type { Selection } from "./store.ts";
import { markIcon, nameOf } from "./verdicts.ts";

function fact(name: string, key: string, ...value: Child[]): HTMLElement {
  return html("div", {}, html("dt", {}, name), html("dd", { "data-key": `pair.${key}` }, ...value));
}

/** The decision for the frame, and the numbers of its best candidate. */
export function pairFacts(model: RunModel, selection: Selection): HTMLElement[] {
  const { run } = model;
  const { frame } = selection;
  const status = model.status(frame);
  const mark = model.mark(frame);
  const time = run.timestamp_s?.[frame] ?? null;
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
    model.isLoop(frame) ? meaningOfLoop(model.verdict(frame)) : meaningOfStatus(model, status),
  );
  const score = model.score(frame);
  const threshold = run.threshold;
  const limit =
    threshold === null
      ? null
      : html(
          "span",
          { class: "small" },
          ` ${(score ?? 0) >= threshold ? "≥" : "<"} ${format.score(threshold)}`,
        );
  const has = model.matchName(frame) !== null;
  const number = (column: number[] | null) =>
    column && has ? format.count(column[frame] ?? 0) : "–";
  const facts = html(
    "dl",
    { class: "facts" },
    fact("score", "score", has ? format.score(score, threshold) : "–", has ? limit : null),
    fact(
      "similarity ξ",
      "similarity",
      format.similarity(has ? (run.similarity?.[frame] ?? null) : null),
    ),
    fact("matches", "matches", number(run.matches)),
    fact("inliers", "inliers", number(run.inliers)),
  );
  if (time !== null) {
    const since = html(
      "span",
      { title: `since the first frame; timestamp ${format.timestamp(time)}` },
      format.timestamp(time - model.firstTime()),
    );
    facts.append(fact("time", "time", since));
  }
  if (model.totals_ms && model.isReadable(frame)) {
    facts.append(fact("took", "took", `${format.milliseconds(model.totals_ms[frame] ?? 0)} ms`));
  }
  if (model.isWithCandidate(selection) || !has) return [line, why, facts];
  const whose = `Values of its ${candidateName(model, frame)}, which is not shown:`;
  return [html("p", { class: "whose", "data-key": "pair.whose" }, whose), line, why, facts];
}
