# SPDX-License-Identifier: BSD-3-Clause
"""Where a real camera is, and how it projects, from pictures of a printed board."""
