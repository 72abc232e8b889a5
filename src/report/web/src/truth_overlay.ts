// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html } from "./dom.ts";
import { Path, type Pen } from "./pen.ts";
import type { Projection } from "./projection.ts";

/** The cells of the matrix with a true pair, and their outline. */
export interface TruthOverlay {
  fill: HTMLCanvasElement;
  /** x1, y1, x2, y2 in cells. */
  edges: readonly number[];
}

function maskOf(triples: readonly number[], side: number, framesPerCell: number): Uint8Array {
  const mask = new Uint8Array(side * side);
  for (let i = 0; i + 2 < triples.length; i += 3) {
    const [query, first, last] = triples.slice(i, i + 3) as [number, number, number];
    const row = Math.floor(query / framesPerCell);
    if (row >= side) continue;
    const end = Math.min(side - 1, Math.floor(last / framesPerCell));
    for (let column = Math.floor(first / framesPerCell); column <= end; ++column) {
      mask[row * side + column] = 1;
    }
  }
  return mask;
}

function edgesOf(mask: Uint8Array, side: number): number[] {
  const edges: number[] = [];
  const at = (row: number, column: number) =>
    row < 0 || column < 0 || row >= side || column >= side ? 0 : mask[row * side + column];
  for (let row = 0; row <= side; ++row) {
    for (let column = 0; column <= side; ++column) {
      const here = at(row, column);
      if (here !== at(row - 1, column)) edges.push(column, row, column + 1, row);
      if (here !== at(row, column - 1)) edges.push(column, row, column, row + 1);
    }
  }
  return edges;
}

export function truthOverlay(
  triples: readonly number[],
  side: number,
  framesPerCell: number,
): TruthOverlay {
  const mask = maskOf(triples, side, framesPerCell);
  const fill = html("canvas", { width: side, height: side });
  // Of no frames at all there is nothing to fill.
  const ctx = side > 0 ? fill.getContext("2d") : null;
  const pixels = ctx?.createImageData(side, side);
  if (ctx && pixels) {
    for (let i = 0; i < mask.length; ++i) {
      if (mask[i] === 1) pixels.data.set([255, 255, 255, 60], 4 * i);
    }
    ctx.putImageData(pixels, 0, 0);
  }
  return { fill, edges: edgesOf(mask, side) };
}

export function drawTruth(
  ctx: Pen,
  to: Projection,
  truth: TruthOverlay,
  framesPerCell: number,
  onPicture: boolean,
  ink: string,
): void {
  const size = truth.fill.width * framesPerCell;
  if (onPicture) {
    ctx.drawImage(truth.fill, to.x(0), to.y(0), to.x(size) - to.x(0), to.y(size) - to.y(0));
  }
  const path = new Path();
  for (let i = 0; i + 3 < truth.edges.length; i += 4) {
    const [x1, y1, x2, y2] = truth.edges.slice(i, i + 4) as [number, number, number, number];
    path.moveTo(to.x(x1 * framesPerCell), to.y(y1 * framesPerCell));
    path.lineTo(to.x(x2 * framesPerCell), to.y(y2 * framesPerCell));
  }
  ctx.strokeStyle = onPicture ? "#ffffff" : ink;
  ctx.lineWidth = to.ratio;
  ctx.stroke(path);
}
