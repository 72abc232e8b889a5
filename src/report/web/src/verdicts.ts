// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { svg } from "./dom.ts";
import { Path, type Pen } from "./pen.ts";
import type { Verdict } from "./report_data.ts";
import type { Theme } from "./theme.ts";

/** The name and the mark of a verdict. Marks differ in shape and colour. */
interface Mark {
  name: string;
  meaning: string;
  /** In a square from -1 to 1. */
  path: string;
  style: "filled" | "stroked" | "hollow";
}

export type Marked = Exclude<Verdict, "none">;

const kCircle = "M0.8,0A0.8,0.8 0 1 1 -0.8,0A0.8,0.8 0 1 1 0.8,0Z";

const kMarks: Record<Marked, Mark> = {
  ignored: {
    name: "not scored",
    meaning: "a loop that the ground truth excludes from the score",
    path: kCircle,
    style: "hollow",
  },
  right: { name: "right", meaning: "a right loop", path: kCircle, style: "filled" },
  tolerated: {
    name: "tolerated",
    meaning: "a loop that counts neither as right nor as wrong",
    path: "M0,-1L1,0L0,1L-1,0Z",
    style: "filled",
  },
  loop: {
    name: "loop",
    meaning: "a loop without ground truth",
    path: "M-0.75,-0.75H0.75V0.75H-0.75Z",
    style: "filled",
  },
  elsewhere: {
    name: "elsewhere",
    meaning: "a loop into an earlier session of the map, which the ground truth does not cover",
    path: "M-0.75,-0.75H0.75V0.75H-0.75Z",
    style: "hollow",
  },
  missed: {
    name: "missed",
    meaning: "a revisit without a right loop",
    path: "M0,-0.95L1,0.8H-1Z",
    style: "hollow",
  },
  wrong: {
    name: "wrong",
    meaning: "a wrong loop",
    path: "M-0.8,-0.8L0.8,0.8M0.8,-0.8L-0.8,0.8",
    style: "stroked",
  },
};

/** In drawing order: the most important marks come last, on top. */
export const kMarked: readonly Marked[] = [
  "ignored",
  "tolerated",
  "elsewhere",
  "loop",
  "right",
  "missed",
  "wrong",
];

export const isMarked = (verdict: Verdict): verdict is Marked => verdict in kMarks;
export const nameOf = (verdict: Marked): string => kMarks[verdict].name;
export const meaningOf = (verdict: Marked): string => kMarks[verdict].meaning;

/** The mark as an icon in text. Decorative, because its name is beside it. */
export function markIcon(verdict: Marked): SVGSVGElement {
  const path = svg("path", {
    d: kMarks[verdict].path,
    class: `mark ${kMarks[verdict].style} ${verdict}`,
  });
  return svg("svg", { class: "icon", viewBox: "-1.4 -1.4 2.8 2.8", "aria-hidden": "true" }, path);
}

export interface Point {
  x: number;
  y: number;
}

/** Draws all marks of one verdict at once; `radius` and points in canvas pixels. */
export function drawMarks(
  ctx: Pen,
  verdict: Marked,
  points: readonly Point[],
  radius: number,
  theme: Theme,
  halo = true,
): void {
  if (points.length === 0) return;
  const mark = kMarks[verdict];
  const all = new Path();
  for (const { x, y } of points) all.stamp(mark.path, radius, x, y);
  ctx.lineJoin = "round";
  ctx.lineCap = "butt";
  const line = Math.max(1, radius * (mark.style === "filled" ? 0.3 : 0.45));
  if (halo) {
    ctx.strokeStyle = theme.paper;
    ctx.lineWidth = mark.style === "filled" ? 2 * line : 2.2 * line;
    ctx.stroke(all);
  }
  if (mark.style === "filled") {
    ctx.fillStyle = theme[verdict];
    ctx.fill(all);
    return;
  }
  if (mark.style === "hollow") {
    ctx.fillStyle = theme.paper;
    ctx.fill(all);
  }
  ctx.strokeStyle = theme[verdict];
  ctx.lineWidth = line;
  ctx.stroke(all);
}

/** Marks are smaller if there are many; CSS pixels. */
export function markRadius(count: number): number {
  if (count <= 60) return 5;
  if (count <= 400) return 4;
  return count <= 1500 ? 3.2 : 2.5;
}
