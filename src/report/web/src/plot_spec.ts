// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Bounds, ZoomAxes } from "./bounds.ts";
import type { Pen } from "./pen.ts";
import type { Projection } from "./projection.ts";
import type { Against } from "./store.ts";
import type { Theme } from "./theme.ts";

/** What is under the pointer. */
export interface Hit {
  frame: number;
  against?: Against;
  /** Position of the highlight; hairlines instead of a ring if `cross` is set. */
  at: { x: number; y: number };
  cross?: boolean;
  text: readonly string[];
}

export interface PlotSpec {
  /** Description for screen readers. */
  label: string;
  xLabel: string;
  yLabel: string;
  height: (width: number) => number;
  zoom: ZoomAxes;
  equalAxes?: boolean;
  /** Axes with integer values: ticks only at whole numbers. */
  whole?: "x" | "y" | "xy";
  yDown?: boolean;
  hideAxes?: () => boolean;
  /** The bounds of the whole content. */
  bounds(): Bounds;
  draw(ctx: Pen, to: Projection, theme: Theme): void;
  /** `pixel` and `to` in CSS pixels of the plotting area. */
  hit(pixel: { x: number; y: number }, to: Projection): Hit | null;
  /** The marks of the selection, in CSS pixels of the plotting area. */
  selected(to: Projection): SVGElement[];
  /** Position of the selection, if it has one: keys zoom about it, and the view follows it. */
  place?(): { x: number; y: number } | null;
  select(hit: Hit): void;
}
