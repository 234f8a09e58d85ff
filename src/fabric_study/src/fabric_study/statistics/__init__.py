# SPDX-License-Identifier: BSD-3-Clause
"""Statistics of studies in which every person meets every condition.

`compare.compare` chooses the tests; docs/statistics.md says which and why.
"""
