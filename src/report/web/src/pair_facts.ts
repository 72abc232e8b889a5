// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import * as format from "./format.ts";
import { pairPose } from "./pair_pose.ts";
import { candidateName } from "./partner.ts";
import type { ScoreTerms } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import { meaningOfLoop, meaningOfStatus, nameOfStatus } from "./status_text.ts";
import type { Selection } from "./store.ts";
import { markIcon, nameOf } from "./verdicts.ts";

function fact(name: string, key: string, ...value: Child[]): HTMLElement {
  return html("div", {}, html("dt", {}, name), html("dd", { "data-key": `pair.${key}` }, ...value));
}

const kTerms: readonly (keyof ScoreTerms)[] = ["votes", "geometry", "path", "rivals", "prior"];

/** Why the score is what it is; null if the detector does not say. */
function termsOf({ run }: RunModel, frame: number): HTMLElement | null {
  const terms = kTerms.flatMap((name) => {
    const value = run.terms?.[name][frame] ?? null;
    return value === null ? [] : [{ name, value }];
  });
  if (terms.length < kTerms.length) return null;
  const sum = terms.reduce((all, { value }) => all + value, 0);
  const added = terms.map(({ name, value }, i) => {
    const sign = value < 0 ? "−" : "+";
    return `${i === 0 && value >= 0 ? "" : `${sign} `}${name} ${format.term(Math.abs(value))}`;
  });
  const title = "Terms of the log odds that the match is right, in nats; see the method's page";
  return html(
    "p",
    { class: "terms", "data-key": "pair.terms", title },
    `log odds ${format.term(sum)} = ${added.join(" ")}`,
  );
}

/** What later frames changed of the decision. */
function changesOf(model: RunModel, frame: number): HTMLElement[] {
  return model.changes(frame).map((change) => {
    const score = format.score(change.score, model.run.threshold);
    if (change.isWithdrawn && model.isRejected(frame, change.match)) {
      const graph = `The pose graph rejected its loop with ${change.matchName}.`;
      return html("p", { class: "terms", "data-key": "pair.change" }, graph);
    }
    const text = change.isWithdrawn
      ? `Frame ${change.by} withdrew its loop with ${change.matchName}: only ${score} by then.`
      : `A late loop with ${change.matchName}: ${score} from frame ${change.by} on.`;
    return html("p", { class: "terms", "data-key": "pair.change" }, text);
  });
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
  const terms = termsOf(model, frame);
  const pose = pairPose(model, selection);
  const shown = [line, why, facts, ...[terms, pose].filter((each) => each !== null)];
  shown.push(...changesOf(model, frame));
  if (model.isWithCandidate(selection) || !has) return shown;
  const whose = `Values of its ${candidateName(model, frame)}, which is not shown:`;
  return [html("p", { class: "whose", "data-key": "pair.whose" }, whose), ...shown];
}
