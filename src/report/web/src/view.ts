// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Child, html } from "./dom.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection } from "./store.ts";

/** A part of the page. */
export interface View {
  readonly element: HTMLElement;
  /** Another run is selected. */
  showRun(model: RunModel): void;
  /** Another frame is selected, or another partner of it. */
  showSelection(selection: Selection): void;
}

/** A titled part of the page. */
export function section(
  id: string,
  title: Child,
  caption: HTMLElement,
  controls: HTMLElement | null,
  ...content: (Node | null)[]
): HTMLElement {
  const head = html(
    "div",
    { class: "section-head" },
    html("h2", { id: `${id}-title` }, title),
    controls,
  );
  return html("section", { id, "aria-labelledby": `${id}-title` }, head, caption, ...content);
}

export const caption = (): HTMLParagraphElement => html("p", { class: "caption" });
