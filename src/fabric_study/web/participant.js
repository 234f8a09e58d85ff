// SPDX-License-Identifier: BSD-3-Clause
// The participant's screen: shows where the visit is, sends answers and confirmations.

import { ask, el, follow, Refusal } from "/common.js";
import { Outbox, Questions } from "/questions.js";
import { allowSound, beep, hasSound, taskScreen } from "/task.js";
import { TEXTS } from "/texts.js";

const LANGUAGE = "fabric-language";
const find = (id) => document.getElementById(id);
const screen = find("screen");

let state = {}; // sections as the server tells them
let connected = false;
let language = "en";
let questions = null; // of the step that is shown
let shown = ""; // what the screen was built for
let placed = null; // placements told by a beep; null before the first message
let skipping = false; // the next Continue leaves questions out
let told = false; // the hint is about what went wrong, not about the count
let busy = false;
const outbox = new Outbox(() => questions?.update(state.questions?.answers ?? {}) ?? footer());

follow("participant", (sections, news) => {
  state = sections;
  if (!("visit" in news) && !("step" in news) && !("questions" in news) && !("task" in news)) return;
  chooseLanguage();
  sound();
  render();
}, (now) => {
  connected = now;
  cover();
  if (now) outbox.send();
});

function chooseLanguage() {
  const visit = state.visit?.person ?? "";
  const [person, chosen] = (sessionStorage.getItem(LANGUAGE) ?? " ").split(" ");
  language = person === visit && chosen in TEXTS ? chosen : (state.visit?.language ?? "en");
  document.documentElement.lang = language;
}

for (const button of document.querySelectorAll("[data-language]")) {
  button.addEventListener("click", () => {
    sessionStorage.setItem(LANGUAGE, `${state.visit?.person ?? ""} ${button.dataset.language}`);
    chooseLanguage();
    shown = "";
    render();
  });
}

/** One beep for each placement that is new since the last message. */
function sound() {
  const count = state.task?.placements?.length ?? 0;
  if (placed !== null && count > placed) beep();
  placed = count;
}

find("sound").addEventListener("click", () => allowSound().then(() => {
  beep();
  header();
}));

function render() {
  const texts = TEXTS[language];
  const { visit, step, task } = state;
  const open = visit && visit.status === "running" && step;
  const key = JSON.stringify([language, visit?.person, visit?.status, open && step.id, open && step.kind === "task" && task]);
  if (key !== shown) {
    const moved = screen.dataset.step !== (open ? step.id : "") || !questions;
    shown = key;
    questions = null;
    screen.dataset.step = open ? step.id : "";
    screen.dataset.kind = open ? step.kind : "message";
    screen.replaceChildren(open ? stepScreen(texts) : message(texts));
    skipping = told = busy = false; // what is still on its way was for the screen before
    if (moved) {
      window.scrollTo(0, 0);
      document.activeElement?.blur();
    }
  } else {
    questions?.update(state.questions?.answers ?? {});
  }
  header();
  footer();
  cover();
}

function stepScreen(texts) {
  const { step, task } = state;
  if (step.kind === "instrument") {
    questions = new Questions(state.questions, state.visit.person, step, texts, language, outbox);
    return questions.element;
  }
  return step.kind === "task" ? taskScreen(task, step, texts) : page(step.text[language]);
}

/** A text: blank lines part it, "# " begins a title, lines with "- " are a list. */
function page(text) {
  const blocks = text.trim().split(/\n\s*\n/).map((part) => {
    const lines = part.split("\n").map((line) => line.trim());
    if (lines[0].startsWith("# ")) return el("h1", {}, lines.join(" ").slice(2));
    if (!lines.every((line) => line.startsWith("- "))) return el("p", {}, lines.join(" "));
    return el("ul", {}, ...lines.map((line) => el("li", {}, line.slice(2))));
  });
  return el("section", { class: "text" }, ...blocks);
}

function message(texts) {
  const status = state.visit?.status;
  const key = { finished: "closed", aborted: "aborted" }[status] ?? "welcome";
  return el("section", { class: "message" }, el("h1", {}, texts[key]), el("p", {}, texts[`${key}_text`]));
}

function header() {
  const texts = TEXTS[language];
  const { visit, step } = state;
  const open = visit && visit.status === "running" && step;
  find("progress").hidden = !open;
  if (open) {
    find("progress-words").textContent = texts.progress(step.at, step.of);
    find("progress-bar").max = step.of;
    find("progress-bar").value = step.at;
  }
  const button = find("sound");
  button.textContent = hasSound() ? `♪ ${texts.sound_on}` : `♪ ${texts.sound_allow}`;
  button.classList.toggle("primary", !hasSound());
  for (const choice of document.querySelectorAll("[data-language]")) {
    choice.setAttribute("aria-pressed", choice.dataset.language === language);
  }
}

function footer() {
  const texts = TEXTS[language];
  const { visit, step, task } = state;
  const open = visit && visit.status === "running" && step;
  const idle = open && (step.kind !== "task" || task.phase === "ready" || task.phase === "ended");
  find("footer").hidden = !idle;
  if (!idle) return;
  const button = find("continue");
  button.textContent = step.kind === "task" && task.phase === "ready" ? texts.begin : texts.go_on;
  button.disabled = busy || (step.kind === "task" && task.phase === "ended" && !task.result.saved);
  if (!told) hint(questions ? texts.answered(questions.answered, questions.count) : "");
}

function hint(text, loud = false) {
  told = loud;
  const place = find("hint");
  if (place.textContent !== text) place.textContent = text;
  place.classList.toggle("loud", loud);
}

function cover() {
  const texts = TEXTS[language];
  const reason = !connected ? "lost" : state.visit?.paused ? "paused" : null;
  find("cover").hidden = reason === null;
  screen.inert = find("footer").inert = reason !== null; // rules are not shown any longer either
  screen.classList.toggle("covered", reason !== null);
  if (reason === null) return;
  find("cover").className = reason;
  find("cover-title").textContent = texts[reason];
  find("cover-text").textContent = texts[`${reason}_text`];
}

async function go() {
  const { step, task } = state;
  if (busy || find("footer").hidden || find("continue").disabled || screen.inert) return;
  busy = true;
  footer();
  try {
    await questions?.settle();
    if (step.kind === "task" && task.phase === "ready") await ask("ready", { step: step.id });
    else await finish(step);
  } catch (error) {
    hint(error instanceof Refusal ? `${TEXTS[language].failed} ${error.message}` : TEXTS[language].lost, true);
  }
  busy = false;
  footer();
}

async function finish(step) {
  const { missing } = await ask("finish_step", { step: step.id, accept_missing: skipping });
  if (!missing.length) return;
  skipping = true;
  questions?.mark(missing);
  hint(TEXTS[language].missing(missing.length), true);
}

find("continue").addEventListener("click", go);
screen.addEventListener("change", () => (skipping = told = false));
document.addEventListener("keydown", (event) => {
  if (event.key === "Enter" && !event.target.closest("button, textarea")) go();
  else if (/^[1-9]$/.test(event.key) && event.target === document.body) questions?.first(event);
});

chooseLanguage();
header();
