// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html, setPressed } from "./dom.ts";
import * as format from "./format.ts";
import { type Columns, grow } from "./growth.ts";
import type { Picture } from "./report_data.ts";
import type { Store } from "./store.ts";

/** The page is drawn at most so often, and less often if that takes long. */
const kPause_ms = 250;
const kShareOfTime = 5;
/** Of the speed that is shown. */
const kWindow_ms = 3000;
const kMaxPictures = 300;

interface News {
  from: number;
  columns: Columns;
}

/** Reads the frames of a run that goes on from the server that the page came from. */
export class Live {
  readonly element: HTMLElement;
  private readonly state = html("span", { class: "live-state", role: "status" }, "connecting");
  private readonly follower: HTMLButtonElement;
  private isFollowing = !location.hash.includes("frame=");
  private isSelecting = false;
  private isOver = false;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private pause_ms = kPause_ms;
  private readonly kept: number[] = [];
  private readonly marks: { time_ms: number; frames: number }[] = [];

  /** `showGrowth` draws what has grown, `showPair` the selected pair. */
  constructor(
    private readonly id: string,
    private readonly store: Store,
    private readonly showGrowth: () => void,
    private readonly showPair: () => void,
  ) {
    this.follower = button(
      { class: "quiet", title: "Show the newest frame that the filter shows" },
      () => this.toggleFollowing(),
      "follow",
    );
    this.element = html("span", { class: "live", "data-key": "live" }, this.state, this.follower);
    setPressed(this.follower, this.isFollowing);
    store.subscribe((now, before) => {
      const isOther = now.frame !== before.frame || now.against !== before.against;
      if (isOther && !this.isSelecting) this.setFollowing(false);
      if (!this.isSelecting) void this.completePair();
    });
  }

  start(): void {
    const events = new EventSource(`events/${this.id}`);
    events.onmessage = ({ data }) => this.take(JSON.parse(data) as News);
    events.onerror = () => this.tell("lost", "connection lost, trying again");
    events.addEventListener("end", ({ data }) => {
      events.close();
      this.isOver = true;
      if (data === "load") location.reload();
      else this.tell("ended", "the run has ended without a report");
    });
  }

  private take({ from, columns }: News): void {
    grow(this.store.model.run, from, columns);
    this.marks.push({ time_ms: performance.now(), frames: this.store.model.frames });
    if (this.timer === null) this.timer = setTimeout(() => void this.draw(), this.pause_ms);
  }

  private async draw(): Promise<void> {
    if (this.isOver) return;
    const begin_ms = performance.now();
    this.store.model.grow();
    this.showGrowth();
    this.tell("on", `live, ${this.speed()}`);
    this.pause_ms = Math.max(kPause_ms, kShareOfTime * (performance.now() - begin_ms));
    await (this.isFollowing ? this.follow() : this.completePair());
    const isNews = this.store.model.hasGrown();
    this.timer = isNews ? setTimeout(() => void this.draw(), this.pause_ms) : null;
  }

  /** Selects the newest frame, once there are pictures to show. */
  private async follow(): Promise<void> {
    const frame = this.store.frames().at(-1);
    if (frame === undefined) return;
    await this.fetchPictures(frame, this.store.model.match(frame));
    if (!this.isFollowing) return;
    this.isSelecting = true;
    this.store.show(frame);
    this.isSelecting = false;
  }

  private async completePair(): Promise<void> {
    const { now, model } = this.store;
    if (await this.fetchPictures(now.frame, model.partner(now))) this.showPair();
  }

  /** Whether there are new ones. */
  private async fetchPictures(...frames: (number | null)[]): Promise<boolean> {
    const { run } = this.store.model;
    if (this.isOver) return false;
    const missing = frames.filter((frame) => frame !== null && !run.pictures[frame]);
    const news = await Promise.all(missing.map((frame) => pictureOf(frame as number)));
    news.forEach((picture, i) => {
      const frame = missing[i] as number;
      if (!picture || run.pictures[frame]) return;
      run.pictures[frame] = picture;
      this.kept.push(frame);
    });
    for (const frame of this.kept.splice(0, this.kept.length - kMaxPictures))
      delete run.pictures[frame];
    return news.some((picture) => picture !== null);
  }

  private toggleFollowing(): void {
    this.setFollowing(!this.isFollowing);
    if (this.isFollowing) void this.follow();
  }

  private setFollowing(isFollowing: boolean): void {
    this.isFollowing = isFollowing;
    setPressed(this.follower, isFollowing);
  }

  /** "29.8 frames/s", of the last seconds. */
  private speed(): string {
    const now = this.marks.at(-1);
    while (now && (this.marks[0]?.time_ms ?? now.time_ms) < now.time_ms - kWindow_ms)
      this.marks.shift();
    const first = this.marks[0];
    if (!now || !first || now.time_ms <= first.time_ms) return "0 frames/s";
    const rate = (1000 * (now.frames - first.frames)) / (now.time_ms - first.time_ms);
    return `${format.rate(rate)} frames/s`;
  }

  private tell(state: "on" | "lost" | "ended", text: string): void {
    this.state.dataset["state"] = state;
    this.state.textContent = text;
  }
}

/** Null if there is none, or it cannot be had now. */
async function pictureOf(frame: number): Promise<Picture | null> {
  try {
    const answer = await fetch(`pictures/${frame}`);
    return answer.ok ? ((await answer.json()) as Picture) : null;
  } catch {
    return null;
  }
}
