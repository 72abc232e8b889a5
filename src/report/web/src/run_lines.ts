// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { svg } from "./dom.ts";

/** Runs differ by dashes, because colours show verdicts. */
const kDashes: readonly (readonly number[])[] = [
  [],
  [7, 4],
  [2, 3],
  [9, 3, 2, 3],
  [4, 2],
  [12, 4],
  [2, 6],
  [9, 3, 2, 3, 2, 3],
];

export const dashOf = (run: number): readonly number[] => kDashes[run % kDashes.length] ?? [];

/** A sample of the run's line, for legends. */
export function lineOf(run: number, isSelected: boolean): SVGSVGElement {
  const line = svg("line", {
    x1: 0,
    x2: 30,
    y1: 5,
    y2: 5,
    class: isSelected ? "run-line current" : "run-line",
    "stroke-dasharray": dashOf(run).join(" ") || "none",
  });
  return svg("svg", { class: "line-icon", viewBox: "0 0 30 10", "aria-hidden": "true" }, line);
}
