// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { viridis } from "./colour_map.ts";
import { html } from "./dom.ts";
import type { SimilarityMatrix } from "./report_data.ts";

/** The similarity matrix, decoded. */
export interface SimilarityImage {
  side: number;
  framesPerCell: number;
  /** 0 to 255, row by row. */
  levels: Uint8Array;
  picture: HTMLCanvasElement;
  /** xi at both ends of the colour scale. */
  range: readonly [low: number, high: number];
}

export async function decodeMatrix(matrix: SimilarityMatrix): Promise<SimilarityImage> {
  const source = new Image();
  source.src = `data:image/png;base64,${matrix.png}`;
  await source.decode();
  const { side } = matrix;
  const picture = html("canvas", { width: side, height: side });
  const ctx = picture.getContext("2d", { willReadFrequently: true });
  if (!ctx) throw new Error("this browser has no canvas");
  ctx.drawImage(source, 0, 0);
  const pixels = ctx.getImageData(0, 0, side, side);
  const levels = new Uint8Array(side * side);
  for (let i = 0; i < levels.length; ++i) levels[i] = pixels.data[4 * i] ?? 0;
  const [low, high] = span(levels, side);
  const palette = Array.from({ length: 256 }, (_, level) =>
    viridis((level - low) / Math.max(1, high - low)),
  );
  for (let i = 0; i < levels.length; ++i) {
    const row = Math.floor(i / side);
    const [red, green, blue] = palette[levels[i] ?? 0] ?? [0, 0, 0];
    // Neither the query nor later frames are candidates: nothing is drawn there.
    const isCandidate = i % side < row || (i % side === row && matrix.frames_per_cell > 1);
    pixels.data.set([red, green, blue, isCandidate ? 255 : 0], 4 * i);
  }
  ctx.putImageData(pixels, 0, 0);
  const range = [low / 255, high / 255] as const;
  return { side, framesPerCell: matrix.frames_per_cell, levels, picture, range };
}

/** The range of most cells, so that a few outliers do not use up the colour scale. */
function span(levels: Uint8Array, side: number): [number, number] {
  const histogram = new Uint32Array(256);
  let cells = 0;
  for (let row = 1; row < side; ++row) {
    for (let column = 0; column < row; ++column) {
      const level = levels[row * side + column] ?? 0;
      histogram[level] = (histogram[level] ?? 0) + 1;
      ++cells;
    }
  }
  const quantile = (share: number) => {
    let sum = 0;
    for (let level = 0; level < 256; ++level) {
      sum += histogram[level] ?? 0;
      if (sum > share * cells) return level;
    }
    return 255;
  };
  return cells === 0 ? [0, 255] : [quantile(0.01), Math.max(quantile(0.998), quantile(0.01) + 1)];
}
