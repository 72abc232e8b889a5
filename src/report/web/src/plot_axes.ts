// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type uPlot from "uplot";
import { Path, type Pen } from "./pen.ts";
import type { PlotSpec } from "./plot_spec.ts";
import type { Projection } from "./projection.ts";
import { type Theme, theme } from "./theme.ts";

const kFont_px = 12;
const kWholeSteps = [1, 10, 100, 1000, 10_000, 100_000].flatMap((unit) => [
  unit,
  2 * unit,
  5 * unit,
]);

const kNumber = new Intl.NumberFormat("en-GB", { maximumFractionDigits: 6 });
/** Margin to the right of a plot, CSS pixels; grows in steps, because labels change with the view. */
const kLeastRoom_px = 14;
const kRoomStep_px = 4;
const ruler = document.createElement("canvas").getContext("2d");

/** The ticks of an axis as they are drawn, with their labels. */
export type Ticks = readonly (readonly [value: number, label: string])[];

/**
 * The two axes, in the colours of the theme of the moment; how far the labels of the first may
 * stand out to the right; and their ticks.
 */
export function axesOf(spec: PlotSpec): {
  axes: uPlot.Axis[];
  overhang: () => number;
  ticks: Record<"x" | "y", Ticks>;
} {
  const ticks: Record<"x" | "y", Ticks> = { x: [], y: [] };
  const colour = (name: "muted" | "rule") => () =>
    spec.hideAxes?.() ? "transparent" : theme()[name];
  const axis = (label: string, name: "x" | "y"): uPlot.Axis => ({
    label,
    ...(spec.whole?.includes(name) ? { incrs: kWholeSteps } : {}),
    stroke: colour("muted"),
    font: `${kFont_px}px ${theme().font}`,
    labelFont: `${kFont_px}px ${theme().font}`,
    labelSize: 20,
    labelGap: 0,
    gap: 4,
    grid: { stroke: colour("rule"), width: 1 },
    ticks: { stroke: colour("rule"), width: 1, size: 4 },
  });
  const values = (name: "x" | "y") => (_: uPlot, shown: number[]) => {
    ticks[name] = shown.map((tick) => [tick, kNumber.format(tick)] as const);
    return ticks[name].map(([, label]) => label);
  };
  return {
    axes: [
      { ...axis(spec.xLabel, "x"), values: values("x"), size: 28, space: 60 },
      { ...axis(spec.yLabel, "y"), values: values("y"), size: 46, space: 36 },
    ],
    overhang: () => roomFor(ticks.x.map(([, label]) => label)),
    ticks,
  };
}

/** Half the width of the widest label, because labels are centred under their ticks. */
function roomFor(labels: readonly string[]): number {
  if (!ruler) return kLeastRoom_px;
  ruler.font = `${kFont_px}px ${theme().font}`;
  const widest = labels.reduce((most, label) => Math.max(most, ruler.measureText(label).width), 0);
  return Math.max(kLeastRoom_px, kRoomStep_px * Math.ceil(widest / 2 / kRoomStep_px));
}

/** The axes for a file, as uPlot draws them on the page. */
export function drawAxes(
  pen: Pen,
  to: Projection,
  ticks: Record<"x" | "y", Ticks>,
  spec: PlotSpec,
  colours: Theme,
): void {
  const grid = new Path();
  const [right, bottom] = [to.left + to.width, to.top + to.height];
  pen.fillStyle = colours.muted;
  pen.font = `${kFont_px}px ${colours.font}`;
  pen.textAlign = "center";
  for (const [value, label] of ticks.x) {
    grid.moveTo(to.x(value), to.top);
    grid.lineTo(to.x(value), bottom + 4);
    pen.fillText(label, to.x(value), bottom + 18);
  }
  pen.fillText(spec.xLabel, to.left + to.width / 2, bottom + 38);
  pen.textAlign = "right";
  for (const [value, label] of ticks.y) {
    grid.moveTo(to.left - 4, to.y(value));
    grid.lineTo(right, to.y(value));
    pen.fillText(label, to.left - 8, to.y(value) + 4);
  }
  pen.textAlign = "left";
  pen.fillText(spec.yLabel, 4, Math.max(12, to.top - 2));
  pen.strokeStyle = colours.rule;
  pen.lineWidth = 1;
  pen.stroke(grid);
}
