# SPDX-License-Identifier: BSD-3-Clause
"""The page server of a study: the participant's screen and the experimenter's console."""
