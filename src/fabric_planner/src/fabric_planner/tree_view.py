# SPDX-License-Identifier: BSD-3-Clause
"""The search tree as something to read: indented text, or nested dicts ready for JSON.

A belief of the nested form has the keys `observation` (its name; None at the root), `probability`
(of the observation after the action), `lower` and `upper` (of the optimal value), `expanded` (how
many beliefs were, from here down) and `actions`. An action has `action` (its name), `lower`,
`upper`, `best` (it would be taken) and `outcomes`: the beliefs after it, likeliest first.
"""

from collections.abc import Iterator, Sequence

import fabric_planner as fp

SHOWN_OUTCOMES = 3  # of an action that would be taken, in the text


def nested(rows: Sequence[dict], model: fp.Pomdp) -> dict:
    """What `OnlinePlanner.tree()` lists, with names in place of indices. Its rows come parents
    first; beliefs and actions take turns."""
    nodes: list[dict] = []
    for row in rows:
        is_belief = row["kind"] == "belief"
        node = _belief(row, model) if is_belief else _action(row, model)
        if row["parent"] >= 0:
            nodes[row["parent"]]["outcomes" if is_belief else "actions"].append(node)
        nodes.append(node)
    for node in nodes:
        if node.get("actions"):
            max(node["actions"], key=lambda action: action["lower"])["best"] = True
        if "outcomes" in node:
            node["outcomes"].sort(key=lambda belief: -belief["probability"])
    return nodes[0]


def _belief(row: dict, model: fp.Pomdp) -> dict:
    seen = row["observation"]
    return {
        "observation": model.observations[seen] if seen >= 0 else None,
        "probability": row["probability"],
        "lower": row["lower"],
        "upper": row["upper"],
        "expanded": row["expanded"],
        "actions": [],
    }


def _action(row: dict, model: fp.Pomdp) -> dict:
    return {
        "action": model.actions[row["action"]],
        "lower": row["lower"],
        "upper": row["upper"],
        "best": False,
        "outcomes": [],
    }


def likeliest_path(tree: dict) -> list[dict]:
    """The beliefs from the root down the best actions and the likeliest observations."""
    path = [tree]
    while chosen := best_action(path[-1]):
        if not chosen["outcomes"]:
            break
        path.append(chosen["outcomes"][0])
    return path


def best_action(belief: dict) -> dict | None:
    return next((action for action in belief["actions"] if action["best"]), None)


def as_text(tree: dict, depth: int = 2) -> str:
    """The tree to `depth` actions below the root.

    `>` marks the action that would be taken and, below the root, the likeliest observations after
    it; other actions are told by their bounds alone.
    """
    head = f"root {_bounds(tree)}" + ("" if tree["actions"] else ", not expanded")
    on_path = {id(belief) for belief in likeliest_path(tree)}
    return "\n".join([head, *_belief_lines(tree, "", depth, on_path)])


def _bounds(node: dict) -> str:
    return f"[{node['lower']:.4g}, {node['upper']:.4g}]"


def _belief_lines(belief: dict, indent: str, depth: int, on_path: set[int]) -> Iterator[str]:
    if depth <= 0:
        return
    ranked = sorted(belief["actions"], key=lambda a: (not a["best"], -a["lower"]))
    width = max((len(action["action"]) for action in ranked), default=0)
    for action in ranked:
        last = action is ranked[-1]
        mark = ">" if action["best"] else " "
        yield f"{indent}{_branch(last)}{mark} {action['action']:<{width}} {_bounds(action)}"
        if action["best"]:
            yield from _outcome_lines(action, indent + _below(last), depth, on_path)


def _outcome_lines(action: dict, indent: str, depth: int, on_path: set[int]) -> Iterator[str]:
    shown = action["outcomes"][:SHOWN_OUTCOMES]
    rest = action["outcomes"][SHOWN_OUTCOMES:]
    for belief in shown:
        last = belief is shown[-1] and not rest
        mark = ">" if id(belief) in on_path else " "
        yield (
            f"{indent}{_branch(last)}{mark} {belief['probability']:.3f} {belief['observation']} "
            f"{_bounds(belief)}"
        )
        yield from _belief_lines(belief, indent + _below(last), depth - 1, on_path)
    if rest:
        left = sum(belief["probability"] for belief in rest)
        yield f"{indent}{_branch(True)}  {left:.3f} {len(rest)} other observations"


def _branch(last: bool) -> str:
    return "└─" if last else "├─"


def _below(last: bool) -> str:
    return "    " if last else "│   "
