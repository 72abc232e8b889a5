// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html } from "./dom.ts";

const kGap_px = 14;
const tip = html("div", { class: "tip", "aria-hidden": "true", hidden: true });

/** The tooltip at the pointer. `x`, `y` in the window. */
export function showTip(lines: readonly string[], x: number, y: number): void {
  if (!tip.isConnected) document.body.append(tip);
  tip.replaceChildren(...lines.map((line) => html("div", {}, line)));
  tip.hidden = false;
  const { width, height } = tip.getBoundingClientRect();
  const left = x + kGap_px + width > innerWidth ? x - kGap_px - width : x + kGap_px;
  const top = y + kGap_px + height > innerHeight ? y - kGap_px - height : y + kGap_px;
  tip.style.left = `${Math.max(4, left)}px`;
  tip.style.top = `${Math.max(4, top)}px`;
}

export function hideTip(): void {
  tip.hidden = true;
}
