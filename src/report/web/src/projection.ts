// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Bounds } from "./bounds.ts";

/** Converts between data and pixels, for a rectangle of pixels that shows some bounds. */
export class Projection {
  private readonly scaleX: number;
  private readonly scaleY: number;

  constructor(
    private readonly bounds: Bounds,
    readonly left: number,
    readonly top: number,
    readonly width: number,
    readonly height: number,
    private readonly yDown: boolean,
    /** Canvas pixels per CSS pixel; multiply sizes by it. */
    readonly ratio: number,
  ) {
    this.scaleX = width / (bounds.x[1] - bounds.x[0]);
    this.scaleY = height / (bounds.y[1] - bounds.y[0]);
  }

  x(value: number): number {
    return this.left + (value - this.bounds.x[0]) * this.scaleX;
  }

  y(value: number): number {
    const below = this.yDown ? value - this.bounds.y[0] : this.bounds.y[1] - value;
    return this.top + below * this.scaleY;
  }

  atX(pixel: number): number {
    return this.bounds.x[0] + (pixel - this.left) / this.scaleX;
  }

  atY(pixel: number): number {
    const below = (pixel - this.top) / this.scaleY;
    return this.yDown ? this.bounds.y[0] + below : this.bounds.y[1] - below;
  }
}

/**
 * Of `count` things the one that is drawn nearest to a pixel, within `reach` pixels. A thing with a
 * handicap below zero wins over its neighbours.
 */
export function nearest(
  projection: Projection,
  pixel: { x: number; y: number },
  count: number,
  place: (i: number) => { x: number; y: number } | null,
  handicap: (i: number) => number,
  reach = 18,
): number | null {
  let best: number | null = null;
  let least = Number.POSITIVE_INFINITY;
  for (let i = 0; i < count; ++i) {
    const at = place(i);
    if (!at) continue;
    const distance = Math.hypot(projection.x(at.x) - pixel.x, projection.y(at.y) - pixel.y);
    if (distance > reach || distance + handicap(i) >= least) continue;
    least = distance + handicap(i);
    best = i;
  }
  return best;
}
