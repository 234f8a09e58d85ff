# SPDX-License-Identifier: BSD-3-Clause
"""What a run tells the person who started it: one line a task."""

from fabric_study.results import Row

OUTCOMES = {1: "success", 0: "failure", None: "aborted"}


def progress_line(row: Row, total: int) -> str:
    """Return the line of a task that has just been recorded."""
    done = (
        f"person {row['human_succeeded']} right {row['human_failed']} wrong, "
        f"robot {row['robot_succeeded']} right {row['robot_failed']} wrong"
    )
    return (
        f"task {row['task']}/{total}  {OUTCOMES[row['success']]}  "  # type: ignore[index]
        f"reward {row['discounted_reward']:6.2f}  warnings {row['warnings']}  "
        f"{row['duration_s']:6.1f} s  {row['decisions']:3} decisions  "
        f"{done}  ({row['human']}, {row['model']})"
    )
