# SPDX-License-Identifier: BSD-3-Clause
"""Solves or queries a POMDPX model from the shell: `./fabric plan MODEL [--belief ...] [--json]`.

Exit code 0 with the decision on stdout, or 2 with one line on stderr that names what is wrong.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import fabric_planner as fp
from fabric_planner.paths import shipped_models


def parse_belief(text: str, model: fp.Pomdp) -> list[float]:
    """Reads "p1,p2,..." or "state=p,state=p". Raises ModelError naming the token."""
    belief = [0.0] * model.n_states
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


def find_model(text: str) -> str:
    """A path as it is; else the shipped model of that name."""
    if not Path(text).exists():
        for path in shipped_models():
            if path.stem == text:
                return str(path)
    return text


def query(path: str, arguments: argparse.Namespace) -> dict:
    """Loads, plans once and returns the answer with names in place of indices."""
    model = fp.load_pomdpx(path, normalise=arguments.normalise)
    belief = model.initial_belief
    if arguments.belief is not None:
        belief = parse_belief(arguments.belief, model)
    options = fp.PlannerOptions(arguments.deadline, arguments.gap, arguments.nodes)
    decision = fp.OnlinePlanner(model, options).decide(belief)
    has_other = decision.runner_up >= 0
    return {
        "model": path,
        "states": model.n_states,
        "actions": model.n_actions,
        "observations": model.n_observations,
        "fully_observable": model.fully_observable,
        "discount": model.discount,
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


def describe(answer: dict) -> str:
    """The answer in a few lines for a person."""
    kind = "fully observable" if answer["fully_observable"] else "partially observable"
    lines = [
        f"{answer['model']}: {answer['states']} states, {answer['actions']} actions, "
        f"{answer['observations']} observations, {kind}, discount {answer['discount']:g}",
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


def parser() -> argparse.ArgumentParser:
    defaults = fp.PlannerOptions()
    result = argparse.ArgumentParser(prog="fabric plan", description=__doc__.split("\n")[0])
    result.add_argument("model", metavar="MODEL", help="a POMDPX file or a shipped model's name")
    result.add_argument("--belief", help="p1,p2,... or state=p,...; default: the model's own")
    result.add_argument("--gap", type=float, default=defaults.gap, help="default %(default)s")
    result.add_argument(
        "--nodes", type=int, default=defaults.max_nodes, help="at most; default %(default)s"
    )
    result.add_argument(
        "--deadline", type=float, default=10.0, help="s a decision may take; default %(default)s"
    )
    result.add_argument(
        "--normalise", action="store_true", help="rescale rows that do not sum to 1"
    )
    result.add_argument("--json", action="store_true", help="print one JSON object")
    return result


def main(argv: Sequence[str] | None = None) -> int:
    arguments = parser().parse_args(argv)
    path = find_model(arguments.model)
    try:
        answer = query(path, arguments)
    except fp.ModelError as error:
        message = str(error)
        print(message if path in message else f"{path}: {message}", file=sys.stderr)
        return 2
    print(json.dumps(answer) if arguments.json else describe(answer))
    return 0


if __name__ == "__main__":
    sys.exit(main())
