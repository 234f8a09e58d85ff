# SPDX-License-Identifier: BSD-3-Clause
"""Where the person's head points, from markers on a helmet (thesis 6.2.3.4, Fig. 6.8)."""
