// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html } from "./dom.ts";
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

const judged =
  (of: (evaluation: NonNullable<RunModel["run"]["evaluation"]>) => number) => (model: RunModel) =>
    model.run.evaluation ? of(model.run.evaluation) : null;

const kColumns: readonly Column[] = [
  {
    name: "recall",
    key: "recall",
    value: judged((e) => e.recall),
    text: format.share,
    best: "high",
  },
  {
    name: "precision",
    key: "precision",
    value: judged((e) => e.precision),
    text: format.share,
    best: "high",
  },
  { name: "wrong", key: "wrong", value: judged((e) => e.wrong), text: format.count, best: "low" },
  {
    name: "recall at 100 % precision",
    key: "recall_at_full_precision",
    value: judged((e) => e.recall_at_full_precision),
    text: format.share,
    best: "high",
  },
  {
    name: "average precision",
    key: "average_precision",
    value: judged((e) => e.average_precision),
    text: format.share,
    best: "high",
  },
  {
    name: "pair recall",
    key: "pairs.recall",
    value: judged((e) => e.pairs.recall),
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

/** One row a run; the header sorts, the name of a run shows it. */
export function comparison(store: Store, models: readonly RunModel[]) {
  const head = html("tr");
  const body = html("tbody");
  let sorted: { column: Column; direction: 1 | -1 } | null = null;

  const order = () => {
    const rows = models.map((model, index) => ({ model, index }));
    const by = sorted;
    if (by) {
      const value = (model: RunModel) => by.column.value(model) ?? Number.NEGATIVE_INFINITY;
      rows.sort((a, b) => by.direction * (value(a.model) - value(b.model)));
    }
    return rows;
  };

  const sortBy = (column: Column) => {
    const first = column.best === "low" ? 1 : -1;
    const direction = sorted?.column === column ? (sorted.direction === 1 ? -1 : 1) : first;
    sorted = { column, direction };
    show();
  };

  const heads = kColumns.map((column) => ({
    column,
    cell: html(
      "th",
      { scope: "col" },
      button({}, () => sortBy(column), column.name),
    ),
  }));

  const show = () => {
    for (const { column, cell } of heads) {
      const direction = sorted?.column === column ? sorted.direction : 0;
      const name = direction === 0 ? "none" : direction === 1 ? "ascending" : "descending";
      cell.setAttribute("aria-sort", name);
    }
    body.replaceChildren(...order().map(({ model, index }) => row(model, index)));
  };

  const row = (model: RunModel, index: number) => {
    const isShown = index === store.now.run;
    const name = button(
      { "aria-pressed": isShown, title: "Show this run" },
      () => store.change({ run: index, against: "match", filter: "all" }),
      lineOf(index, isShown),
      model.run.name,
    );
    const cells = kColumns.map((column) => {
      const value = column.value(model);
      const isBest = value !== null && value === bestOf(column, models);
      return html(
        "td",
        { "data-key": `run.${index}.${column.key}`, class: isBest ? "best" : null },
        value === null ? "–" : column.text(value),
        isBest ? html("span", { class: "visually-hidden" }, " (best)") : null,
      );
    });
    return html(
      "tr",
      { class: isShown ? "current" : null },
      html("th", { scope: "row" }, name),
      ...cells,
    );
  };

  head.append(html("th", { scope: "col" }, "run"), ...heads.map(({ cell }) => cell));
  const table = html(
    "table",
    { class: "numbers comparison" },
    html(
      "caption",
      {},
      "The runs side by side; the best of each column is bold. Choose a run to see it below.",
    ),
    html("thead", {}, head),
    body,
  );
  return {
    element: html(
      "div",
      { class: "scroll", tabindex: 0, role: "region", "aria-label": "Comparison of the runs" },
      table,
    ),
    show,
  };
}
