# SPDX-License-Identifier: BSD-3-Clause
"""The cell as cameras see it: how a person moves, what is rendered, what noise comes on top."""
