# SPDX-License-Identifier: BSD-3-Clause
"""What `./fabric plan` does with a model, one job after the other."""

import argparse
import json
from pathlib import Path

import fabric_planner as fp
from fabric_planner import plan_query as query
from fabric_planner.plan_solve import describe_solution, solve_aloud
from fabric_planner.tree_plot import write_tree_plot
from fabric_planner.tree_view import as_text, nested

QUERY_DEADLINE = 2.0  # s, of one decision asked for
EVALUATION_DEADLINE = 0.01  # s, of each decision of many


def run(path: str, arguments: argparse.Namespace) -> tuple[dict, str]:
    """All that was asked for: as one dict, and as text for a person.

    Raises ModelError or OSError naming file, option or belief.
    """
    model = fp.load(path, normalise=arguments.normalise)
    answer = query.facts(path, model)
    texts = [query.describe_model(answer)]
    policy = fp.load_policy(arguments.policy, model) if arguments.policy else None
    for job in (_lint, _convert):
        _add(job(model, arguments), answer, texts)
    if arguments.solve is not None:
        policy = _solve(model, arguments, answer, texts)
    if arguments.evaluate is not None:
        _add(_evaluate(model, policy, arguments), answer, texts)
    if _asks(arguments):
        _add(_ask(model, policy, arguments), answer, texts)
    return answer, "\n".join(texts)


def _add(told: tuple[dict, str] | None, answer: dict, texts: list[str]) -> None:
    if told is not None:
        answer |= told[0]
        texts.append(told[1])


def _asks(arguments: argparse.Namespace) -> bool:
    """A belief is asked about unless only something else was wanted."""
    other = arguments.lint or arguments.convert or arguments.evaluate is not None
    return not other or arguments.belief is not None or _wants_tree(arguments)


def _wants_tree(arguments: argparse.Namespace) -> bool:
    return arguments.tree is not None or bool(arguments.tree_json or arguments.tree_plot)


def _lint(model: fp.Pomdp, arguments: argparse.Namespace) -> tuple[dict, str] | None:
    if not arguments.lint:
        return None
    findings = [
        {
            "kind": finding.kind,
            "severity": finding.severity,
            "places": finding.places,
            "sentence": finding.sentence,
        }
        for finding in fp.lint(model)
    ]
    lines = [f"{f['severity']}: {f['sentence']} ({f['kind']})" for f in findings]
    return {"lint": findings}, "\n".join(lines) or "nothing looks like a mistake"


def _convert(model: fp.Pomdp, arguments: argparse.Namespace) -> tuple[dict, str] | None:
    if not arguments.convert:
        return None
    fp.save_pomdpx(model, arguments.convert)
    return {"converted": arguments.convert}, f"written     {arguments.convert}"


def _solve(
    model: fp.Pomdp, arguments: argparse.Namespace, answer: dict, texts: list[str]
) -> fp.AlphaVectors:
    while texts and not arguments.json:
        print(texts.pop(0), flush=True)
    solution, told = solve_aloud(model, arguments)
    _add((told, describe_solution(told)), answer, texts)
    if arguments.save_policy:
        fp.save_policy(solution.lower, model, arguments.save_policy)
        texts.append(f"written     {arguments.save_policy}")
    return solution.lower


def _planner(model: fp.Pomdp, arguments: argparse.Namespace, deadline: float) -> fp.OnlinePlanner:
    options = fp.PlannerOptions(max_nodes=arguments.nodes)
    options.deadline = deadline if arguments.deadline is None else arguments.deadline
    if arguments.gap is not None:
        options.gap = arguments.gap
    return fp.OnlinePlanner(model, options)


def _evaluate(
    model: fp.Pomdp, policy: fp.AlphaVectors | None, arguments: argparse.Namespace
) -> tuple[dict, str]:
    chosen = policy or _planner(model, arguments, EVALUATION_DEADLINE)
    found = fp.evaluate(model, chosen, episodes=arguments.evaluate, seed=arguments.seed)
    told = {
        "episodes": arguments.evaluate,
        "seed": arguments.seed,
        "mean_return": found.mean_return,
        "standard_error": found.standard_error,
        "cv": found.cv,
        "cv_standard_error": found.cv_standard_error,
    }
    text = (
        f"return      {told['mean_return']:.6g} +- {told['standard_error']:.3g} "
        f"in {arguments.evaluate} episodes\n"
        f"policy      worth {told['cv']:.6g} +- {told['cv_standard_error']:.3g} "
        "by its one-step regrets"
    )
    return {"evaluation": told}, text


def _ask(
    model: fp.Pomdp, policy: fp.AlphaVectors | None, arguments: argparse.Namespace
) -> tuple[dict, str]:
    belief = model.initial_belief
    if arguments.belief is not None:
        belief = query.parse_belief(arguments.belief, model)
    if policy is not None and not _wants_tree(arguments):
        told = query.ask_policy(policy, model, belief)
        return told, query.describe_policy(told)
    planner = _planner(model, arguments, QUERY_DEADLINE)
    told = query.ask_search(planner, model, belief)
    text = query.describe_search(told)
    if _wants_tree(arguments):
        text += _show_tree(planner, model, arguments)
    return told, text


def _show_tree(planner: fp.OnlinePlanner, model: fp.Pomdp, arguments: argparse.Namespace) -> str:
    depth = arguments.tree if arguments.tree is not None else 3
    tree = nested(planner.tree(max_depth=max(depth, 3)), model)
    if arguments.tree_json:
        Path(arguments.tree_json).write_text(json.dumps(tree) + "\n")
    if arguments.tree_plot:
        write_tree_plot(tree, arguments.tree_plot, f"{Path(model.name).stem}: search tree")
    return "" if arguments.tree is None else "\n" + as_text(tree, depth)
