# SPDX-License-Identifier: BSD-3-Clause
"""The vocabulary of FABRIC: messages, services, actions, and how a node counts its traffic."""

from fabric_msgs.compiled import use

use(__name__, __path__)
