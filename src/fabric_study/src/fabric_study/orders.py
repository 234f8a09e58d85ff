# SPDX-License-Identifier: BSD-3-Clause
"""In which order people meet the conditions of a study."""

import itertools
import random
from collections.abc import Sequence

ORDERS = ("fixed", "latin_square", "balanced", "random")
MOST_BALANCED = 5  # conditions of which all orders, 120, can still be used up


def williams_rows(n: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a Latin square of 0..n-1 that is balanced for what comes before.

    Each number stands equally often at each place, and each follows each other one equally often:
    n rows when n is even, 2 n when it is odd (Williams, 1949).
    """
    first = [0]
    for step in range(1, n):
        first.append((first[-1] + (step if step % 2 else n - step)) % n)
    rows = [tuple((value + shift) % n for value in first) for shift in range(n)]
    if n % 2 and n > 1:
        rows += [row[::-1] for row in rows]
    return tuple(rows)


def condition_order(kind: str, conditions: Sequence[str], place: int, seed: int) -> tuple[str, ...]:
    """Return the conditions as they come when an order is asked for, the first time at place 0.

    Every block of places - n or 2 n for `latin_square`, n! for `balanced` - holds each order once;
    the blocks are shuffled by the seed of the study.
    """
    if kind == "fixed":
        return tuple(conditions)
    if kind == "random":
        shuffled = list(conditions)
        random.Random(f"{seed}/order/{place}").shuffle(shuffled)
        return tuple(shuffled)
    letters = list(conditions)
    if kind == "latin_square":
        random.Random(f"{seed}/letters").shuffle(letters)
        rows = list(williams_rows(len(letters)))
    else:
        rows = list(itertools.permutations(range(len(letters))))
    block, row = divmod(place, len(rows))
    random.Random(f"{seed}/order/{block}").shuffle(rows)
    return tuple(letters[index] for index in rows[row])
