# SPDX-License-Identifier: BSD-3-Clause
"""The report of the short-term study: one HTML page that stands by itself."""

from __future__ import annotations

import html

from fabric_sim.drift import NORMAL, DriftParameters
from fabric_sim.experiments.robots import TITLES
from fabric_sim.experiments.short_term_figures import (
    confusion_figure,
    person_figure,
    robots_figure,
)
from fabric_sim.experiments.short_term_table import (
    Study,
    comparison_table,
    goal_table,
    main_table,
    noise_title,
    way_table,
)
from fabric_study.page import html_page, html_table

TITLE = "The short-term study: does a robot that anticipates help better?"
INTRODUCTION = """
<p>A person inspects packages at a conveyor belt. Each task is one package: lift it, look at it, put
it away. Beside the person stands a robot arm that can do the same. A good helper notices when help
is wanted, does not take work out of somebody's hands, and stops when told to. This page reports
a simulation of {scenarios} working days (<em>scenarios</em>) of {tasks} tasks each. Every robot met
the same people in the same moods, so the robots are compared in pairs.</p>
<h2>The people</h2>
<p>A simulated person thinks, lifts, fails, looks around, tires, takes breaks and answers the robot:
who is tired or has failed mostly accepts help, who gets on with the work mostly refuses
a robot that reaches into it, with a stop gesture (a <em>warning</em>). Two people in three trust
the robot. On a normal day the person is able, rested and attentive; as tasks go by, other moods
become more likely:</p>
{moods}
<p>A stubborn person cannot lift the package, keeps trying and would rather not be helped; a tired
one stands idle, lifts badly or takes a break; a distracted one looks elsewhere. What the person
went through stays: packages tire, breaks refresh, unwanted help annoys.</p>
<h2>The robots</h2>
<ul>
<li><b>proactive</b>: keeps a belief about what the person is up to. First it asks what may be wrong
(stage 1: not capable, tired, distracted), then what the person wants (stage 2: a reminder, help, or
neither), and plans ahead under that belief.</li>
<li><b>reactive</b>: takes over by fixed rules - after a failed attempt, when nobody is there, or
after 15 s without success. Warned, it stops, and asks again as soon as the warning is over.</li>
<li><b>reactive, waits anew</b>: the same, but after a warning its 15 s begin anew. This is not the
thesis' robot; it shows how much of the difference is due to asking again at once.</li>
<li><b>person alone</b>: the robot stands still.</li>
<li><b>never help</b>: the proactive robot without its grasp; it may watch, prepare, point and
cancel.</li>
<li><b>oracle</b>: the proactive robot's idea of people, with the person's true state revealed. No
robot can know this; it shows what better estimates would be worth.</li>
<li><b>patient, eager</b>: the proactive robot with other ideas of how often people need help.</li>
</ul>
<h2>What is measured</h2>
<p>The reward of a task is +6 for a success, -3 for a failure and -3 for each warning that the
person gave, discounted by 0.98 a decision. Estimation accuracy is the share of a task's decisions
whose likeliest state was the true one while the truth was in that stage, averaged over the tasks;
pooled, every decision weighs the same. Duration counts failed tasks too; a task that nobody
finishes fails after about a minute.
Published values are those of the thesis (Table 4.1), which had 5 scenarios of 40 tasks for each
robot.</p>
"""
LIMITS = """
<h2>Limits</h2>
<ul>
<li>The people are simulated. They were written from the published description and recorded
averages; how often moods come, and how strongly they act, is a choice (config/drift.yaml).</li>
<li>In the published study an operator entered the person's next state by hand; its people cannot be
repeated exactly, so the same order and size of effects can be expected, not the same figures.</li>
<li>The robots' models were written by hand and adjusted on scenarios with other seeds than those
reported by default.</li>
<li>The oracle knows the present, not the future, and plans with the robot's idea of people. A robot
with a better idea could beat it.</li>
<li>What is true in stage 1 and 2 is a rule on the simulated person's hidden state; another rule
would give other accuracies.</li>
</ul>
"""
CAPTIONS = {
    person_figure: "Seconds a task that the person spends in a state (after Fig. 4.5). Dots: mean "
    "over scenarios; line: smooth fit with the 95 % band of the mean. Evaluating is thinking, "
    "without the lifting itself.",
    robots_figure: "How the robots did (after Fig. 4.6), mean over scenarios with its 95 % band; "
    "bottom right: the moods that the people were in.",
    confusion_figure: "What the proactive robot believed while what was true; each row sums to 1.",
}


def report_html(study: Study) -> str:
    """Return the page."""
    seeds = {row["scenario_seed"] for row in study.scenarios}
    tasks = max(int(row["tasks"]) for row in study.scenarios)
    parts = [
        INTRODUCTION.format(
            scenarios=len(seeds),
            tasks=tasks,
            moods=html_table(mood_table(DriftParameters.load(), tasks)),
        )
    ]
    for noise in study.noises:
        parts += _of_noise(study, noise)
    parts.append(LIMITS)
    return html_page(TITLE, parts)


def mood_table(parameters: DriftParameters, tasks: int) -> list[list[str]]:
    """Return the probabilities of the moods along a scenario, header first."""
    shown = sorted({1, *range(10, tasks + 1, 10), tasks})
    table = [["probability in task", *map(str, shown)]]
    for name in (NORMAL, *(mood.name for mood in parameters.moods)):
        chances = [parameters.chances(number)[name] for number in shown]
        table.append([name, *(f"{chance:.2f}" for chance in chances)])
    return table


def _of_noise(study: Study, noise: float) -> list[str]:
    parts = [f"<h2>Results: {html.escape(noise_title(noise))}</h2>"]
    parts += ["<h3>Goals</h3>", html_table(goal_table(study, noise))]
    parts += ["<h3>Table 4.1, ours beside the published</h3>"]
    parts += [html_table(main_table(study, noise), "wide")]
    parts.append("<p>Means over scenarios with 95 % intervals (Student's t).</p>")
    for figure, caption in CAPTIONS.items():
        parts.append(f"<figure>{figure(study, noise)}<figcaption>{caption}</figcaption></figure>")
    for second in study.robots:
        if second != "proactive":
            parts.append(f"<h3>Proactive minus {html.escape(TITLES[second])}</h3>")
            parts.append(html_table(comparison_table(study, noise, second)))
    parts.append(
        "<p>Paired by scenario. d_z: mean difference over its standard deviation, with 95 % "
        "interval. Both tests are two-sided; the last column is the larger of both p, corrected "
        "by Holm over the measures.</p>"
    )
    if way := way_table(study, noise):
        parts.append("<h3>Way from the person alone (0) to the oracle (1)</h3>")
        parts.append(html_table(way))
        parts.append("<p>With 95 % bootstrap intervals over scenarios.</p>")
    return parts
