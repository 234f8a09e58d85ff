# SPDX-License-Identifier: BSD-3-Clause
"""The vocabulary of FABRIC: messages, services, actions, and how a node counts its traffic."""
