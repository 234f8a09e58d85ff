# SPDX-License-Identifier: BSD-3-Clause
"""What the simulated worker wants at this moment, read from the cell's truth."""

from fabric_msgs.msg import Container
from fabric_sim.camera.motion import Intent
from fabric_sim.cell import Cell
from fabric_sim.geometry import Point


def intent_of(cell: Cell) -> Intent:
    """Return what moves the person in the cell's present tick. Draws nothing."""
    worker = cell.worker
    return Intent(
        behaviour=cell.behaviour,
        walking=worker.action == "walk_away",
        holding=cell.stock.held_by_person is not None,
        goal=_goal(cell),
        deadline=worker.next_deed,
        episode=cell.episode,
    )


def _goal(cell: Cell) -> Point | None:
    """The floor's middle of the tray in which the cube in the hand will lie, m in the cell."""
    label = cell.worker.intended_tray()
    if label is None:
        return None
    mine = (tray for tray in cell.stock.trays if tray.owner == Container.OWNER_PERSON)
    return next((tray.floor for tray in mine if tray.label == label), None)
