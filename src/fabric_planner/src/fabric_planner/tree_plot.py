# SPDX-License-Identifier: BSD-3-Clause
"""The search tree as one picture: the likeliest branches, from left to right."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fabric_planner.tree_view import likeliest_path

ROWS = 26  # lines of text that fit one below the other
OUTCOMES = 4  # drawn after an action, the likeliest
LEVELS = 3  # actions one after the other


@dataclass
class _Spot:
    """A node of the picture: what is written, and where."""

    label: str
    is_action: bool
    strong: bool  # on the path of best actions and likeliest observations
    level: int
    weight: float = 1.0  # thickness of the line to it
    below: list["_Spot"] = field(default_factory=list)
    y: float = 0.0

    def leaves(self) -> int:
        return sum(spot.leaves() for spot in self.below) if self.below else 1


def write_tree_plot(tree: dict, path: "str | Path", title: str) -> None:
    """A PNG of the nested tree: squares are actions, circles beliefs, both with their bounds.

    Only what matters is drawn: all actions at a belief, the likeliest observations after the best
    one, and below these as far as there is room, likeliest first.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    root = _pruned(tree)
    _place(root, [0])
    height = max(3.0, 0.36 * root.leaves() + 1.0)
    figure = Figure(figsize=(15, height), constrained_layout=True)
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    _draw(axes, root)
    axes.set_title(title)
    axes.set_xlim(-0.15, _deepest(root) + 0.95)
    axes.set_ylim(root.leaves() - 0.3, -0.7)
    axes.axis("off")
    _legend(axes)
    figure.savefig(path, dpi=100)


def _pruned(tree: dict) -> _Spot:
    """Opens the likeliest belief as long as its actions still fit into the picture."""
    on_path = {id(belief) for belief in likeliest_path(tree)}
    root = _Spot(f"now\n{_bounds(tree)}", False, True, 0)
    waiting = [(1.0, tree, root)]
    while waiting:
        waiting.sort(key=lambda item: -item[0])
        reach, belief, spot = waiting.pop(0)
        if spot.level >= 2 * LEVELS or not belief["actions"]:
            continue
        if spot is not root and root.leaves() + len(belief["actions"]) + OUTCOMES > ROWS:
            continue
        waiting += _open(belief, spot, reach, on_path)
    return root


def _open(belief: dict, spot: _Spot, reach: float, on_path: set[int]) -> list[tuple]:
    """Hangs the actions below the spot; returns the beliefs after the best one, to be opened."""
    opened: list[tuple] = []
    for action in sorted(belief["actions"], key=lambda a: (not a["best"], -a["lower"])):
        strong = action["best"] and spot.strong
        label = f"{_words(action['action'])} {_bounds(action)}"
        node = _Spot(label, True, strong, spot.level + 1, 1.0 if action["best"] else 0.2)
        spot.below.append(node)
        if action["best"]:
            opened += _outcomes(action, node, reach, on_path)
    return opened


def _outcomes(action: dict, node: _Spot, reach: float, on_path: set[int]) -> list[tuple]:
    opened = []
    for after in action["outcomes"][:OUTCOMES]:
        share = after["probability"]
        label = f"{share:.2f} {_words(after['observation'])}\n{_bounds(after)}"
        spot = _Spot(label, False, id(after) in on_path, node.level + 1, share)
        node.below.append(spot)
        opened.append((reach * share, after, spot))
    rest = action["outcomes"][OUTCOMES:]
    if rest:
        left = sum(after["probability"] for after in rest)
        label = f"{left:.2f} {len(rest)} others"
        node.below.append(_Spot(label, False, False, node.level + 1, left))
    return opened


def _place(spot: _Spot, row: list[int]) -> None:
    if not spot.below:
        spot.y = float(row[0])
        row[0] += 1
        return
    for below in spot.below:
        _place(below, row)
    spot.y = spot.below[0].y  # the best action continues its belief's line


def _draw(axes: Any, spot: _Spot) -> None:
    for below in spot.below:
        colour = "tab:red" if below.strong else "0.6"
        axes.plot(
            [spot.level, spot.level + 0.12, below.level], [spot.y, below.y, below.y],
            color=colour, lw=0.6 + 3.0 * below.weight, alpha=0.6, zorder=1,
            solid_capstyle="round", solid_joinstyle="round",
        )  # fmt: skip
        _draw(axes, below)
    colour = "tab:red" if spot.strong else "0.45"
    marker, size = ("s", 42) if spot.is_action else ("o", 60)
    axes.scatter([spot.level], [spot.y], s=size, marker=marker, color=colour, zorder=2)
    axes.text(
        spot.level + 0.04, spot.y, spot.label, va="center", fontsize=7.5, zorder=3,
        bbox={"facecolor": "white", "alpha": 0.85, "lw": 0, "pad": 0.8},
    )  # fmt: skip


def _legend(axes: Any) -> None:
    axes.scatter([], [], s=60, marker="o", color="0.45", label="belief: probability, observation")
    axes.scatter([], [], s=42, marker="s", color="0.45", label="action")
    axes.plot([], [], color="tab:red", lw=2.5, label="best action, likeliest observation")
    axes.plot([], [], " ", label="[lower, upper] bounds on the value")
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=4, fontsize="small", frameon=False
    )


def _deepest(spot: _Spot) -> int:
    return max([spot.level] + [_deepest(below) for below in spot.below])


def _bounds(node: dict) -> str:
    return f"[{node['lower']:.4g}, {node['upper']:.4g}]"


def _words(name: str) -> str:
    return name.replace("_", " ")
