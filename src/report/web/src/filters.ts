// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html, setPressed } from "./dom.ts";
import * as format from "./format.ts";
import { type Filter, kFilters, type RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import { markIcon } from "./verdicts.ts";
import type { View } from "./view.ts";

const iconOf = (filter: Filter) =>
  filter === "all" || filter === "loops" ? null : markIcon(filter);

/** Verdicts need truth; few runs have loops elsewhere. */
function isOffered(filter: Filter, frames: number, hasTruth: boolean): boolean {
  if (filter === "elsewhere") return frames > 0;
  return filter === "all" || filter === "loops" || hasTruth;
}

/** The filter of the frames that the arrow keys visit. */
export class Filters implements View {
  readonly element = html("div", {
    class: "filters",
    role: "group",
    "aria-label": "Frames to show",
  });
  private readonly buttons = new Map<Filter, HTMLButtonElement>();
  private readonly counts = new Map<Filter, HTMLElement>();

  constructor(private readonly store: Store) {
    for (const filter of kFilters) {
      const count = html("span", { class: "count", "data-key": `filter.${filter}` });
      const made = button(
        { "data-filter": filter },
        () => this.store.filter(filter),
        iconOf(filter),
        `${filter} `,
        count,
      );
      this.buttons.set(filter, made);
      this.counts.set(filter, count);
      this.element.append(made);
    }
  }

  showRun(model: RunModel): void {
    const hasTruth = model.run.evaluation !== null;
    for (const filter of kFilters) {
      const frames = model.framesIn(filter).length;
      const made = this.buttons.get(filter);
      const count = this.counts.get(filter);
      if (!made || !count) continue;
      count.textContent = format.count(frames);
      made.disabled = frames === 0;
      made.hidden = !isOffered(filter, frames, hasTruth);
    }
  }

  showSelection(selection: Selection): void {
    for (const [filter, made] of this.buttons) setPressed(made, filter === selection.filter);
  }
}
