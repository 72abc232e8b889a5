// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

const kMissing = "–";
const kGrouped = new Intl.NumberFormat("en-GB");

export const count = (value: number): string => kGrouped.format(value);

/** "no loop", "1 loop", "2 loops". */
export const counted = (value: number, one: string, many = `${one}s`): string =>
  `${value === 0 ? "no" : count(value)} ${value <= 1 ? one : many}`;

export const share = (value: number | null): string =>
  value === null ? kMissing : value.toFixed(3);

export const similarity = share;

/** Of log odds. */
export const term = (value: number): string => value.toFixed(1).replace("-", "−");

/**
 * Scores are probabilities as a rule, and near 0 and near 1 stay told from these: 0.99996 is not
 * shown as 1. Another detector's may be anything.
 */
export function score(value: number | null, threshold: number | null = null): string {
  if (value === null) return kMissing;
  const text = rounded(value);
  // On which side of the threshold it lies must show.
  if (threshold === null || value === threshold || text !== rounded(threshold)) return text;
  for (let digits = 3; digits < 17; ++digits) {
    const longer = value.toPrecision(digits);
    if (Number(longer) < threshold === value < threshold && Number(longer) !== threshold)
      return longer;
  }
  return String(value);
}

function rounded(value: number): string {
  if (Number.isInteger(value)) return count(value);
  const size = Math.abs(value);
  if (size >= 1) return value.toFixed(size >= 100 ? 1 : 2).replace(/\.?0+$/, "");
  const shown = Number(value.toPrecision(4));
  if (!Number.isInteger(shown)) return String(shown);
  // Two digits of what is missing to 1.
  return value.toFixed(Math.min(16, 1 - Math.floor(Math.log10(1 - size))));
}

/** About three significant digits, because steps take microseconds to seconds. */
export function milliseconds(value: number): string {
  if (value >= 100) return count(Math.round(value));
  if (value >= 10) return value.toFixed(1);
  return value >= 1 ? value.toFixed(2) : value.toFixed(3);
}

export const rate = (value: number): string => (value >= 100 ? value.toFixed(0) : value.toFixed(1));

export const timestamp = (seconds: number): string => `${seconds.toFixed(2)} s`;
