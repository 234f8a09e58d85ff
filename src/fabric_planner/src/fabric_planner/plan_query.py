# SPDX-License-Identifier: BSD-3-Clause
"""What to do at a belief: asked of a search or of a policy."""

from pathlib import Path

import numpy as np

import fabric_planner as fp
from fabric_planner.paths import shipped_models


def find_model(text: str) -> str:
    """A path as it is; else the shipped model of that name."""
    if not Path(text).exists():
        for path in shipped_models():
            if path.stem == text:
                return str(path)
    return text


def parse_belief(text: str, model: fp.Pomdp) -> np.ndarray:
    """Reads "p1,p2,..." or "state=p,state=p" into (S,). Raises ModelError naming the token."""
    belief = np.zeros(model.n_states)
    for index, token in enumerate(text.split(",")):
        name, separator, number = token.rpartition("=")
        place = model.state_index(name.strip()) if separator else index
        if place >= model.n_states:
            raise fp.ModelError(f"--belief: more numbers than the {model.n_states} states")
        try:
            belief[place] = float(number)
        except ValueError:
            raise fp.ModelError(f"--belief: '{number.strip()}' is not a number") from None
    return belief


def facts(path: str, model: fp.Pomdp) -> dict:
    """What there is to know of a model before anything is planned."""
    return {
        "model": path,
        "states": model.n_states,
        "actions": model.n_actions,
        "observations": model.n_observations,
        "fully_observable": model.fully_observable,
        "discount": model.discount,
    }


def describe_model(answer: dict) -> str:
    kind = "fully observable" if answer["fully_observable"] else "partially observable"
    return (
        f"{answer['model']}: {answer['states']} states, {answer['actions']} actions, "
        f"{answer['observations']} observations, {kind}, discount {answer['discount']:g}"
    )


def ask_search(planner: fp.OnlinePlanner, model: fp.Pomdp, belief: np.ndarray) -> dict:
    """One decision, with names in place of indices."""
    decision = planner.decide(belief)
    has_other = decision.runner_up >= 0
    return {
        "belief": [float(p) for p in belief],
        "action": model.actions[decision.action],
        "value": decision.value,
        "lower_bound": decision.lower_bound,
        "upper_bound": decision.upper_bound,
        "runner_up": model.actions[decision.runner_up] if has_other else None,
        "runner_up_gap": decision.runner_up_gap,
        "nodes": decision.nodes,
        "planning_time": decision.planning_time,
        "ended_by": decision.ended_by.name,
        "fallback_used": decision.fallback_used,
    }


def describe_search(answer: dict) -> str:
    lines = [
        f"action      {answer['action']}",
        f"value       {answer['value']:.6g}, optimal value in "
        f"[{answer['lower_bound']:.6g}, {answer['upper_bound']:.6g}]",
    ]
    if answer["runner_up"] is not None:
        lines.append(f"runner-up   {answer['runner_up']}, loses {answer['runner_up_gap']:.6g}")
    lines.append(
        f"search      {answer['nodes']} beliefs in {1e3 * answer['planning_time']:.3g} ms, "
        f"ended by {answer['ended_by']}"
    )
    return "\n".join(lines)


def ask_policy(policy: fp.AlphaVectors, model: fp.Pomdp, belief: np.ndarray) -> dict:
    """What a policy of alpha vectors would do. Raises ModelError for a bad belief."""
    checked = fp.BeliefFilter(model)
    checked.reset(belief)
    return {
        "belief": [float(p) for p in belief],
        "action": model.actions[policy.action(checked.belief)],
        "value": policy.value(checked.belief),
        "vectors": len(policy),
    }


def describe_policy(answer: dict) -> str:
    return (
        f"action      {answer['action']}\n"
        f"value       {answer['value']:.6g}, told by a policy of {answer['vectors']} vectors"
    )
