# SPDX-License-Identifier: BSD-3-Clause
"""What a sequence must be before anything is learnt from it or said about it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def check_sequence(sequence: Any, width: int | None = None, name: str = "sequence") -> Array:
    """Return the sequence as floats (frames, width), one frame or more.

    Raises ValueError naming the sequence, and the frame and column of what is not finite.
    """
    try:
        array = np.asarray(sequence, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is not a table of numbers: {error}") from None
    if array.ndim != 2:
        raise ValueError(f"{name} has shape {array.shape}; it must be (frames, features)")
    if array.shape[0] == 0:
        raise ValueError(f"{name} is empty")
    if width is not None and array.shape[1] != width:
        raise ValueError(f"{name} has {array.shape[1]} features a frame; the model has {width}")
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        frame, column = wrong[0]
        raise ValueError(f"{name} frame {frame} feature {column} is {array[frame, column]}")
    return array


def check_sequences(sequences: Sequence[Any], labels: Sequence[Any]) -> list[Array]:
    """Return the sequences as arrays (frames, width) of one width.

    Raises ValueError when numbers of sequences and labels differ, or naming a bad sequence.
    """
    if len(sequences) != len(labels):
        raise ValueError(f"there are {len(sequences)} sequences but {len(labels)} labels")
    if len(sequences) == 0:
        raise ValueError("there are no sequences")
    first = check_sequence(sequences[0], name="sequence 0")
    width = first.shape[1]
    if width == 0:
        raise ValueError("sequence 0 has no features")
    rest = enumerate(sequences[1:], 1)
    return [first, *(check_sequence(item, width, f"sequence {i}") for i, item in rest)]
