// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Point } from "./verdicts.ts";

/** Share of the ring that stays open between the last frame and the first. */
const kGap = 0.03;

/** The frames in order on a ring of radius 1, clockwise from the top. */
export function ringOf(frames: number): Point[] {
  const points: Point[] = [];
  for (let frame = 0; frame < frames; ++frame) {
    const turn = kGap / 2 + ((1 - kGap) * frame) / Math.max(1, frames - 1);
    points.push({ x: Math.sin(2 * Math.PI * turn), y: Math.cos(2 * Math.PI * turn) });
  }
  return points;
}
