// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, setPressed } from "./dom.ts";
import type { Store } from "./store.ts";

const kPause_ms = 350;

/** Shows the frames one after the other, as the arrow keys do, to the end. */
export class Player {
  readonly button: HTMLButtonElement;
  private timer: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly store: Store) {
    this.button = button(
      { class: "quiet", title: "Play along the run (p)" },
      () => this.toggle(),
      "play",
    );
    setPressed(this.button, false);
  }

  toggle(): void {
    if (this.timer !== null) this.stop();
    else this.timer = setInterval(() => this.step(), kPause_ms);
    setPressed(this.button, this.timer !== null);
  }

  private step(): void {
    const before = this.store.now.frame;
    this.store.walk(1);
    if (this.store.now.frame === before) this.toggle();
  }

  private stop(): void {
    if (this.timer !== null) clearInterval(this.timer);
    this.timer = null;
  }
}
