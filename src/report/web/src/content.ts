// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

/** Side of the binary content, in pixels. */
export const kSide = 64;

/** The bits of a binary content, one byte each (0 or 1), row by row. */
export type Content = Uint8Array;

export function bytesOf(base64: string): Uint8Array {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}

/** 64 rows of 8 bytes, little-endian: bit 0 of a row is its left edge. */
export function contentOf(base64: string): Content {
  const bytes = bytesOf(base64);
  const content = new Uint8Array(kSide * kSide);
  for (let i = 0; i < content.length; ++i) content[i] = ((bytes[i >> 3] ?? 0) >> (i & 7)) & 1;
  return content;
}

export const countOf = (content: Content): number => content.reduce((sum, bit) => sum + bit, 0);

/** The content shifted `columns` to the right (left if negative); other pixels are dropped. */
export function shifted(content: Content, columns: number): Content {
  const moved = new Uint8Array(content.length);
  for (let i = 0; i < content.length; ++i) {
    const to = (i % kSide) + columns;
    if (content[i] === 1 && to >= 0 && to < kSide) moved[i + columns] = 1;
  }
  return moved;
}

export interface Overlap {
  /** xi = |A & B| / max(|A|, |B|), the largest over the shifts; 0 if both are empty. */
  similarity: number;
  both: number;
  larger: number;
  /** Columns by which `a` was shifted to the right; the smallest of equally good ones. */
  shift: number;
  /** `a` shifted by `shift`. */
  moved: Content;
}

/**
 * Wang et al. 2019, section III-B. Shifts are even numbers of columns and the tolerance itself; |A|
 * is counted before shifting.
 */
export function overlapOf(a: Content, b: Content, tolerance: number): Overlap {
  const larger = Math.max(countOf(a), countOf(b));
  let best: Overlap = { similarity: 0, both: -1, larger, shift: 0, moved: a };
  for (let size = 0; size <= tolerance; ++size) {
    if (size % 2 !== 0 && size !== tolerance) continue;
    for (const shift of size === 0 ? [0] : [-size, size]) {
      const moved = shifted(a, shift);
      let both = 0;
      for (let i = 0; i < moved.length; ++i) both += (moved[i] ?? 0) & (b[i] ?? 0);
      if (both <= best.both) continue;
      best = { similarity: larger === 0 ? 0 : both / larger, both, larger, shift, moved };
    }
  }
  return best;
}
