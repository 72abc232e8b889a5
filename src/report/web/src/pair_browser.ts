// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html, renew, setPressed } from "./dom.ts";
import { Filters } from "./filters.ts";
import * as format from "./format.ts";
import { PairContents } from "./pair_contents.ts";
import { pairFacts } from "./pair_facts.ts";
import { PairPictures } from "./pair_pictures.ts";
import { candidateName } from "./partner.ts";
import { Player } from "./player.ts";
import { Review } from "./review.ts";
import type { RunModel } from "./run_model.ts";
import { saveButtons } from "./save.ts";
import type { Selection, Store } from "./store.ts";
import type { View } from "./view.ts";

/** The selected frame beside its partner, with the evidence of the decision. */
export class PairBrowser implements View {
  readonly element: HTMLElement;
  private readonly filters: Filters;
  private readonly number = html("input", {
    id: "frame-number",
    type: "text",
    autocomplete: "off",
    "aria-label": "Frame number, name of an image, or time",
    title: "A frame number, a name or part of one, or seconds: 12.5 s",
  });
  private readonly position = html("span", { class: "position", "aria-live": "polite" });
  private readonly partners = html("div", { class: "partners", role: "group" });
  private readonly pictures = new PairPictures();
  private readonly contents = new PairContents();
  private readonly facts = html("div", { class: "pair-facts" });
  private readonly lines: HTMLButtonElement;
  private readonly epipolar: HTMLButtonElement;
  private readonly order: HTMLButtonElement;
  private readonly enlarged: HTMLDialogElement;
  readonly player: Player;
  readonly review: Review;
  private shownLines: "inliers" | "epipolar" | null = "inliers";

  constructor(private readonly store: Store) {
    this.filters = new Filters(store);
    this.player = new Player(store);
    this.review = new Review(store);
    this.lines = button({ class: "quiet" }, () => this.toggle("inliers"), "inlier lines");
    const where = "Points of the query, and where the match may see them by the relative pose";
    this.epipolar = button(
      { class: "quiet", title: where },
      () => this.toggle("epipolar"),
      "epipolar lines",
    );
    const weakest = "Visit loops by rising score, the weakest first";
    this.order = button(
      { class: "quiet", title: weakest },
      () => store.toggleOrder(),
      "weakest first",
    );
    this.enlarged = this.dialog();
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
        this.order,
        this.player.button,
      ),
      this.partners,
      this.pictures.element,
      html(
        "div",
        { class: "pair-tools" },
        this.lines,
        this.epipolar,
        button({ class: "quiet", title: "Enlarge (e)" }, () => this.enlarge(), "enlarge"),
        saveButtons("Query and match", () => this.pictures.figure()),
      ),
      this.facts,
      this.review.element,
      this.contents.element,
      this.enlarged,
    );
  }

  showRun(model: RunModel): void {
    this.filters.showRun(model);
  }

  showSelection(selection: Selection): void {
    const model = this.store.model;
    this.filters.showSelection(selection);
    this.number.value = String(selection.frame);
    this.showPosition(selection);
    this.showPartners(model, selection);
    setPressed(this.lines, this.shownLines === "inliers");
    setPressed(this.epipolar, this.shownLines === "epipolar");
    this.epipolar.hidden = model.run.poses === null;
    setPressed(this.order, selection.order === "weakest");
    this.review.show();
    this.facts.replaceChildren(...pairFacts(model, selection));
    this.contents.show(model, selection);
    void this.pictures.show(model, selection, this.shownLines);
  }

  /** Shows the pictures as large as the window, or back in their place. */
  enlarge(): void {
    if (this.enlarged.open) {
      this.enlarged.close();
      return;
    }
    this.enlarged.prepend(this.pictures.element);
    this.enlarged.showModal();
  }

  private dialog(): HTMLDialogElement {
    const made = html(
      "dialog",
      { id: "enlarged", "aria-label": "Query and match, enlarged" },
      button({}, () => made.close(), "Close"),
    );
    made.addEventListener("close", () => this.partners.after(this.pictures.element));
    this.pictures.element.addEventListener("click", () => this.enlarge());
    return made;
  }

  private showPosition({ frame, filter }: Selection): void {
    const frames = this.store.frames();
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

  private toggle(lines: "inliers" | "epipolar"): void {
    this.shownLines = this.shownLines === lines ? null : lines;
    this.showSelection(this.store.now);
  }

  private goToNumber(): void {
    const text = this.number.value.trim();
    const frame = text === "" ? null : this.store.model.find(text, this.store.now.frame);
    if (frame !== null) this.store.select(frame);
    else if (text !== "") this.position.textContent = `no frame '${text}'`;
    this.number.value = String(this.store.now.frame);
  }
}
