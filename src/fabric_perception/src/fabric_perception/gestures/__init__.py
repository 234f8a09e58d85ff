# SPDX-License-Identifier: BSD-3-Clause
"""Gestures: one GMM-HMM a class, for any multivariate sequences, scored frame by frame."""
