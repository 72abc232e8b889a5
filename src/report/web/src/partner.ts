// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { RunModel } from "./run_model.ts";
import type { Selection } from "./store.ts";

/** "match 17", "best candidate 1:17": what the frame's own numbers were taken with. */
export function candidateName(model: RunModel, frame: number): string {
  const name = model.matchName(frame);
  if (name === null) return model.isLoop(frame) ? "match elsewhere" : "no candidate";
  return `${model.isLoop(frame) ? "match" : "best candidate"} ${name}`;
}

/** What the frame beside the query is. */
export function partnerName(model: RunModel, selection: Selection): string {
  if (model.isWithCandidate(selection)) return candidateName(model, selection.frame);
  const partner = model.partner(selection);
  if (selection.against !== "truth") return `frame ${partner}`;
  return partner === null ? "no true place" : `true place ${partner}`;
}

/** Why there is no picture of a frame of this run, and what brings it. */
export function absenceOf(model: RunModel, frame: number): string {
  if (!model.isReadable(frame)) return "This image could not be read.";
  if (Object.keys(model.run.pictures).length === 0) {
    return model.run.record
      ? "No pictures were kept with this run, or --pictures-mb left no room for one."
      : "There are no pictures: they come with runs of loopbit.";
  }
  return "Left out to keep the page small; --pictures-mb N makes room for more.";
}

function noCandidate(model: RunModel, frame: number): string {
  if (model.isLoop(frame)) return "A frame of another recording.";
  return model.tellsUnreadable()
    ? "No earlier frame came into question."
    : "The detector names no match.";
}

/** Why there is no picture beside the query. */
export function partnerAbsence(model: RunModel, selection: Selection): string {
  const partner = model.partner(selection);
  if (partner !== null) return absenceOf(model, partner);
  if (selection.against === "truth") return "Truth lists no earlier place of this frame.";
  const earlier = model.earlierMatch(selection.frame);
  if (!earlier) return noCandidate(model, selection.frame);
  const map = model.run.record?.map?.path ?? "the map";
  return `Frame ${earlier.frame} of session ${earlier.session} of ${map}; its picture is not in this run's folder.`;
}
