# SPDX-License-Identifier: BSD-3-Clause
"""Codes that stand for people: random, easy to read aloud, never a word."""

import random
import re
from collections.abc import Collection

LETTERS = "CDFGHJKMNPQRTVWXY2346789"  # no vowels; none that looks like another: B8 I1 L1 O0 S5 Z2
LENGTH = 6
CODE = re.compile(f"[{LETTERS}]{{{LENGTH}}}")
TRIES = 1000


def new_code(taken: Collection[str], rng: random.Random) -> str:
    """Return a code that is not among those taken.

    `rng` is a `random.SystemRandom()` for people, a seeded one for simulated people.
    Raises RuntimeError when chance brings nothing but codes that are taken.
    """
    for _ in range(TRIES):
        code = "".join(rng.choices(LETTERS, k=LENGTH))
        if code not in taken:
            return code
    raise RuntimeError(f"no code is left; {len(taken)} are taken")
