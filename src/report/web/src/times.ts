// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html } from "./dom.ts";
import * as format from "./format.ts";
import type { TimeSummary } from "./report_data.ts";
import { kSteps, type RunModel } from "./run_model.ts";
import { stepBars } from "./step_bars.ts";
import type { Selection, Store } from "./store.ts";
import { TimePlot } from "./time_plot.ts";
import { caption, section, type View } from "./view.ts";

const kFigures = ["mean", "p50", "p99", "max"] as const;

/** The time of each step: distribution, over time, and as a table. */
export class Times implements View {
  readonly element: HTMLElement;
  private readonly caption = caption();
  private readonly table = html("table", { class: "numbers" });
  private readonly bars = html("div", { class: "step-bars" });
  private readonly content: HTMLElement;
  private readonly byTime: TimePlot;
  private readonly alongRun: TimePlot;

  constructor(
    store: Store,
    private readonly models: readonly RunModel[],
  ) {
    this.byTime = new TimePlot(store, "distribution");
    this.alongRun = new TimePlot(store, "along the run");
    this.content = html(
      "div",
      {},
      html("div", { class: "pair-of-plots" }, this.byTime.element, this.alongRun.element),
      html("div", { class: "scroll" }, this.table),
      this.bars,
    );
    this.element = section("times", "Time of each step", this.caption, null, this.content);
  }

  showRun(model: RunModel): void {
    const hasTimes = model.run.times_ms !== null;
    this.content.hidden = !hasTimes;
    this.caption.textContent = hasTimes
      ? "Left: distribution of the time per frame, coloured by step. Right: mean time over the run; it rises if the number of places costs time."
      : "This detector reports no times.";
    if (!hasTimes) return;
    this.showTable(model);
    this.byTime.refresh();
    this.alongRun.refresh();
    this.bars.replaceChildren(...(this.models.length > 1 ? stepBars(this.models) : []));
  }

  showSelection(_: Selection): void {
    this.byTime.mark();
    this.alongRun.mark();
  }

  private showTable(model: RunModel): void {
    const row = (name: string, summary: TimeSummary | null) =>
      html(
        "tr",
        name === "total" ? { class: "total" } : {},
        html("th", { scope: "row" }, html("span", { class: `swatch ${name}` }), name),
        ...kFigures.map((figure) =>
          html(
            "td",
            { "data-key": `times.${name}.${figure}` },
            summary ? format.milliseconds(summary[figure]) : "–",
          ),
        ),
      );
    this.table.replaceChildren(
      html("caption", {}, "Milliseconds per frame, over the readable frames"),
      html(
        "thead",
        {},
        html(
          "tr",
          {},
          html("th", { scope: "col" }, "step"),
          ...kFigures.map((figure) => html("th", { scope: "col" }, figure)),
        ),
      ),
      html(
        "tbody",
        {},
        ...kSteps.map((step) => row(step, model.stepTime(step))),
        row("total", model.totalTime()),
      ),
    );
  }
}
