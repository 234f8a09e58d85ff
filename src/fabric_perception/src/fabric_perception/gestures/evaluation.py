# SPDX-License-Identifier: BSD-3-Clause
"""How well a stream of posteriors follows what a person did.

Accuracy counts frames: what is said of a moment, `lag` frames later, against what was done at that
moment; `accuracy_at_once` is against what is done when it is said. It is also given without the
frames within `COLLAR` after a change, in which a movement has hardly begun. Delays count from the
change until it is said. A warning is recalled when the fast road tells of it before it has been
over for COLLAR. A false warning is one told when nobody has warned within COLLAR.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.recording import LABELS, UNLABELLED, WARN
from fabric_perception.recognition import Debounced

COLLAR = 0.5  # s
TEN_MINUTES = 600.0  # s
AGREEING = 2  # percepts in a row, as the observation agent believes a gesture


@dataclass(frozen=True)
class Score:
    """Counts of one or more streams; add them up.

    confusion: (4, 4) frames, rows what was done, columns what was recognised. settled: the same
    without the collars. at_once: the same against what is done when it is said. warnings,
    recalled, false_warnings: events. labelled: s. delays: s from each change until it was
    believed, infinite where it never was. warning_delays: s, of the fast road.
    """

    confusion: Array
    settled: Array
    at_once: Array
    warnings: int
    recalled: int
    false_warnings: int
    labelled: float
    delays: tuple[float, ...]
    warning_delays: tuple[float, ...]

    def __add__(self, other: "Score") -> "Score":
        return Score(*(a + b for a, b in zip(self._parts(), other._parts(), strict=True)))

    def _parts(self) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name in self.__dataclass_fields__)

    def figures(self) -> dict[str, float]:
        """The numbers that goals are set for; NaN where there was nothing to count."""
        return {
            "accuracy": _share(np.trace(self.confusion), self.confusion.sum()),
            "accuracy_settled": _share(np.trace(self.settled), self.settled.sum()),
            "accuracy_at_once": _share(np.trace(self.at_once), self.at_once.sum()),
            "warning_recall": _share(self.recalled, self.warnings),
            "false_warnings_in_10_min": _share(self.false_warnings * TEN_MINUTES, self.labelled),
            "change_seen_median_s": _quantile(self.delays, 0.5),
            "change_seen_p90_s": _quantile(self.delays, 0.9),
            "changes_never_seen": _share(sum(np.isinf(self.delays)), len(self.delays)),
            "warning_seen_median_s": _quantile(self.warning_delays, 0.5),
        }


def score_stream(t: Array, labels: Array, posteriors: Array, told: Array, lag: int = 0) -> Score:
    """Judge posteriors (n, 4) at times t (n,) s by the labels (n,), UNLABELLED rows left out.

    told: (n,) whether the fast road told of a warning. lag: frames that posteriors lie back. Raises
    ValueError when lengths differ or fewer than 2 frames come.
    """
    if not len(t) == len(labels) == len(posteriors) == len(told) or len(t) < 2:
        raise ValueError(f"{len(t)} times, {len(labels)} labels and {len(posteriors)} posteriors")
    found = posteriors.argmax(axis=1)
    known = labels != UNLABELLED
    then = np.concatenate([np.full(min(lag, len(t)), UNLABELLED), labels[: max(0, len(t) - lag)]])
    stretches = _stretches(labels)
    late = np.zeros(len(t), dtype=bool)
    for first, _ in _stretches(then)[1:]:
        late |= (t >= t[first]) & (t < t[first] + COLLAR)
    warnings = [(t[a], t[b]) for a, b in stretches if labels[a] == WARN]
    delays = [_first(t[told], a, b + COLLAR) for a, b in warnings]
    return Score(
        confusion=_count(then, found),
        settled=_count(then[~late], found[~late]),
        at_once=_count(labels, found),
        warnings=len(warnings),
        recalled=int(np.isfinite(delays).sum()),
        false_warnings=sum(_unfounded(now, warnings) for now in t[told & known]),
        labelled=float(np.median(np.diff(t)) * known.sum()),
        delays=tuple(_believed(t, labels, found, stretches[1:])),
        warning_delays=tuple(delays),
    )


def total(scores: Iterable[Score]) -> Score:
    """The sum of the scores, one or more."""
    first, *rest = scores
    for score in rest:
        first = first + score
    return first


def confusion_table(confusion: Array) -> str:
    """A Markdown table of the shares of each row, %."""
    lines = ["| done \\ recognised | " + " | ".join(LABELS) + " | frames |"]
    lines.append("| --- |" + " --- |" * (len(LABELS) + 1))
    for name, row in zip(LABELS, confusion, strict=True):
        shares = " | ".join(f"{100.0 * _share(n, row.sum()):.1f}" for n in row)
        lines.append(f"| **{name}** | {shares} | {int(row.sum())} |")
    return "\n".join(lines)


def _stretches(labels: Array) -> list[tuple[int, int]]:
    """First and last index of each run of one label."""
    borders = np.flatnonzero(np.diff(labels)) + 1
    return list(zip([0, *borders], [*(borders - 1), len(labels) - 1], strict=True))


def _count(done: Array, found: Array) -> Array:
    """Frames (4, 4) by what was done and found; UNLABELLED ones do not count."""
    table, known = np.zeros((len(LABELS), len(LABELS))), done != UNLABELLED
    np.add.at(table, (done[known], found[known]), 1.0)
    return table


def _first(told: Sequence[float], start: float, end: float) -> float:
    """s from start to the first time told until end; infinite without one."""
    inside = [now - start for now in told if start <= now <= end]
    return float(inside[0]) if inside else np.inf


def _unfounded(now: float, warnings: Sequence[tuple[float, float]]) -> bool:
    return not any(start <= now <= end + COLLAR for start, end in warnings)


def _believed(
    t: Array, labels: Array, found: Array, stretches: Sequence[tuple[int, int]]
) -> list[float]:
    """s from each change to the moment when AGREEING readings in a row have said so."""
    gesture: Debounced[int] = Debounced(AGREEING)
    believed = []
    for reading in found:
        gesture.feed(int(reading))
        believed.append(gesture.value)
    said = np.array(believed)
    delays = []
    for first, last in stretches:
        if labels[first] != UNLABELLED:
            hits = np.flatnonzero(said[first : last + 1] == labels[first])
            delays.append(float(t[first + hits[0]] - t[first]) if len(hits) else np.inf)
    return delays


def _share(part: float, whole: float) -> float:
    return float(part / whole) if whole else float("nan")


def _quantile(values: Sequence[float], share: float) -> float:
    if not values:
        return float("nan")
    return float(sorted(values)[min(len(values) - 1, int(share * len(values)))])
