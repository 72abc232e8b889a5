// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html } from "./dom.ts";
import * as format from "./format.ts";
import type { RunModel } from "./run_model.ts";
import { kMarked, type Marked, markIcon, meaningOf, nameOf } from "./verdicts.ts";

export interface Legend {
  element: HTMLElement;
  show(model: RunModel): void;
}

/** Revisits with a wrong loop also count as missed, but have the mark of the wrong loop. */
function numberOf(model: RunModel, verdict: Marked): string {
  const marked = model.framesMarked(verdict).length;
  const all = verdict === "missed" ? model.framesIn(verdict).length : marked;
  const others = all - marked;
  return format.count(all) + (others > 0 ? ` (${format.count(others)} marked as wrong)` : "");
}

/** The marks that occur, with their names and counts. */
export function legend(): Legend {
  const element = html("ul", { class: "legend" });
  return {
    element,
    show(model) {
      const entries = [...kMarked]
        .reverse()
        .filter((verdict) => model.framesMarked(verdict).length > 0)
        .map((verdict) =>
          html(
            "li",
            { title: meaningOf(verdict) },
            markIcon(verdict),
            `${nameOf(verdict)} ${numberOf(model, verdict)}`,
          ),
        );
      element.replaceChildren(...entries);
    },
  };
}
