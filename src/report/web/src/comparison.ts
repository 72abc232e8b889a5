// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html, renew } from "./dom.ts";
import { type Figures, figuresOf } from "./figures.ts";
import * as format from "./format.ts";
import { lineOf } from "./run_lines.ts";
import type { RunModel } from "./run_model.ts";
import type { Store } from "./store.ts";

interface Column {
  name: string;
  key: string;
  value: (model: RunModel) => number | null;
  text: (value: number) => string;
  best: "high" | "low" | null;
}

const figure =
  (name: keyof Figures) =>
  ({ run }: RunModel) =>
    run.evaluation && figuresOf(run.evaluation)[name];

const kColumns: readonly Column[] = [
  {
    name: "recall",
    key: "recall",
    value: figure("recall"),
    text: format.share,
    best: "high",
  },
  {
    name: "precision",
    key: "precision",
    value: figure("precision"),
    text: format.share,
    best: "high",
  },
  {
    name: "wrong",
    key: "wrong",
    value: (m) => m.run.evaluation?.wrong ?? null,
    text: format.count,
    best: "low",
  },
  {
    name: "recall at 100 % precision",
    key: "recall_at_full_precision",
    value: figure("recallAtFullPrecision"),
    text: format.share,
    best: "high",
  },
  {
    name: "average precision",
    key: "average_precision",
    value: figure("averagePrecision"),
    text: format.share,
    best: "high",
  },
  {
    name: "pair recall",
    key: "pairs.recall",
    value: figure("pairRecall"),
    text: format.share,
    best: "high",
  },
  {
    name: "loops",
    key: "loops",
    value: (m) => m.framesIn("loops").length,
    text: format.count,
    best: null,
  },
  {
    name: "mean ms",
    key: "time.mean",
    value: (m) => m.totalTime()?.mean ?? null,
    text: format.milliseconds,
    best: "low",
  },
  {
    name: "p99 ms",
    key: "time.p99",
    value: (m) => m.totalTime()?.p99 ?? null,
    text: format.milliseconds,
    best: "low",
  },
];

function bestOf(column: Column, models: readonly RunModel[]): number | null {
  const values = models.map(column.value).filter((value) => value !== null);
  if (column.best === null || values.length < 2) return null;
  return column.best === "high" ? Math.max(...values) : Math.min(...values);
}

/** One row per run. A click on the header sorts; a click on a run shows it. */
export class Comparison {
  readonly element: HTMLElement;
  private readonly body = html("tbody");
  private readonly heads = new Map<Column, HTMLElement>();
  private sorted: { column: Column; direction: 1 | -1 } | null = null;

  constructor(
    private readonly store: Store,
    private readonly models: readonly RunModel[],
  ) {
    for (const column of kColumns) {
      const sort = button({}, () => this.sortBy(column), column.name);
      this.heads.set(column, html("th", { scope: "col" }, sort));
    }
    const what = "All runs. The best value of each column is bold. Select a run to show it below.";
    const head = html("tr", {}, html("th", { scope: "col" }, "run"), ...this.heads.values());
    const parts = [html("caption", {}, what), html("thead", {}, head), this.body];
    this.element = html(
      "div",
      { class: "scroll", tabindex: 0, role: "region", "aria-label": "Comparison of the runs" },
      html("table", { class: "numbers comparison" }, ...parts),
    );
  }

  show(): void {
    for (const [column, cell] of this.heads) {
      const direction = this.sorted?.column === column ? this.sorted.direction : 0;
      const name = direction === 0 ? "none" : direction === 1 ? "ascending" : "descending";
      cell.setAttribute("aria-sort", name);
    }
    const rows = this.order().map((index) => this.row(index));
    renew(
      this.body,
      rows.filter((row) => row !== null),
    );
  }

  /** Sorts by a column, best first; a second call reverses the order. */
  private sortBy(column: Column): void {
    const first = column.best === "low" ? 1 : -1;
    const isAgain = this.sorted?.column === column && this.sorted.direction === first;
    this.sorted = { column, direction: isAgain ? (first === 1 ? -1 : 1) : first };
    this.show();
  }

  /** The indices of the runs in display order. Runs without a value are always last. */
  private order(): number[] {
    const indices = this.models.map((_, index) => index);
    const sorted = this.sorted;
    if (!sorted) return indices;
    const value = (index: number) => {
      const model = this.models[index];
      return model ? sorted.column.value(model) : null;
    };
    return indices.sort((a, b) => {
      const [left, right] = [value(a), value(b)];
      if (left === null || right === null) return Number(left === null) - Number(right === null);
      return sorted.direction * (left - right);
    });
  }

  private row(index: number): HTMLElement | null {
    const model = this.models[index];
    if (!model) return null;
    const isShown = index === this.store.now.run;
    const name = button(
      { "aria-pressed": isShown, title: "Show this run" },
      () => this.store.change({ run: index, against: "match", filter: "all" }),
      lineOf(index, isShown),
      model.run.name,
    );
    const cells = kColumns.map((column) => {
      const value = column.value(model);
      const isBest = value !== null && value === bestOf(column, this.models);
      return html(
        "td",
        { "data-key": `run.${index}.${column.key}`, class: isBest ? "best" : null },
        value === null ? "–" : column.text(value),
        isBest ? html("span", { class: "visually-hidden" }, " (best)") : null,
      );
    });
    const head = html("th", { scope: "row" }, name);
    return html("tr", { class: isShown ? "current" : null }, head, ...cells);
  }
}
