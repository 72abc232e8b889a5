// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html } from "./dom.ts";
import * as format from "./format.ts";
import type { RunModel } from "./run_model.ts";
import { kMarked, markIcon, meaningOf, nameOf } from "./verdicts.ts";

export interface Legend {
  element: HTMLElement;
  show(model: RunModel): void;
}

/** The marks that occur, with their names and numbers. */
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
            `${nameOf(verdict)} ${format.count(model.framesMarked(verdict).length)}`,
          ),
        );
      element.replaceChildren(...entries);
    },
  };
}
