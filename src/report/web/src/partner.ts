// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import * as format from "./format.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection } from "./store.ts";

/** The frame's own candidate, such as "match 17" or "best candidate 1:17". */
export function candidateName(model: RunModel, frame: number): string {
  const name = model.matchName(frame);
  if (name === null) return model.isLoop(frame) ? "match elsewhere" : "no candidate";
  return `${model.isLoop(frame) ? "match" : "best candidate"} ${name}`;
}

/** The name of the frame beside the query. */
export function partnerName(model: RunModel, selection: Selection): string {
  if (model.isWithCandidate(selection)) return candidateName(model, selection.frame);
  const partner = model.partner(selection);
  if (selection.against !== "truth") return `frame ${partner}`;
  return partner === null ? "no true place" : `true place ${partner}`;
}

/** Why a frame of this run has no picture, and how to get one. */
export function absenceOf(model: RunModel, frame: number): string {
  if (!model.isReadable(frame)) return "This image could not be read.";
  if (model.isLive) return "This picture is on its way.";
  const pictures = Object.keys(model.run.pictures).length;
  if (pictures === 0) {
    return model.run.record
      ? "This run has no pictures, or --pictures-mb left no space for them."
      : "Only runs of loopbit have pictures.";
  }
  const some = `${format.count(pictures)} of ${format.counted(model.frames, "frame")}`;
  return `Left out to keep the page small: it has pictures of ${some}. 'loopbit report RUN --pictures-mb N' writes a page with more.`;
}

function noCandidate(model: RunModel, frame: number): string {
  if (model.isLoop(frame)) return "The match is a frame of another recording.";
  return model.tellsUnreadable() ? "There is no candidate." : "The detector reports no match.";
}

/** Why there is no picture beside the query. */
export function partnerAbsence(model: RunModel, selection: Selection): string {
  const partner = model.partner(selection);
  if (partner !== null) return absenceOf(model, partner);
  if (selection.against === "truth") return "The truth lists no earlier place for this frame.";
  const earlier = model.earlierMatch(selection.frame);
  if (!earlier) return noCandidate(model, selection.frame);
  const map = model.run.record?.map?.path ?? "the map";
  return `Frame ${earlier.frame} of session ${earlier.session} of ${map}; its picture is not in this run's folder.`;
}
