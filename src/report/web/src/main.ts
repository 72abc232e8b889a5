// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import "./base.css";
import "./summary.css";
import "./plots.css";
import "./times.css";
import "./pair.css";
import "./pictures.css";
import "./footer.css";
import "./live.css";
import "./print.css";
import { Correction } from "./correction.ts";
import { button, html } from "./dom.ts";
import { Footer } from "./footer.ts";
import { keyHelp, listenToKeys } from "./keyboard.ts";
import { Live } from "./live.ts";
import { Matrix } from "./matrix.ts";
import { PairBrowser } from "./pair_browser.ts";
import { showGrowth, startPlots } from "./plot.ts";
import { PrecisionRecall } from "./precision_recall.ts";
import { followPrinting } from "./printing.ts";
import type { ReportData } from "./report_data.ts";
import { RunModel } from "./run_model.ts";
import { Score } from "./score.ts";
import { Store } from "./store.ts";
import { Summary } from "./summary.ts";
import { startTheme, toggleScheme } from "./theme.ts";
import { Times } from "./times.ts";
import { Trajectory } from "./trajectory.ts";
import type { View } from "./view.ts";

function readData(): ReportData {
  const text = document.getElementById("report-data")?.textContent ?? "";
  return JSON.parse(text) as ReportData;
}

/** The plots, in the order in which one asks: where, how sure, how alike, how good, how fast. */
function plotsOf(store: Store, models: readonly RunModel[]): View[] {
  const views: View[] = [new Trajectory(store), new Score(store), new Matrix(store)];
  if (models.some((model) => model.run.correction)) views.splice(1, 0, new Correction(store));
  if (models.some((model) => model.run.evaluation)) views.push(new PrecisionRecall(store, models));
  if (models.some((model) => model.run.times_ms)) views.push(new Times(store, models));
  return views;
}

function bar(live: HTMLElement | null, opener: HTMLElement): HTMLElement {
  return html(
    "div",
    { class: "bar-top" },
    html("span", { class: "brand" }, "loopbit report"),
    live,
    html(
      "span",
      { class: "tools" },
      button({ id: "theme", "aria-label": "Light or dark" }, toggleScheme, "light / dark"),
      opener,
    ),
  );
}

function start(data: ReportData): void {
  const models = data.runs.map((run) => new RunModel(run, data.live !== undefined));
  if (models.length === 0) throw new Error("the report holds no run");
  const store = new Store(models);
  const summary = new Summary(store, models);
  const pair = new PairBrowser(store);
  const plots = plotsOf(store, models);
  const footer = new Footer(data.loopbit, data.default_options);
  const views: View[] = [summary, pair, ...plots, footer];
  const { dialog, opener } = keyHelp();

  const showRun = (shown: readonly View[] = views) => {
    for (const view of shown) view.showRun(store.model);
  };
  const showSelection = () => {
    for (const view of views) view.showSelection(store.now);
  };
  const live =
    data.live === undefined
      ? null
      : new Live(
          data.live,
          store,
          () => showGrowth(() => showRun([summary, pair, ...plots])),
          () => pair.showSelection(store.now),
        );
  store.subscribe((now, before) => {
    if (now.run !== before.run) showRun();
    showSelection();
  });
  document
    .getElementById("report")
    ?.replaceChildren(
      bar(live?.element ?? null, opener),
      summary.element,
      html(
        "div",
        { class: "columns" },
        html("div", { class: "plots" }, ...plots.map((view) => view.element)),
        pair.element,
      ),
      footer.element,
      dialog,
    );
  startTheme();
  showRun();
  showSelection();
  listenToKeys(store, pair, dialog);
  followPrinting();
  void startPlots().then(() => performance.mark("report-drawn"));
  live?.start();
}

start(readData());
