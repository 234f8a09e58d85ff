# SPDX-License-Identifier: BSD-3-Clause
"""Studies rehearsed by simulated people: whole protocols, with answers, at accelerated time."""
