# SPDX-License-Identifier: BSD-3-Clause
"""The decision of FABRIC: tabular POMDPs, beliefs, bounds and an anytime planner."""
