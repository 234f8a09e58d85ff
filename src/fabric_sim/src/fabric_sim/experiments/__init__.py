# SPDX-License-Identifier: BSD-3-Clause
"""Published experiments, rerun with the simulated cell; `./fabric experiment NAME`."""
