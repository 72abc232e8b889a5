// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { RunModel } from "./run_model.ts";

/** What a person says of a query and its match. */
export type Says = "right" | "wrong" | "not sure";
export const kSays: readonly Says[] = ["right", "wrong", "not sure"];

type Triple = readonly [query: number, first: number, last: number];

/** The judgements of a run, which the browser keeps. */
export class Judgements {
  private readonly says = new Map<number, Says>();
  private readonly key: string;

  constructor(private readonly model: RunModel) {
    const { name, record, frames } = model.run;
    this.key = `loopbit judgements of ${name}, ${record?.input.path ?? ""}, ${frames} frames`;
    for (const [frame, match, says] of read(this.key)) {
      if (model.match(frame) === match && kSays.includes(says)) this.says.set(frame, says);
    }
  }

  of(frame: number): Says | null {
    return this.says.get(frame) ?? null;
  }

  get count(): number {
    return this.says.size;
  }

  /** Null takes it back. */
  judge(frame: number, says: Says | null): void {
    if (says === null) this.says.delete(frame);
    else this.says.set(frame, says);
    const all = [...this.says].map(([query, said]) => [query, this.model.match(query), said]);
    try {
      localStorage.setItem(this.key, JSON.stringify(all));
    } catch {
      // Full or forbidden: they last as long as the page.
    }
  }

  /**
   * truth.csv and not_false.csv: the truth of the run with the judged pairs changed. Without truth,
   * loops that were not judged are neither right nor wrong.
   */
  files(): { truth: string; notFalse: string } {
    const { truth } = this.model.run;
    let same = triplesOf(truth?.same_place);
    let near = triplesOf(truth?.near_place);
    for (const [query, says] of this.says) {
      const match = this.model.match(query) ?? 0;
      same = without(same, query, match);
      near = without(near, query, match);
      if (says === "right") same.push([query, match, match]);
      if (says === "not sure") near.push([query, match, match]);
    }
    for (const query of truth ? [] : this.model.framesIn("loops")) {
      const match = this.model.match(query);
      if (match !== null && !this.says.has(query)) near.push([query, match, match]);
    }
    return { truth: this.csv(same), notFalse: this.csv(near) };
  }

  /** Files count the frames of the whole sequence. */
  private csv(triples: readonly Triple[]): string {
    const every = this.model.run.record?.input.every ?? 1;
    const rows = [...triples]
      .sort((a, b) => a[0] - b[0] || a[1] - b[1])
      .map((triple) => triple.map((frame) => frame * every).join(","));
    return ["query,first,last", ...rows, ""].join("\n");
  }
}

function read(key: string): [number, number, Says][] {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "[]") as [number, number, Says][];
  } catch {
    return [];
  }
}

function triplesOf(flat: readonly number[] = []): Triple[] {
  const triples: Triple[] = [];
  for (let i = 0; i + 2 < flat.length; i += 3) triples.push(flat.slice(i, i + 3) as never);
  return triples;
}

/** The triples without one pair, around which its range is split. */
function without(triples: readonly Triple[], query: number, match: number): Triple[] {
  return triples.flatMap(([q, first, last]): Triple[] => {
    if (q !== query || match < first || match > last) return [[q, first, last]];
    const parts: Triple[] = [
      [q, first, match - 1],
      [q, match + 1, last],
    ];
    return parts.filter(([, a, b]) => a <= b);
  });
}
