# SPDX-License-Identifier: BSD-3-Clause
"""Checks of what was kept of a person: plain values that may have been damaged meanwhile."""

import numpy as np
from numpy.typing import NDArray


def whole(name: str, value: object) -> int:
    """The value, which must be a whole number >= 0; raises ValueError naming it."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"{name} must be a whole number >= 0, got {value!r}")
    return value


def rows(name: str, value: object, length: int) -> NDArray:
    """The rows of a table, (n_rows, length); none is a table, too. Raises ValueError naming it."""
    try:
        table = np.asarray(value, dtype=float)
    except (ValueError, TypeError, OverflowError) as error:
        raise ValueError(f"{name} must be rows of {length} numbers: {error}") from error
    if table.size == 0:
        return np.empty((0, length))
    if table.ndim != 2 or table.shape[1] != length:
        raise ValueError(f"{name} must be rows of {length} numbers, got shape {table.shape}")
    return table
