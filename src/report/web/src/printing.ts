// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { resizePlots } from "./plot.ts";
import { refreshTheme } from "./theme.ts";

/** Redraws the canvases for printing, because they do not follow print styles. */
export function followPrinting(): void {
  const root = document.documentElement;
  const set = (isPaper: boolean) => {
    if (root.classList.contains("printing") === isPaper) return;
    root.classList.toggle("printing", isPaper);
    refreshTheme();
    resizePlots();
  };
  addEventListener("beforeprint", () => set(true));
  addEventListener("afterprint", () => set(false));
  matchMedia("print").addEventListener("change", (media) => set(media.matches));
}
