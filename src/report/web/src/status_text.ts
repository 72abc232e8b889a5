// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Verdict } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";

/** Why a frame has no loop, and what helps: the table of docs/run_folder.md in sentences. */
const kMeanings: Record<string, string> = {
  loop: "The match is accepted.",
  no_loop: "The detector reports no loop here.",
  no_earlier_place: "Every place so far is recent: this is the start of a drive.",
  no_similar_place:
    "No earlier place looks alike (ξ below retrieval.min_similarity); the picture may be blank or dark.",
  no_geometry:
    "Features match, but not as one rigid scene: look-alike texture, or things that move.",
  low_score:
    "There is a geometry, but too little evidence: a new place, or an overlap too small to be sure.",
  ambiguous:
    "There is enough evidence, but other places share it: they look alike, and cannot be told apart.",
  unreadable: "The image is damaged, of another size, or no image.",
};

const kJudged: Partial<Record<Verdict, string>> = {
  right: "The match is accepted, and it is a true place.",
  wrong: "The match is accepted, but it is no true place of this frame.",
  tolerated: "The match is accepted; truth counts it neither as right nor as wrong.",
  missed: "The match is accepted and not wrong, but it is no true place of this frame.",
  ignored: "The match is accepted; truth leaves this frame out of the score.",
  elsewhere:
    "The match is accepted; it is a place of an earlier session of the map, which truth does not judge.",
};

/** What became of a loop, as far as truth can tell. */
export const meaningOfLoop = (verdict: Verdict): string =>
  kJudged[verdict] ?? kMeanings["loop"] ?? "";

export function meaningOfStatus(model: RunModel, status: string): string {
  if (status !== "few_matches") return kMeanings[status] ?? "";
  const needed = model.run.record?.options["verification"]?.["min_matches"];
  const few = needed === undefined ? "enough features" : `${needed} features`;
  return `There are candidates, but none shares ${few}: a new place, or blur, or another direction of view.`;
}

export const nameOfStatus = (status: string): string => status.replaceAll("_", " ");
