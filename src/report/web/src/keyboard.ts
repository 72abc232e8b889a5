// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html } from "./dom.ts";
import type { PairBrowser } from "./pair_browser.ts";
import type { Store } from "./store.ts";

const kKeys: readonly (readonly [string, string])[] = [
  ["← →", "previous and next frame that the filter shows"],
  ["Home End", "first and last of these frames"],
  ["r w n", "judge the match: right, wrong, not sure; then go on"],
  ["p", "play along the run, or stop"],
  ["e", "enlarge the pictures, or not"],
  ["Tab", "next control or plot"],
  [
    "+ − 0",
    "zoom in on the selected frame, zoom out, show all, in the focused plot, which follows the frame",
  ],
  ["wheel, drag", "zoom and move a plot after clicking it; Ctrl + wheel zooms any plot"],
  ["?", "show this list"],
  ["Esc", "close this list"],
];

/** The list of keys, and the button that opens it. */
export function keyHelp(): { dialog: HTMLDialogElement; opener: HTMLButtonElement } {
  const rows = kKeys.map(([keys, what]) =>
    html("tr", {}, html("th", { scope: "row" }, html("kbd", {}, keys)), html("td", {}, what)),
  );
  const dialog = html(
    "dialog",
    { id: "keys", "aria-labelledby": "keys-title" },
    html("h2", { id: "keys-title" }, "Keys"),
    html("table", { "aria-labelledby": "keys-title" }, html("tbody", {}, ...rows)),
    button({}, () => dialog.close(), "Close"),
  );
  const opener = button({ title: "Keys (?)" }, () => dialog.showModal(), "keys");
  return { dialog, opener };
}

/** A field of text, or a table that arrow keys move sideways. */
function takesKeys(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement) return true;
  const table = target instanceof Element ? target.closest(".scroll") : null;
  return table !== null && table.scrollWidth > table.clientWidth;
}

/** Arrow keys walk from anywhere else. */
export function listenToKeys(store: Store, pair: PairBrowser, dialog: HTMLDialogElement): void {
  const acts: Record<string, () => void> = {
    ArrowLeft: () => store.walk(-1),
    ArrowRight: () => store.walk(1),
    Home: () => store.walkToEnd("first"),
    End: () => store.walkToEnd("last"),
    r: () => pair.review.judge("right"),
    w: () => pair.review.judge("wrong"),
    n: () => pair.review.judge("not sure"),
    p: () => pair.player.toggle(),
    e: () => pair.enlarge(),
    "?": () => dialog.showModal(),
  };
  addEventListener("keydown", (event) => {
    const act = acts[event.key];
    const isOurs = !event.ctrlKey && !event.metaKey && !event.altKey && !dialog.open;
    if (!act || !isOurs || takesKeys(event.target)) return;
    event.preventDefault();
    act();
  });
}
