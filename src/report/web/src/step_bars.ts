// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html } from "./dom.ts";
import * as format from "./format.ts";
import { kSteps, type RunModel } from "./run_model.ts";

/** The mean of each step, one bar per run, with a tick at p99 of the total. */
export function stepBars(models: readonly RunModel[]): HTMLElement[] {
  const longest = models.reduce((most, model) => Math.max(most, model.totalTime()?.p99 ?? 0), 0);
  const rows = models.flatMap((model) => {
    const total = model.totalTime();
    if (!total || longest === 0) return [];
    const bar = html("div", { class: "bar" });
    const part = (className: string, ms: number) => {
      const element = html("span", { class: className });
      element.style.width = `${(100 * ms) / longest}%`;
      return element;
    };
    for (const step of kSteps) bar.append(part(`swatch ${step}`, model.stepTime(step)?.mean ?? 0));
    const tick = html("span", { class: "tick", title: `p99 ${format.milliseconds(total.p99)} ms` });
    tick.style.left = `${(100 * total.p99) / longest}%`;
    bar.append(tick);
    return [
      html("div", { class: "bar-name" }, model.run.name),
      bar,
      html(
        "div",
        { class: "bar-text" },
        `${format.milliseconds(total.mean)}, p99 ${format.milliseconds(total.p99)} ms`,
      ),
    ];
  });
  return [html("h3", {}, "Mean of each step per run; the tick marks p99 of the total"), ...rows];
}
