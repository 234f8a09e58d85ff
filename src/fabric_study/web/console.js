// SPDX-License-Identifier: BSD-3-Clause
// The experimenter's console: what the study, the robot and the sensors do, and the levers.

import { ask, el, follow } from "/common.js";

const find = (id) => document.getElementById(id);
const OLD = 1.0; // s without a heartbeat after which a node counts as silent
const BARS = 5; // candidates and types that are shown
let state = {};

follow("console", (sections, news) => {
  state = sections;
  for (const name of Object.keys(news)) SHOW[name]?.(sections[name]);
  levers();
}, (connected) => {
  const chip = find("connection");
  chip.textContent = connected ? "connected" : "connection lost, reconnecting";
  chip.className = `chip ${connected ? "good" : "bad"}`;
  document.body.classList.toggle("stale", !connected);
});

const SHOW = {
  study(study) {
    document.title = `FABRIC console: ${study.title.en}`;
    find("title").textContent = study.title.en;
    find("subtitle").textContent = `${study.protocol}${study.simulated ? ", simulated cell: labelled as such in the record" : ""}`;
    find("participant").textContent = study.pages ? "participant’s page open" : "no participant’s page";
    find("participant").className = `chip ${study.pages ? "good" : "warn"}`;
    find("address").textContent = study.participant_url;
    if (find("index").value === "") find("index").value = study.next_index;
    preview();
    find("open-visits").replaceChildren(...study.open_visits.map((visit) => el("p", { class: "open-visit" },
      el("span", {}, el("strong", {}, visit.person), ` step ${visit.at} of ${visit.of}`),
      el("button", { type: "button", data: { person: visit.person }, onclick: () => run("continue_visit", { person: visit.person, language: visit.language }) }, "Continue"))));
  },

  visit(visit) {
    find("visit-card").hidden = visit === null;
    if (visit === null) return;
    find("person").textContent = visit.person;
    const status = visit.status === "running" && visit.paused ? "paused" : visit.status;
    find("visit-status").textContent = status;
    find("visit-status").className = `chip ${{ running: "good", paused: "warn", aborted: "bad" }[status] ?? ""}`;
    find("conditions").textContent = `order ${visit.index}: ${visit.conditions.join(", ")}`;
    const rows = visit.steps.map((step, at) => {
      const now = at === visit.at && visit.status === "running";
      return el("li", { class: now ? "now" : at < visit.at ? "done" : "", "aria-current": now ? "step" : null },
        el("span", { class: "number" }, at < visit.at ? "✓" : `${at + 1}`),
        el("span", {}, step.name), el("span", { class: "quiet" }, step.about));
    });
    find("steps").replaceChildren(...rows);
    const now = rows.find((row) => row.className === "now");
    if (now) find("steps").scrollTop = now.offsetTop - find("steps").offsetTop - 60;
  },

  task(task) {
    const chip = find("task-phase");
    chip.hidden = task === null;
    find("task-name").textContent = task ? task.name : "none";
    find("task-facts").textContent = task ? task.facts : "The next step of the visit is no task.";
    find("cubes").hidden = !task;
    find("cubes").replaceChildren("cubes on the belt, the first on the left: ",
      ...(task?.cubes ?? []).map((colour) => el("span", { class: `cube ${colour}`, title: colour })));
    find("task-problem").hidden = !task?.problem;
    find("task-problem").textContent = task?.problem ?? "";
    chip.textContent = task ? { ready: task.said_ready ? "participant is ready" : "waits for the participant", waiting: "starting", rules: "shows rules", running: "running", ended: "ended" }[task.phase] : "";
    chip.className = `chip ${{ running: "good", rules: "good", ready: task?.said_ready ? "good" : "", waiting: "warn" }[task?.phase] ?? ""}`;
    find("events").replaceChildren(...(task?.events ?? []).map((event) => el("li", {},
      el("span", { class: "number quiet" }, `${event.at.toFixed(1)} s`),
      event.colour ? el("span", { class: `cube ${event.colour}` }) : el("span", {}),
      el("span", {}, event.what),
      el("span", { class: `number ${event.score < 0 ? "wrong" : "right"}` }, event.score ? `${event.score > 0 ? "+" : "−"}${Math.abs(event.score)}` : ""))));
    find("events").scrollTop = find("events").scrollHeight;
  },

  notes(notes) {
    find("notes").replaceChildren(...notes.map((note) => el("li", {}, el("time", { class: "number quiet" }, new Date(1000 * note.stamp).toLocaleTimeString("en-GB")), el("span", {}, note.text))));
  },

  belief(belief) {
    find("belief-model").textContent = belief?.model ?? "";
    bars("belief", belief?.states ?? [], 1, (p) => `${Math.round(100 * p)} %`, "No decision in this task yet.");
  },

  decisions(decisions) {
    const figure = (value, digits) => (value === null ? "–" : value.toFixed(digits));
    find("decisions").tBodies[0].replaceChildren(...decisions.map((decision) => el("tr", {},
      el("td", { class: "number quiet" }, `${decision.sequence}`), el("td", {}, decision.action),
      el("td", { class: "number" }, figure(decision.value, 2)), el("td", { class: "number" }, figure(decision.gap, 2)),
      el("td", { class: "number" }, `${figure(decision.planning_ms, 0)} ms`), el("td", { class: "wrong" }, decision.flags.join(", ")))));
  },

  robot(robot) {
    find("robot").textContent = robot ? `robot: ${robot.action}, ${robot.phase}${robot.holding ? ", holds a cube" : ""}` : "";
  },

  policy(policy) {
    find("policy").textContent = policy.model || "–";
    find("unlike").hidden = !policy.unlike_anyone_known;
    find("policy-reason").textContent = policy.chosen ? `ABPS: ${policy.chosen}. ${policy.reason}` : "ABPS has not chosen.";
    const scores = policy.candidates.slice(0, BARS);
    bars("candidates", scores, Math.max(...scores.map(([, score]) => score ?? 0), 1e-9), (score) => score.toFixed(3), "");
  },

  types(types) {
    find("entropy").textContent = types ? `entropy ${types.entropy?.toFixed(2) ?? "–"} nats` : "";
    bars("types", (types?.types ?? []).slice(0, BARS), 1, (p) => `${Math.round(100 * p)} %`, "No belief yet.");
  },

  safety(safety) {
    const stale = safety && safety.age > OLD;
    const chip = find("safety-chip");
    chip.textContent = safety ? `safety: ${stale ? "no word" : safety.state}` : "safety: no word";
    chip.className = `chip ${!safety || stale || safety.state === "stop" ? "bad" : safety.state === "slow" ? "warn" : "good"}`;
    find("safety").textContent = safety ? `${safety.state.toUpperCase()}${safety.cause ? `: ${safety.cause}` : ""}` : "The motion node has not spoken.";
    const watched = (safety?.watched ?? []).map(([name, age]) => `${name} ${age?.toFixed(1) ?? "–"} s`).join(", ");
    const apart = safety?.separation === null || safety === null ? "" : `hand to arm ${safety.separation.toFixed(2)} m`;
    find("separation").textContent = [watched && `watches ${watched}`, apart].filter(Boolean).join("; ");
  },

  health(health) {
    find("nodes").replaceChildren(...health.nodes.map(([name, age]) => el("li", { class: age === null || age > OLD ? "silent" : "" },
      el("span", {}, name), el("span", { class: "number" }, age === null ? "never" : age.toFixed(1)))));
    find("missing").replaceChildren(...health.missing.map((sentence) => el("li", {}, sentence)));
  },
};

/** Named values as bars; `most` fills one. */
function bars(id, pairs, most, words, empty) {
  if (!pairs.length) return find(id).replaceChildren(empty ? el("p", { class: "quiet" }, empty) : "");
  find(id).replaceChildren(...pairs.flatMap(([name, value]) => {
    const filled = el("i");
    filled.style.width = `${(100 * Math.min(Math.max(value ?? 0, 0), most)) / most}%`;
    return [
      el("span", { class: "name" }, name.replaceAll("_", " ")),
      el("span", { class: "bar" }, filled),
      el("span", { class: "number" }, value === null ? "–" : words(value)),
    ];
  }));
}

function preview() {
  const order = state.study?.orders[Number(find("index").value)];
  find("order-preview").textContent = order ? order.join(", ") : "beyond the people that are planned";
}

/** Which levers can be used now. */
function levers() {
  const { visit, task, study } = state;
  const open = visit !== null && visit?.status === "running";
  const working = open && task && ["waiting", "rules", "running"].includes(task.phase);
  find("start-card").hidden = open;
  find("pause").hidden = open && visit.paused;
  find("resume").hidden = !open || !visit.paused;
  find("pause").disabled = find("abort-visit").disabled = !open;
  find("begin-task").disabled = !open || visit.paused || task?.phase !== "ready";
  find("abort-task").disabled = !working && !(open && task?.phase === "ended" && !task.result.saved);
  find("call").hidden = !task?.can_call;
  find("auto-start").checked = study?.auto_start ?? false;
}

/** Ask the server; what it refuses is shown until the next request. */
async function run(name, fields = {}) {
  const alert = find("alert");
  alert.hidden = true;
  try {
    await ask(name, fields);
    return true;
  } catch (error) {
    alert.textContent = error.message;
    alert.hidden = false;
    return false;
  }
}

let decide = () => {}; // takes the answer to the question that is open

/** A question before something that cannot be taken back; the reason given, or null. */
function confirmed(title, text, yes, wantsReason = true) {
  decide(null);
  find("dialog-title").textContent = title;
  find("dialog-text").textContent = text;
  find("dialog-yes").textContent = yes;
  find("dialog-label").hidden = !wantsReason;
  find("dialog-reason").required = wantsReason;
  find("dialog-reason").value = "";
  find("dialog").show(); // not modal: the stop button stays within reach
  return new Promise((done) => {
    decide = (reason) => {
      decide = () => {};
      find("dialog").close();
      done(reason);
    };
  });
}
find("dialog").addEventListener("submit", (event) => {
  event.preventDefault();
  decide(event.submitter.value === "yes" ? find("dialog-reason").value.trim() : null);
});
find("dialog").addEventListener("keydown", (event) => event.key === "Escape" && decide(null));

const on = (id, event, action) => find(id).addEventListener(event, action);
on("stop", "click", () => run("stop"));
on("release", "click", async () => {
  const sure = await confirmed("Release the robot?", "Robot and belt go on at once. Nobody may reach into the cell.", "Release", false);
  if (sure !== null) run("release");
});
on("start-form", "submit", async (event) => {
  event.preventDefault();
  if (await run("open_visit", { index: Number(find("index").value), language: find("language").value })) find("index").value = "";
});
on("index", "input", preview);
on("copy", "click", () => navigator.clipboard.writeText(find("address").textContent));
on("pause", "click", () => run("pause"));
on("resume", "click", () => run("resume"));
on("abort-visit", "click", async () => {
  const reason = await confirmed("Abort the visit?", "What was recorded is kept; the visit cannot be continued.", "Abort visit");
  if (reason !== null) run("abort_visit", { reason });
});
on("begin-task", "click", () => run("begin_task", { step: state.task.step }));
on("abort-task", "click", async () => {
  const reason = await confirmed("Abort the task?", "It will be repeated when the participant is ready again.", "Abort task");
  if (reason !== null) run("abort_task", { reason });
});
on("call", "click", () => run("call"));
on("auto-start", "change", (event) => run("set_auto_start", { on: event.target.checked }));
on("note-form", "submit", async (event) => {
  event.preventDefault();
  const text = find("note").value.trim();
  if (text && (await run("note", { text }))) find("note").value = "";
});
on("note", "keydown", (event) => {
  if (event.key === "Enter" && !event.shiftKey) {
    event.preventDefault();
    find("note-form").requestSubmit();
  }
});
