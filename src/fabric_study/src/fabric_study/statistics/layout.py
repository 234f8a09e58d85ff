# SPDX-License-Identifier: BSD-3-Clause
"""From rows of a study to one number a person and condition."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

KEYS = ("person", "condition")


def rows_of(frame: pd.DataFrame, value: str, conditions: Sequence[str]) -> pd.DataFrame:
    """Return the rows of these conditions with a defined value: person, condition, value, number.

    `value` names the column. Raises ValueError for columns that are missing, for values that are
    not numbers and for infinity, naming the first row.
    """
    missing = [name for name in (*KEYS, value) if name not in frame.columns]
    if missing:
        raise ValueError(f"the table has no column {', '.join(missing)}")
    chosen = frame[frame["condition"].isin(list(conditions))]
    try:
        numbers = pd.to_numeric(chosen[value]).astype(float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{value} holds what is not a number: {error}") from error
    if np.isinf(numbers).any():
        raise ValueError(f"{value} is infinite in row {numbers.index[np.isinf(numbers)][0]}")
    rows = chosen[list(KEYS)].assign(value=numbers)
    rows["number"] = chosen["number"].astype(float) if "number" in chosen else 0.0
    return rows[rows["value"].notna()]


def person_means(rows: pd.DataFrame, conditions: Sequence[str]) -> pd.DataFrame:
    """Return the mean of each person in each condition, NaN where there is no row.

    rows: of `rows_of`. One line a person, sorted by code; one column a condition, in their order.
    """
    means = rows.pivot_table(index="person", columns="condition", values="value", aggfunc="mean")
    return means.reindex(columns=list(conditions)).sort_index()


def split_complete(table: pd.DataFrame) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return the people with a value in every condition, and the codes of the others."""
    complete = table.notna().all(axis=1)
    return table[complete], tuple(str(code) for code in table.index[~complete])
