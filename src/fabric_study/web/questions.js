// SPDX-License-Identifier: BSD-3-Clause
// Questionnaires: every answer is sent when given and shown as saved when the server has it on the
// disk. What could not be sent stays in the browser, also over a reload, and is sent again.

import { ask, el, Refusal } from "/common.js";

const TYPING = 500; // ms without a key after which typed answers are sent
const RETRY = 1000;
const STORE = "fabric-unsent";

/** Answers on their way, in the order given; the newest of each item counts. */
export class Outbox {
  constructor(changed) {
    this._changed = changed;
    this._waiting = new Map(JSON.parse(sessionStorage.getItem(STORE) ?? "[]"));
    this._busy = null;
    this.complaints = new Map(); // item: the server's sentence
    if (this._waiting.size) this.send();
  }

  put(person, step, item, value) {
    this.complaints.delete(item);
    this._waiting.delete(`${step} ${item}`);
    this._waiting.set(`${step} ${item}`, { person, step, item, value });
    this._keep();
    return this.send();
  }

  /** The value on its way for an item, undefined when there is none. */
  value(step, item) {
    return this._waiting.get(`${step} ${item}`)?.value;
  }

  /** Resolves when everything is with the server. */
  send() {
    this._busy ??= this._empty().finally(() => (this._busy = null));
    return this._busy;
  }

  async _empty() {
    while (this._waiting.size) {
      const [key, answer] = this._waiting.entries().next().value;
      try {
        await ask("answer", answer);
      } catch (error) {
        if (!(error instanceof Refusal) || error.status >= 500) {
          await new Promise((done) => setTimeout(done, RETRY));
          continue;
        }
        this.complaints.set(answer.item, error.message);
      }
      if (this._waiting.get(key) === answer) this._waiting.delete(key);
      this._keep();
    }
  }

  _keep() {
    sessionStorage.setItem(STORE, JSON.stringify([...this._waiting]));
    this._changed();
  }
}

/** The questions of one step, built once; `update` shows what is saved. */
export class Questions {
  constructor(questions, person, step, texts, language, outbox) {
    this._person = person;
    this._step = step;
    this._texts = texts;
    this._language = language;
    this._outbox = outbox;
    this._items = questions.items;
    this._states = new Map();
    this._typing = new Map();
    this.element = el("section", { class: "questions" },
      el("h1", {}, questions.title[language]),
      ...this._items.map((item, index) => this._question(item, index, questions.answers)));
    this.element.addEventListener("keydown", (event) => this._key(event));
    this.update(questions.answers);
  }

  /** Mark every item as open, on its way, saved or refused. */
  update(answers) {
    this._answers = answers;
    for (const item of this._items) {
      const [box, state] = this._states.get(item.id);
      const waiting = this._typing.has(item.id) || this._outbox.value(this._step.id, item.id) !== undefined;
      const complaint = this._outbox.complaints.get(item.id);
      const saved = !waiting && item.id in answers && answers[item.id] !== null;
      const text = complaint ?? (waiting ? this._texts.saving : saved ? `✓ ${this._texts.saved}` : "");
      if (state.textContent !== text) state.textContent = text;
      box.classList.toggle("refused", complaint !== undefined);
      box.classList.toggle("saved", saved);
      if (saved) box.classList.remove("missing");
    }
  }

  /** How many items have an answer, on its way or saved. */
  get answered() {
    const given = (item) => (this._outbox.value(this._step.id, item.id) ?? this._answers[item.id] ?? null) !== null;
    return this._items.filter(given).length;
  }

  get count() {
    return this._items.length;
  }

  /** Send what is still being typed. */
  async settle() {
    for (const send of [...this._typing.values()]) send();
    await this._outbox.send();
  }

  /** Point at the items without an answer. */
  mark(missing) {
    for (const item of this._items) this._states.get(item.id)[0].classList.toggle("missing", missing.includes(item.id));
    const first = this._items.find((item) => missing.includes(item.id));
    if (first) this._focus(first.id);
  }

  /** A digit without a field in focus: meant for the first open item. */
  first(event) {
    const item = this._items.find(({ id }) => (this._outbox.value(this._step.id, id) ?? this._answers[id] ?? null) === null);
    const box = item && this._states.get(item.id)[0];
    if (box?.matches("fieldset")) this._pick(box, event);
  }

  _focus(item) {
    const [box] = this._states.get(item);
    const field = box.querySelector("input:checked, input, textarea");
    field.focus({ preventScroll: true });
    box.scrollIntoView({ block: "center", behavior: "smooth" });
  }

  _question(item, index, answers) {
    const given = this._outbox.value(this._step.id, item.id) ?? answers[item.id] ?? null;
    const state = el("span", { class: "state", role: "status" });
    const typed = item.kind === "number" || item.kind === "text";
    const label = `${item.id}-text`;
    const text = el(typed ? "label" : "legend", { id: label, for: typed ? item.id : null },
      el("span", { class: "place number" }, `${index + 1}`), el("span", {}, item.text[this._language]));
    const field = { likert, tlx, pair: choice, choice, number, text: free }[item.kind];
    const answer = (value, later = false) => this._give(item, value, later);
    const box = el(typed ? "div" : "fieldset", { class: `question ${item.kind}`, data: { item: item.id } },
      text, field(item, given, answer, this._language, this._texts), state);
    this._states.set(item.id, [box, state]);
    return box;
  }

  _give(item, value, later) {
    const send = () => {
      clearTimeout(timer);
      this._typing.delete(item.id);
      this._outbox.put(this._person, this._step.id, item.id, value);
    };
    clearTimeout(this._typing.get(item.id)?.timer);
    const timer = later ? setTimeout(send, TYPING) : 0;
    if (!later) return send();
    send.timer = timer;
    this._typing.set(item.id, send);
    this.update(this._answers);
  }

  /** Digits pick: the nth choice, or the tens of a scale of 21 steps; then on to the next item. */
  _key(event) {
    const box = event.target.closest("fieldset.question");
    if (box && /^[0-9]$/.test(event.key) && !event.ctrlKey && !event.altKey && !event.metaKey) this._pick(box, event);
  }

  _pick(box, event) {
    const radios = [...box.querySelectorAll("input[type=radio]")];
    const scale = box.classList.contains("tlx");
    const radio = radios[scale ? 2 * Number(event.key) : Number(event.key) - 1];
    if (!radio) return;
    event.preventDefault();
    radio.click();
    radio.focus();
    const next = this._items[this._items.findIndex((item) => item.id === box.dataset.item) + 1];
    if (next && !scale) this._focus(next.id);
  }
}

function radio(item, value, given, answer, text, label) {
  const input = el("input", { type: "radio", name: item.id, value, "aria-label": label ?? null, onchange: () => answer(value) });
  input.checked = given === value;
  return el("label", { title: label ?? null }, input, el("span", { class: "mark" }), text === null ? null : el("span", { class: "words" }, text));
}

function likert(item, given, answer, language) {
  return el("div", { class: "scale" }, ...item.labels.map(([value, words]) => radio(item, value, given, answer, words[language])));
}

function choice(item, given, answer, language) {
  return el("div", { class: "choices" }, ...item.labels.map(([value, words]) => radio(item, value, given, answer, words[language])));
}

function tlx(item, given, answer, language) {
  const steps = [];
  for (let value = item.low; value <= item.high; value += item.step) steps.push(radio(item, value, given, answer, null, `${value}`));
  const [low, high] = item.labels;
  return el("div", { class: "ruler" }, el("div", { class: "steps" }, ...steps),
    el("div", { class: "ends quiet" }, el("span", {}, low[1][language]), el("span", {}, high[1][language])));
}

function number(item, given, answer, language, texts) {
  const input = el("input", { id: item.id, type: "number", inputmode: "decimal", min: item.low, max: item.high, step: "any", "aria-describedby": `${item.id}-range` });
  input.value = given ?? "";
  const value = () => (input.value === "" ? null : Number(input.value));
  input.addEventListener("input", () => answer(value(), true));
  return el("div", { class: "typed" }, input, el("span", { class: "quiet", id: `${item.id}-range` }, texts.number_range(item.low, item.high)));
}

function free(item, given, answer) {
  const input = el("textarea", { id: item.id, rows: 3, maxlength: item.high });
  input.value = given ?? "";
  input.addEventListener("input", () => answer(input.value.trim() === "" ? null : input.value, true));
  return input;
}
