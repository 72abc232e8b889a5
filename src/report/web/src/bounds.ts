// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

export type Range = readonly [low: number, high: number];

/** The part of the plane that a plot shows. */
export interface Bounds {
  x: Range;
  y: Range;
}

export type ZoomAxes = "none" | "x" | "xy";

const length = ([low, high]: Range) => high - low;
const kDeepestZoom = 2000;

/** `range` widened to the length `wanted`, with the same centre. */
function widened([low, high]: Range, wanted: number): Range {
  const middle = (low + high) / 2;
  return [middle - wanted / 2, middle + wanted / 2];
}

/** Widens the bounds so that both axes of a `width` x `height` plot have the same scale. */
export function withEqualAxes(bounds: Bounds, width: number, height: number): Bounds {
  const unitsPerPixel = Math.max(length(bounds.x) / width, length(bounds.y) / height);
  return {
    x: widened(bounds.x, unitsPerPixel * width),
    y: widened(bounds.y, unitsPerPixel * height),
  };
}

function zoomedRange(range: Range, home: Range, factor: number, about: number): Range {
  const smallest = length(home) / kDeepestZoom;
  const wanted = Math.min(length(home), Math.max(smallest, length(range) / factor));
  const scale = wanted / length(range);
  return kept([about - (about - range[0]) * scale, about + (range[1] - about) * scale], home);
}

/** Moves the bounds back into `home`. */
function kept([low, high]: Range, home: Range): Range {
  const back = Math.max(0, home[0] - low) - Math.max(0, high - home[1]);
  return [low + back, high + back];
}

/** Zooms in for `factor` > 1; the point `about` stays fixed. */
export function zoomed(
  view: Bounds,
  home: Bounds,
  axes: ZoomAxes,
  factor: number,
  about: { x: number; y: number },
): Bounds {
  return {
    x: axes === "none" ? view.x : zoomedRange(view.x, home.x, factor, about.x),
    y: axes === "xy" ? zoomedRange(view.y, home.y, factor, about.y) : view.y,
  };
}

export function panned(view: Bounds, home: Bounds, axes: ZoomAxes, dx: number, dy: number): Bounds {
  return {
    x: axes === "none" ? view.x : kept([view.x[0] + dx, view.x[1] + dx], home.x),
    y: axes === "xy" ? kept([view.y[0] + dy, view.y[1] + dy], home.y) : view.y,
  };
}

/** Whether the axes that can be zoomed show `place`. */
export function shows(view: Bounds, axes: ZoomAxes, place: { x: number; y: number }): boolean {
  const isIn = ([low, high]: Range, value: number) => value >= low && value <= high;
  return isIn(view.x, place.x) && (axes !== "xy" || isIn(view.y, place.y));
}

export const middle = (bounds: Bounds) => ({
  x: (bounds.x[0] + bounds.x[1]) / 2,
  y: (bounds.y[0] + bounds.y[1]) / 2,
});

/** Adds a margin around the content. */
export function padded([low, high]: Range, share: number): Range {
  const air = (high - low || 1) * share;
  return [low - air, high + air];
}
