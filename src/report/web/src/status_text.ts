// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Verdict } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";

/** Why a frame has no loop; see the table in docs/run_folder.md. */
const kMeanings: Record<string, string> = {
  loop: "The match is accepted.",
  no_loop: "The detector reports no loop here.",
  no_earlier_place: "Every place so far is recent. The drive has just begun.",
  no_similar_place:
    "No earlier place looks similar (ξ below retrieval.min_similarity). The image may be blank or dark.",
  no_geometry:
    "Features match, but not as one rigid scene. Look-alike texture or moving objects can cause this.",
  low_score:
    "A geometry was found, but with too little evidence. It is a new place, or the overlap is too small.",
  ambiguous:
    "The evidence is strong enough, but other places share it. Look-alike places cannot be told apart.",
  unreachable:
    "The evidence is strong enough, but by odometry the robot cannot be there: a place that looks alike, or odometry is wrong.",
  unreadable: "The image is damaged, too small, or not an image.",
};

const kJudged: Partial<Record<Verdict, string>> = {
  right: "The match is accepted, and it is right.",
  wrong: "The match is accepted, but it is not a true place of this frame.",
  tolerated: "The match is accepted. The ground truth counts it neither as right nor as wrong.",
  missed: "The match is accepted and not wrong, but it is not a true place of this frame.",
  ignored: "The match is accepted. The ground truth excludes this frame from the score.",
  elsewhere:
    "The match is accepted. It is in an earlier session of the map, which the ground truth does not cover.",
};

/** The meaning of a loop's verdict. */
export const meaningOfLoop = (verdict: Verdict): string =>
  kJudged[verdict] ?? kMeanings["loop"] ?? "";

export function meaningOfStatus(model: RunModel, status: string): string {
  if (status !== "few_matches") return kMeanings[status] ?? "";
  const needed = model.run.record?.options["verification"]?.["min_matches"];
  const few = needed === undefined ? "enough features" : `${needed} features`;
  return `No candidate shares ${few}. It is a new place; or blur, or another viewing direction.`;
}

export const nameOfStatus = (status: string): string => status.replaceAll("_", " ");
