// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Bounds, ZoomAxes } from "./bounds.ts";
import type { Projection } from "./projection.ts";
import type { Against } from "./store.ts";
import type { Theme } from "./theme.ts";

/** What is under the pointer. */
export interface Hit {
  frame: number;
  against?: Against;
  /** Where it is drawn; hairlines instead of a ring where `cross` is set. */
  at: { x: number; y: number };
  cross?: boolean;
  text: readonly string[];
}

export interface PlotSpec {
  /** For those who do not see it. */
  label: string;
  xLabel: string;
  yLabel: string;
  height: (width: number) => number;
  zoom: ZoomAxes;
  equalAxes?: boolean;
  /** The axes that count things: no ticks between whole numbers. */
  whole?: "x" | "y" | "xy";
  yDown?: boolean;
  hideAxes?: () => boolean;
  /** All there is to see. */
  bounds(): Bounds;
  draw(ctx: CanvasRenderingContext2D, to: Projection, theme: Theme): void;
  /** `pixel` and `to` in CSS pixels of the plotting area. */
  hit(pixel: { x: number; y: number }, to: Projection): Hit | null;
  /** Marks what is selected, in CSS pixels of the plotting area. */
  selected(to: Projection): SVGElement[];
  /** Where what is selected is, if it is anywhere: keys zoom about it, and the view follows it. */
  place?(): { x: number; y: number } | null;
  select(hit: Hit): void;
}
