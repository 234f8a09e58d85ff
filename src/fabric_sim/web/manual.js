// SPDX-License-Identifier: BSD-3-Clause
"use strict";

const at = (id) => document.getElementById(id);
const say = (id, text) => { if (at(id).textContent !== text) at(id).textContent = text; };
const plain = (word) => word.replaceAll("_", " ");
let trays = [];

function cube(colour) {
  const box = document.createElement("span");
  box.className = `cube ${colour}`;
  box.title = colour;
  box.setAttribute("role", "img");
  box.setAttribute("aria-label", `${colour} cube`);
  return box;
}

function put(id, colours) {
  const place = at(id), told = colours.join(" ");
  if (place.dataset.told === told) return;
  place.dataset.told = told;
  place.replaceChildren(...colours.map(cube));
}

function showRules(rules) {
  const told = JSON.stringify(rules);
  if (at("rules").dataset.told === told) return;
  at("rules").dataset.told = told;
  const same = new Set(rules.map((rule) => rule.tray)).size === 1;
  const items = (same ? rules.slice(0, 1) : rules).map((rule) => {
    const item = document.createElement("li");
    item.append(...(same ? ["everything into ", rule.tray] : ruleParts(rule)));
    return item;
  });
  if (items.length && !same && !rules[0].colour) items.unshift(turnsNote(rules[0]));
  at("rules").replaceChildren(...items);
}

function ruleParts(rule) {
  if (rule.word) return [colouredWord(rule)];
  if (!rule.colour) return [rule.tray];
  return [rule.occurrence ? `${rule.occurrence}. ` : "", cube(rule.colour), ` into ${rule.tray}`];
}

function colouredWord(rule) {
  const word = document.createElement("b");
  word.className = `ink ${rule.ink}`;
  word.title = `${rule.word} in ${rule.ink}`;
  word.textContent = rule.word;
  return word;
}

function turnsNote(rule) {
  const note = document.createElement("li");
  const counts = rule.word ? `, the ${rule.ink_counts ? "ink" : "word"} counts` : "";
  note.textContent = `one cube after the other, again and again${counts}:`;
  return note;
}

function showTrays(names) {
  if (names.join() === trays.join()) return;
  trays = names;
  at("trays").hidden = names.length < 2;  // the only tray needs no choice
  at("trays").replaceChildren(...names.map((name, i) => {
    const button = document.createElement("button"), key = document.createElement("kbd");
    button.type = "button";
    button.dataset.name = "place";
    button.dataset.container = name;
    key.textContent = String(i + 1);
    button.append(`Place: ${name} `, key);
    button.addEventListener("click", () => command("place", name));
    return button;
  }));
}

function fits(name, news) {
  if (news.waiting) return name === "begin";
  if (news.task.status !== "running") return false;
  if (news.person.away) return name === "come_back";
  if (news.person.action === "walk_away") return false;
  const grasping = news.person.action === "grasp";
  switch (name) {
    case "begin": case "come_back": return false;
    case "place": return grasping;
    case "drop": return grasping;
    case "grasp": return !grasping && news.cubes.pick_point.length > 0;
    default: return news.cubes.person.length === 0;
  }
}

function show(news) {
  const task = news.task, person = news.person;
  say("connection", "connected");
  say("task-name", task.number ? `${task.number}: ${task.scenario}` : "-");
  say("task-status", news.waiting ? "press begin: time stands until you do" : task.status);
  say("task-time", task.number && !news.waiting ? `${task.seconds.toFixed(0)} s` : "");
  say("task-score", `${task.by_person} by you, ${task.by_robot} by the robot, ${task.failed} failed of ${task.total}; ` +
    `${task.warnings} warnings; score ${task.score}`);
  showRules(task.rules);
  showTrays(news.trays);
  say("robot-action", news.robot);
  at("robot-action").classList.toggle("acts", news.robot.startsWith("takes over"));
  put("robot-cubes", news.cubes.robot);
  say("you-action", person.away ? "away" : plain(person.action) || "-");
  put("you-cubes", news.cubes.person);
  say("you-state", person.state ? `state: ${plain(person.state)}; in the robot's words: ${plain(person.for_the_robot)}` : "");
  put("belt-cubes", [...news.cubes.belt].reverse());
  put("pick-point", news.cubes.pick_point);
  for (const button of document.querySelectorAll("button")) {
    const name = button.dataset.name, good = fits(name, news);
    button.classList.toggle("fits", good);
    button.classList.toggle("faint", !good);
    button.classList.toggle("call", good && name === "begin");
  }
}

async function command(name, container = "") {
  try {
    const answer = await fetch("command", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ name, container }),
    });
    const told = answer.ok ? await answer.json() : { accepted: false, reason: await answer.text() };
    say("answer", told.accepted ? "" : told.reason);
  } catch (error) {
    say("answer", "nobody answers; has the simulation ended?");
  }
}

for (const button of document.querySelectorAll("button")) {
  button.addEventListener("click", () => command(button.dataset.name));
}

document.addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  const key = event.key.toLowerCase();
  const button = document.querySelector(`button[data-key="${CSS.escape(key)}"]`);
  const tray = trays[Number(key) - 1];
  if (!button && !tray) return;
  event.preventDefault();
  if (button) command(button.dataset.name);
  else command("place", tray);
});

const events = new EventSource("events");
events.onmessage = (message) => show(JSON.parse(message.data));
events.onerror = () => say("connection", "no connection: the simulation has ended or is out of reach");
