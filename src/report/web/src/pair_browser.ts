// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html, renew, setPressed } from "./dom.ts";
import { Filters } from "./filters.ts";
import * as format from "./format.ts";
import { PairContents } from "./pair_contents.ts";
import { pairFacts } from "./pair_facts.ts";
import { PairPictures } from "./pair_pictures.ts";
import { candidateName } from "./partner.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import type { View } from "./view.ts";

/** The selected frame beside its partner, with the evidence of the decision. */
export class PairBrowser implements View {
  readonly element: HTMLElement;
  private readonly filters: Filters;
  private readonly number = html("input", {
    id: "frame-number",
    type: "text",
    inputmode: "numeric",
    autocomplete: "off",
    "aria-label": "Frame number",
    maxlength: 9,
  });
  private readonly position = html("span", { class: "position", "aria-live": "polite" });
  private readonly partners = html("div", { class: "partners", role: "group" });
  private readonly pictures = new PairPictures();
  private readonly contents = new PairContents();
  private readonly facts = html("div", { class: "pair-facts" });
  private readonly lines: HTMLButtonElement;
  private withLines = true;

  constructor(private readonly store: Store) {
    this.filters = new Filters(store);
    this.lines = button({ class: "quiet" }, () => this.toggleLines(), "inlier lines");
    this.partners.setAttribute("aria-label", "Shown beside the query");
    this.number.addEventListener("change", () => this.goToNumber());
    this.element = html(
      "section",
      { id: "pair", "aria-labelledby": "pair-title" },
      html("h2", { id: "pair-title", class: "visually-hidden" }, "Query and match"),
      this.filters.element,
      html(
        "div",
        { class: "walk" },
        button(
          { "aria-label": "Previous frame", title: "Previous (←)" },
          () => store.walk(-1),
          "←",
        ),
        html("label", { for: "frame-number" }, "frame"),
        this.number,
        button({ "aria-label": "Next frame", title: "Next (→)" }, () => store.walk(1), "→"),
        this.position,
        this.lines,
      ),
      this.partners,
      this.pictures.element,
      this.facts,
      this.contents.element,
    );
  }

  showRun(model: RunModel): void {
    this.filters.showRun(model);
  }

  showSelection(selection: Selection): void {
    const model = this.store.model;
    this.filters.showSelection(selection);
    this.number.value = String(selection.frame);
    this.showPosition(model, selection);
    this.showPartners(model, selection);
    setPressed(this.lines, this.withLines);
    this.facts.replaceChildren(...pairFacts(model, selection));
    this.contents.show(model, selection);
    void this.pictures.show(model, selection, this.withLines);
  }

  private showPosition(model: RunModel, { frame, filter }: Selection): void {
    const frames = model.framesIn(filter);
    const at = frames.indexOf(frame);
    const all = format.count(frames.length);
    this.position.textContent = at < 0 ? `${all} ${filter}` : `${format.count(at + 1)} of ${all}`;
  }

  /** The buttons that choose the frame beside the query, if there is a choice. */
  private showPartners(model: RunModel, { frame, against }: Selection): void {
    const choices: HTMLButtonElement[] = [];
    const add = (name: string, to: Selection["against"]) => {
      const made = button({}, () => this.store.change({ against: to }), name);
      setPressed(made, against === to);
      choices.push(made);
    };
    const truth = model.truePlace(frame);
    const verdict = model.verdict(frame);
    const isChoice = verdict === "missed" || verdict === "wrong" || against !== "match";
    if (isChoice) {
      add(candidateName(model, frame), "match");
      if (truth !== null && truth !== model.match(frame)) add(`true place ${truth}`, "truth");
      if (typeof against === "number") add(`frame ${against}`, against);
    }
    renew(this.partners, choices);
    this.partners.hidden = choices.length < 2;
  }

  private toggleLines(): void {
    this.withLines = !this.withLines;
    this.showSelection(this.store.now);
  }

  private goToNumber(): void {
    const text = this.number.value.trim();
    if (/^\d+$/.test(text)) this.store.select(Number(text));
    this.number.value = String(this.store.now.frame);
  }
}
