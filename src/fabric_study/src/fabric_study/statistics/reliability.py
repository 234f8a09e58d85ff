# SPDX-License-Identifier: BSD-3-Clause
"""Do the statements of a scale measure one thing?"""

import numpy as np
from numpy.typing import ArrayLike

from fabric_study.statistics.outcome import NoResult


def cronbach_alpha(answers: ArrayLike) -> float | NoResult:
    """Return Cronbach's alpha of answers (n_people, n_items); people with a NaN are left out.

    Statements of opposite sense have to be reversed before.
    """
    table = np.asarray(answers, float)
    if table.ndim != 2:
        raise ValueError(f"answers must be people by items, they have shape {table.shape}")
    table = table[~np.isnan(table).any(axis=1)]
    n, items = table.shape
    if n < 2 or items < 2:
        return NoResult("Cronbach's alpha", f"needs two people and two items; has {n} and {items}")
    total = float(table.sum(axis=1).var(ddof=1))
    if total <= 0.0:
        return NoResult("Cronbach's alpha", "the sums of all people are equal")
    return items / (items - 1) * (1.0 - float(table.var(axis=0, ddof=1).sum()) / total)
