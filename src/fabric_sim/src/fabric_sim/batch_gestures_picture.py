# SPDX-License-Identifier: BSD-3-Clause
"""Draws what the card of a gesture classifier says: its confusion matrix, and simpler ways.

python3 -m fabric_sim.batch_gestures_picture CARD.yaml PICTURE.png
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fabric_perception.gestures.model_file import load
from fabric_perception.gestures.recording import LABELS

USAGE = "usage: python3 -m fabric_sim.batch_gestures_picture CARD.yaml PICTURE.png"
BARS = {"accuracy": "accuracy", "warning_recall": "warnings recalled"}


def draw(card: Mapping[str, Any], path: str | Path) -> None:
    """Write the picture. Raises ValueError when the card tells of nobody who was left out."""
    if "all" not in card.get("leave_one_person_out", {}):
        raise ValueError("the card has no leave_one_person_out.all")
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.6))
    _confusion(left, np.array(card["leave_one_person_out"]["all"]["confusion"], dtype=float))
    _ways(right, card.get("comparison", {}))
    figure.savefig(path, dpi=110)


def _confusion(axes: Any, counts: np.ndarray) -> None:
    shares = counts / np.maximum(1.0, counts.sum(axis=1, keepdims=True))
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    for (i, k), share in np.ndenumerate(shares):
        colour = "white" if share > 0.5 else "black"
        axes.text(k, i, f"{100.0 * share:.1f}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(LABELS)), LABELS)
    axes.set_yticks(range(len(LABELS)), LABELS)
    axes.set_xlabel("recognised")
    axes.set_ylabel("done, % of its frames")


def _ways(axes: Any, found: Mapping[str, Mapping[str, float]]) -> None:
    names = list(found)
    for n, (key, text) in enumerate(BARS.items()):
        places = np.arange(len(names)) + 0.4 * n - 0.2
        bars = axes.barh(places, [found[name].get(key, 0.0) for name in names], 0.38, label=text)
        axes.bar_label(bars, fmt="%.3f", padding=2, fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.12)
    if names:
        axes.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=2, frameon=False, fontsize=8
        )


def main(arguments: Sequence[str]) -> int:
    """Draw; exit 2 when a file is refused."""
    if len(arguments) != 2:
        print(USAGE, file=sys.stderr)
        return 2
    try:
        draw(load(arguments[0]).card, arguments[1])
    except (ValueError, OSError) as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
