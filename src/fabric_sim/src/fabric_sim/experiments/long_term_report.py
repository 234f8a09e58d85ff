# SPDX-License-Identifier: BSD-3-Clause
"""The report of the long-term study: one HTML page that stands by itself."""

from __future__ import annotations

import html
from collections.abc import Callable

from fabric_sim.experiments.long_term_figures import (
    ablation_figure,
    choices_figure,
    convergence_figure,
    courses_figure,
    order_figure,
    strategies_figure,
)
from fabric_sim.experiments.long_term_run import ABPS, Adaptation
from fabric_sim.experiments.long_term_table import (
    RECORDED_NOTE,
    Study,
    ablation_table,
    convergence_table,
    facts,
    goal_table,
    main_table,
    strategies_table,
)
from fabric_study.page import html_page, html_table

TITLE = "The long-term study: does it help to choose the policy that suits the person?"
INTRODUCTION = """
<p>A robot arm works beside a person at a conveyor belt and helps when help is wanted. People
differ: some are skilled, some tire, some lose attention, some dislike being helped. The robot has a
library of {policies} ready-made ways to behave (<em>policies</em>), from leaving people alone to
taking over early. Before every task <b>ABPS</b> (anticipatory Bayesian policy selection) chooses
one of them. It holds a belief about which of {types} known types of people this one resembles,
which it updates by what the task looked like, and takes the policy that promises most under that
belief. Nobody tells it who is there, nor when somebody else takes over.</p>
<p>Two questions: how soon does ABPS do as well with a new person as the best policy for that person
would (<em>convergence</em>)? And over a long time with changing people, is choosing better than any
one policy (<em>adaptation</em>)?</p>
<h2>The people</h2>
<p>Everybody in this study is unknown to the robot: four numbers between 0 and 1 (expertise,
stamina, attention, collaborativeness) drawn at random. What ABPS knows about people comes from
training runs with {types} known types that are not among them. A person is fresh at the begin of
a shift and goes on from task to task: works, tires, learns, and gets annoyed by help that was not
wanted. All strategies meet the same people with the same chance: the same packages, the same errors
of recognition.</p>
<h2>What is compared</h2>
<ul>
<li><b>ABPS</b> as shipped, and the same with other ways to choose: expected improvement as
published, probability of improvement, Thompson sampling, a bandit that learns from rewards alone
(exp4), by lot.</li>
<li><b>Every constant policy</b> of the library. The <em>best constant</em> is the one that earned
most in these very tasks: a choice that can only be made afterwards.</li>
<li>The <b>oracle</b> plays, for each person, the policy that is best for that person. It was found
on {judged} other tasks with the same person (finalists; the weaker ones were dropped earlier), so
it does not profit from luck. The gap between best constant and oracle is what there is to be won by
choosing.</li>
</ul>
<p>The reward is the same for everyone: a package or cube that is dealt with rightly counts +6, one
that is not -3 (when sorting, -6), a warning -3, discounted by 0.98 a decision since it came. A
<em>warning</em> is a stop gesture of a person who does not want the robot's interference.</p>
"""
LIMITS = """
<h2>How to read the numbers</h2>
<ul>
<li>Tests are two-sided and paired by order: the same people under both strategies. p is the larger
of a paired t test and Wilcoxon's signed-rank test, corrected by Holm over the measures (in the
table of strategies: over the strategies). d_z is the mean difference over its standard deviation,
with its 95 % interval. Each order has people of its own, so the intervals tell about people not met
here.</li>
<li><em>Of the gap</em>: how far a strategy goes on the way from the best constant (0) to the oracle
(1), by the means, with a 95 % bootstrap interval over orders.</li>
<li>The regret is Eq. 5.5: reward of the best policy for the person minus reward of ABPS, in equal
tasks of equal chance. The interval is a bootstrap over people.</li>
</ul>
<h2>Limits</h2>
<ul>
<li>The people are simulated, and so are those that ABPS was trained on; both come from the same
model of people. Real people may differ in ways that this model does not know.</li>
<li>The oracle is the best of the library's policies kept constant; a robot that changes policy with
the person's mood could earn more.</li>
<li>The published study had other people, an operator's model of them and five repetitions of one
order. Its figures stand beside ours for comparison; they are no target.</li>
</ul>
"""
CAPTIONS: dict[Callable[[Study], str], str] = {
    convergence_figure: "After Fig. 5.2: how ABPS approaches the best policy for a new person. "
    "Dashed: 5 %; dotted: the task by which the published study converged. Bands: 95 %.",
    courses_figure: "After Fig. 5.4: mean over orders with its 95 % band. (e): all people after "
    "the first, from the moment they take over. (f): above the solid line ABPS did better than the "
    "best constant with that person; on the dashed one as well as the oracle.",
    order_figure: "After Fig. 5.3: the first order, person after person.",
    strategies_figure: "Every strategy against the best constant, which is 0, with 95 % intervals. "
    "Grey: constant policies of the library; light blue: other ways to choose; pink: from outside. "
    "Figures stand for what lies far off to the left.",
    choices_figure: "What ABPS chose, and what would have been best.",
}

ALTERED = (
    "The first {orders} orders with one thing altered; everything else as shipped. Sizes out of 40 "
    "are to be compared with each other: that library was built for the purpose, with less work."
)


def report_html(study: Study) -> str:
    """Return the page."""
    found = study.adaptation
    parts = [
        INTRODUCTION.format(
            policies=len(found.library),
            types=len(study.types),
            judged=found.hindsight.shifts * found.shift_tasks,
        ),
        "<h2>Goals</h2>",
        html_table(goal_table(study)),
        f"<p>{html.escape(facts(study))}</p>",
        *_convergence(study),
        *_adaptation(study),
    ]
    if study.ablation:
        parts += [
            "<h2>What the parts of ABPS contribute</h2>",
            f"<p>{html.escape(ALTERED.format(orders=len(study.ablation[0].figures)))}</p>",
            html_table(ablation_table(study)),
            f"<figure>{ablation_figure(study)}</figure>",
        ]
    return html_page(TITLE, [*parts, LIMITS])


def _convergence(study: Study) -> list[str]:
    workers, repeats, tasks = study.convergence.rewards[ABPS].shape
    return [
        "<h2>Convergence to a new person</h2>",
        f"<p>{workers} people, each met {repeats} times by a robot that knows nobody yet, "
        f"{tasks} tasks each time.</p>",
        _figure(study, convergence_figure),
        html_table(convergence_table(study)),
    ]


def _adaptation(study: Study) -> list[str]:
    found = study.adaptation
    published = study.scenario == "inspection"
    parts = [
        "<h2>Adaptation to changing people</h2>",
        f"<p>{_orders(found)}</p>",
        f"<h3>{'Table 5.1, ours beside the published' if published else 'ABPS and the best'}</h3>",
        html_table(main_table(study), "wide"),
    ]
    if published:
        parts.append(f"<p>{html.escape(RECORDED_NOTE)}.</p>")
    parts += [
        _figure(study, courses_figure),
        _figure(study, order_figure),
        "<h3>All strategies</h3>",
        html_table(strategies_table(study), "wide"),
        _figure(study, strategies_figure),
        _figure(study, choices_figure),
    ]
    if study.refused:
        parts.append("<h3>Policies that could not be used</h3><ul>")
        parts += [f"<li>{html.escape(reason)}</li>" for reason in study.refused]
        parts.append("</ul>")
    return parts


def _orders(found: Adaptation) -> str:
    people, tasks = len(found.shifts[0]), found.shift_tasks
    return (
        f"{len(found.seeds)} orders of {people} people, {tasks} tasks each: {people * tasks} tasks "
        "an order, and no person comes twice. ABPS goes on through an order without being told "
        "that somebody else has come."
    )


def _figure(study: Study, draw: Callable[[Study], str]) -> str:
    caption = html.escape(CAPTIONS[draw])
    return f"<figure>{draw(study)}<figcaption>{caption}</figcaption></figure>"
