# SPDX-License-Identifier: BSD-3-Clause
"""Damaged frames do not throw the emulator off; `./fabric emulator --fuzz 1000000` tries more."""

import pytest

from fabric_dobot_driver.emulator.fuzz import BATCH, GOOD, fuzz

COUNT = 10_000


@pytest.mark.parametrize("seed", [111, 112])
def test_damaged_frames_cause_no_exception_and_good_ones_are_answered_in_between(seed):
    report = fuzz(COUNT, seed)
    assert report.damaged == COUNT
    assert report.asked == len(GOOD) * COUNT // BATCH
    assert 0 < report.answered <= report.taken < COUNT // 2
