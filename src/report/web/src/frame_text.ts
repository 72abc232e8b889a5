// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import * as format from "./format.ts";
import { candidateName } from "./partner.ts";
import type { RunModel } from "./run_model.ts";
import { nameOfStatus } from "./status_text.ts";
import { nameOf } from "./verdicts.ts";

/** The tooltip of a frame. */
export function frameText(model: RunModel, frame: number): string[] {
  const mark = model.mark(frame);
  const lines = [`frame ${frame}`];
  if (mark) lines[0] += `: ${nameOf(mark)}`;
  else lines[0] += `: ${nameOfStatus(model.status(frame))}`;
  const name = model.name(frame);
  if (name !== null) lines.splice(1, 0, name);
  if (model.matchName(frame) !== null) {
    const score = format.score(model.score(frame), model.run.threshold);
    lines.push(`${candidateName(model, frame)}, score ${score}`);
  }
  return lines;
}
