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

/** The two axes, in the colours of the theme of the moment. */
export function axesOf(spec: PlotSpec): uPlot.Axis[] {
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
  return [
    { ...axis(spec.xLabel, "x"), size: 28, space: 60 },
    { ...axis(spec.yLabel, "y"), size: 46, space: 36 },
  ];
}
