// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html, setPressed } from "./dom.ts";
import * as format from "./format.ts";
import { Judgements, kSays, type Says } from "./judgements.ts";
import type { RunModel } from "./run_model.ts";
import { saveText } from "./save.ts";
import type { Store } from "./store.ts";

/** Lets a person judge pairs one after the other, and saves the result as truth. */
export class Review {
  readonly element: HTMLElement;
  private readonly choices = new Map<Says, HTMLButtonElement>();
  private readonly count = html("span", { class: "small", "data-key": "review.count" });
  private readonly files = html("span", { class: "save" });
  private readonly ofRuns = new Map<RunModel, Judgements>();

  constructor(private readonly store: Store) {
    for (const says of kSays) {
      this.choices.set(
        says,
        button({ title: `${says} (${says[0]})` }, () => this.judge(says), says),
      );
    }
    this.files.append(
      button(
        { title: "True places, for loopbit eval --truth" },
        () => this.save("truth"),
        "truth.csv",
      ),
      button(
        { title: "Matches that are not wrong, for loopbit eval --not-false" },
        () => this.save("notFalse"),
        "not_false.csv",
      ),
    );
    this.element = html(
      "div",
      { class: "review", role: "group", "aria-label": "Your judgement of this match" },
      html("span", {}, "your judgement"),
      ...this.choices.values(),
      this.count,
      this.files,
    );
  }

  /** Judges the shown match and goes on; the same judgement again takes it back. */
  judge(says: Says): void {
    const { frame } = this.store.now;
    if (this.store.model.match(frame) === null) return;
    const judgements = this.judgements();
    const isAgain = judgements.of(frame) === says;
    judgements.judge(frame, isAgain ? null : says);
    if (!isAgain) this.store.walk(1);
    this.show();
  }

  show(): void {
    const { frame } = this.store.now;
    const judgements = this.judgements();
    const said = judgements.of(frame);
    for (const [says, made] of this.choices) {
      setPressed(made, says === said);
      made.disabled = this.store.model.match(frame) === null;
    }
    this.count.textContent = `${format.count(judgements.count)} judged`;
    this.files.hidden = judgements.count === 0;
  }

  private judgements(): Judgements {
    const { model } = this.store;
    const known = this.ofRuns.get(model) ?? new Judgements(model);
    this.ofRuns.set(model, known);
    return known;
  }

  private save(which: "truth" | "notFalse"): void {
    const name = which === "truth" ? "truth.csv" : "not_false.csv";
    saveText(name, this.judgements().files()[which]);
  }
}
