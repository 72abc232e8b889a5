// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Filter, kFilters, type Order, type RunModel } from "./run_model.ts";

/** The frame beside the selected one: its best candidate, its true place, or any frame. */
export type Against = "match" | "truth" | number;

export interface Selection {
  run: number;
  frame: number;
  against: Against;
  filter: Filter;
  order: Order;
}

type Listener = (now: Selection, before: Selection) => void;

/** The selection, which all views read and change. It is stored in the address. */
export class Store {
  private selection: Selection;
  private readonly listeners: Listener[] = [];

  constructor(private readonly models: readonly RunModel[]) {
    const first = models[0];
    this.selection = {
      run: 0,
      frame: first?.run.first_frame ?? 0,
      against: "match",
      filter: "all",
      order: "frame",
    };
    this.selection = this.valid(this.fromAddress());
    addEventListener("hashchange", () => this.change(this.fromAddress()));
  }

  get now(): Selection {
    return this.selection;
  }

  get model(): RunModel {
    const model = this.models[this.selection.run];
    if (!model) throw new Error(`there is no run ${this.selection.run}`);
    return model;
  }

  subscribe(listener: Listener): void {
    this.listeners.push(listener);
  }

  select(frame: number, against: Against = "match"): void {
    this.change({ frame, against });
  }

  /** If the filter hides the selected frame, the next visible frame is selected. */
  filter(filter: Filter): void {
    const frames = this.model.framesIn(filter);
    const { frame, against } = this.selection;
    if (frames.length === 0 || frames.includes(frame)) {
      this.change({ filter, against });
    } else {
      const next = frames.find((candidate) => candidate > frame) ?? frames.at(-1) ?? frame;
      this.change({ filter, frame: next, against: "match" });
    }
  }

  /** Selects a frame for now: the address keeps what it has. */
  show(frame: number): void {
    this.change({ frame, against: "match" }, false);
  }

  change(to: Partial<Selection>, isStored = true): void {
    const before = this.selection;
    this.selection = this.valid({ ...before, ...to });
    const { run, frame, against, filter, order } = this.selection;
    const same =
      run === before.run &&
      frame === before.frame &&
      against === before.against &&
      filter === before.filter &&
      order === before.order;
    if (same) return;
    if (isStored) this.toAddress();
    for (const listener of this.listeners) listener(this.selection, before);
  }

  /** The frames that the arrow keys visit. */
  frames(): readonly number[] {
    return this.model.walk(this.selection.filter, this.selection.order);
  }

  /** Visits loops by rising score, beginning with the weakest, or frames in order again. */
  toggleOrder(): void {
    const { filter, order } = this.selection;
    if (order === "weakest") {
      this.change({ order: "frame" });
      return;
    }
    this.change({ order: "weakest", filter: filter === "all" ? "loops" : filter });
    this.walkToEnd("first");
  }

  /** Moves by `step` frames among those that the filter shows. */
  walk(step: number): void {
    const frames = this.frames();
    const { frame, order } = this.selection;
    const isNext = (candidate: number) =>
      order === "frame" ? candidate >= frame : candidate === frame;
    const after = frames.findIndex(isNext);
    const at = after < 0 ? frames.length : after;
    const isMember = frames[at] === frame;
    const to = step > 0 && !isMember ? at + step - 1 : at + step;
    const next = frames[Math.min(Math.max(to, 0), frames.length - 1)];
    if (next !== undefined) this.select(next);
  }

  walkToEnd(end: "first" | "last"): void {
    const frames = this.frames();
    const frame = end === "first" ? frames[0] : frames.at(-1);
    if (frame !== undefined) this.select(frame);
  }

  private valid(wanted: Selection): Selection {
    const run = this.models[wanted.run] ? wanted.run : 0;
    const frames = this.models[run]?.frames ?? 0;
    const frame = Math.min(Math.max(0, wanted.frame), Math.max(0, frames - 1));
    const isMatch = this.models[run]?.isWithCandidate({ frame, against: wanted.against });
    const isFrame = typeof wanted.against !== "number" || wanted.against < frames;
    return { ...wanted, run, frame, against: isFrame && !isMatch ? wanted.against : "match" };
  }

  private fromAddress(): Selection {
    const fields = new URLSearchParams(location.hash.slice(1));
    const number = (name: string) => {
      const text = fields.get(name);
      return text !== null && /^\d{1,9}$/.test(text) ? Number(text) : null;
    };
    const filter = kFilters.find((name) => name === fields.get("show"));
    const against = fields.get("with") === "truth" ? "truth" : (number("with") ?? "match");
    return {
      run: number("run") ?? this.selection.run,
      frame: number("frame") ?? this.selection.frame,
      against,
      filter: filter ?? "all",
      order: fields.get("order") === "weakest" ? "weakest" : "frame",
    };
  }

  private toAddress(): void {
    const { run, frame, against, filter, order } = this.selection;
    const fields = [`frame=${frame}`];
    if (run > 0) fields.unshift(`run=${run}`);
    if (against !== "match") fields.push(`with=${against}`);
    if (filter !== "all") fields.push(`show=${filter}`);
    if (order !== "frame") fields.push(`order=${order}`);
    history.replaceState(null, "", `#${fields.join("&")}`);
  }
}
