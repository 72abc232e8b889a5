// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type uPlot from "uplot";
import type { PlotSpec } from "./plot_spec.ts";
import { theme } from "./theme.ts";

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

/**
 * The two axes, in the colours of the theme of the moment; and how far the labels of the first may
 * stand out to the right.
 */
export function axesOf(spec: PlotSpec): { axes: uPlot.Axis[]; overhang: () => number } {
  let labels: string[] = [];
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
  const values = (_: uPlot, ticks: number[]) => ticks.map((tick) => kNumber.format(tick));
  const keptValues = (plot: uPlot, ticks: number[]) => {
    labels = values(plot, ticks);
    return labels;
  };
  return {
    axes: [
      { ...axis(spec.xLabel, "x"), values: keptValues, size: 28, space: 60 },
      { ...axis(spec.yLabel, "y"), values, size: 46, space: 36 },
    ],
    overhang: () => roomFor(labels),
  };
}

/** Half the width of the widest label, because labels are centred under their ticks. */
function roomFor(labels: readonly string[]): number {
  if (!ruler) return kLeastRoom_px;
  ruler.font = `${kFont_px}px ${theme().font}`;
  const widest = labels.reduce((most, label) => Math.max(most, ruler.measureText(label).width), 0);
  return Math.max(kLeastRoom_px, kRoomStep_px * Math.ceil(widest / 2 / kRoomStep_px));
}
