// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Run } from "./report_data.ts";

type Column = unknown[] | null;
type Table = Record<string, Column>;

/** Columns of some frames, by the names that Run has for them; null where no frame has a value. */
export type Columns = Record<string, Column | Table> & {
  status: unknown[];
  status_names: string[];
};

/** The frames before `from`, then those of `more`. */
function grown(column: Column | undefined, more: Column, from: number, count: number): Column {
  if (!column && !more) return null;
  const all = column ?? new Array<unknown>(from).fill(null);
  all.length = from;
  all.push(...(more ?? new Array<unknown>(count).fill(null)));
  return all;
}

/** Appends frames, the first of which is `from`, to the columns of a run. */
export function grow(run: Run, from: number, { status_names, ...columns }: Columns): void {
  const count = columns.status.length;
  const table = run as unknown as Record<string, Column | Table>;
  for (const [name, more] of Object.entries(columns)) {
    if (more === null || Array.isArray(more)) {
      table[name] = grown(table[name] as Column, more, from, count);
      continue;
    }
    const inner = (table[name] ?? {}) as Table;
    for (const [key, column] of Object.entries(more))
      inner[key] = grown(inner[key], column, from, count);
    table[name] = inner;
  }
  run.status_names = status_names;
  run.frames = from + count;
}
