// SPDX-License-Identifier: BSD-3-Clause
// A task on the participant's screen: rules that vanish, live placements without right or wrong,
// a beep for each cube, the result.

import { ask, el } from "/common.js";

const BEEP = { frequency: 880, duration: 0.22, volume: 0.35 };
let audio = null;

/** Whether a beep would be heard. */
export const hasSound = () => audio !== null && audio.state === "running";

/** Allow sound; browsers want a click or a key for it. */
export async function allowSound() {
  audio ??= new AudioContext();
  await audio.resume();
}

/** The sound that a placement was processed, for every placement the same. */
export function beep() {
  const page = document.documentElement.dataset;
  page.beeps = Number(page.beeps ?? 0) + 1;
  if (!hasSound()) return;
  const now = audio.currentTime;
  const tone = new OscillatorNode(audio, { frequency: BEEP.frequency });
  const gain = new GainNode(audio, { gain: 0 });
  gain.gain.linearRampToValueAtTime(BEEP.volume, now + 0.01);
  gain.gain.setValueAtTime(BEEP.volume, now + BEEP.duration - 0.03);
  gain.gain.linearRampToValueAtTime(0, now + BEEP.duration);
  tone.connect(gain).connect(audio.destination);
  tone.start(now);
  tone.stop(now + BEEP.duration);
}

const cube = (colour) => el("span", { class: `cube ${colour}` });

/** What a phase of the task looks like. */
export function taskScreen(task, step, texts) {
  const shown = { ready, waiting, rules, running, ended }[task.phase];
  const title = step.practice ? texts.practice : texts.task(step.task, step.tasks);
  return el("section", { class: `task ${task.phase}` }, ...shown(task, step, texts, title));
}

function ready(task, step, texts, title) {
  return [
    el("h1", {}, title),
    task.stopped ? el("p", { class: "notice" }, texts.task_stopped) : null,
    el("p", {}, texts.task_ready),
    el("p", {}, texts.task_beep),
  ];
}

function waiting(task, step, texts, title) {
  return [el("h1", {}, title), el("p", {}, texts.task_wait)];
}

function rules(task, step, texts) {
  const [first] = task.items;
  const title = first.word === "" ? texts.rules : first.ink_counts ? texts.rules_ink : texts.rules_word;
  const ordered = task.items.length > 1 && task.items.every((item) => item.colour === "");
  return [
    el("h1", {}, title),
    el("ol", { class: ordered ? "rules sequence" : "rules" },
      ...task.items.map((item, index) => rule(item, ordered ? index + 1 : 0, texts))),
    ordered ? el("p", { class: "quiet" }, texts.in_order) : null,
  ];
}

function rule(item, place, texts) {
  const many = texts.cube_of[item.occurrence ? "nth" : "each"];
  return el("li", {},
    place ? el("span", { class: "place number" }, `${place}`) : null,
    item.colour ? el("span", { class: "what" }, cube(item.colour), many(texts.cube[item.colour], item.occurrence)) : null,
    item.colour ? el("span", { class: "arrow", "aria-label": texts.into }, "→") : null,
    item.word ? el("span", { class: `word ink-${item.ink}` }, texts.colour_word[item.word]) : tray(item.container, texts));
}

const tray = (container, texts) => el("span", { class: `tray ${container}` }, texts.container[container] ?? container);

function running(task, step, texts) {
  const call = el("button", { type: "button", id: "call", onclick: () => ask("call").then(() => (call.textContent = texts.called)) }, texts.call);
  return [
    el("div", { class: "row" },
      el("h1", { role: "status" }, task.placements.length ? texts.placed(task.placements.length, task.total) : texts.running),
      task.can_call ? call : null),
    task.placements.length ? null : el("p", { class: "quiet" }, texts.placed_none),
    el("ol", { class: task.total > 10 ? "placements many" : "placements" }, ...task.placements.map((placement) => placed(placement, texts))),
  ];
}

function placed(placement, texts) {
  return el("li", {},
    el("span", { class: "place number" }, `${placement.number}`),
    el("span", { class: "what" }, cube(placement.colour), texts.cube[placement.colour] ?? texts.cube[""]),
    el("span", { class: "arrow", "aria-label": texts.into }, "→"),
    placement.by === "nobody" ? el("span", {}, texts.nobody) : tray(placement.container, texts),
    el("span", { class: "quiet" }, placement.by === "nobody" ? "" : texts[`by_${placement.by}`]));
}

function ended(task, step, texts) {
  const result = task.result;
  const figure = (value, label) => el("div", { class: "figure" }, el("dd", { class: "number" }, value), el("dt", {}, label));
  return [
    el("h1", {}, step.practice ? texts.result_practice : texts.result),
    el("dl", { class: "figures" },
      figure(`${Math.round(100 * result.success_rate)} %`, texts.success_rate),
      figure(clock(result.duration), texts.duration),
      figure(`${result.score}`, texts.score)),
    result.saved ? null : el("p", { class: "quiet" }, texts.result_wait),
  ];
}

/** Seconds as minutes:seconds. */
function clock(seconds) {
  const whole = Math.round(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}
