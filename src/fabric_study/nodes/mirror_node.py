#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the mirror: copies the records of a study into a database that cells share."""

import sys
import threading
from pathlib import Path

import rospy

from fabric_study.store import StoreError
from fabric_study.store_mirror import Mirror, MirrorError
from fabric_study.study_folder import STUDY_FILE, read_study

REMIND = 600.0  # s between warnings of the same kind


class MirrorNode:
    """Looks for new records every few seconds. A database that is away holds nobody up."""

    def __init__(self, folder: Path, database: str) -> None:
        self._folder = folder
        self._database = database
        self._mirror: Mirror | None = None
        self._away = False

    def look(self) -> None:
        """Copy what is new; say when the database is away, and when it is back.

        Raises ValueError for an address that cannot be meant.
        """
        try:
            copied = self._opened().catch_up() if (self._folder / STUDY_FILE).exists() else 0
        except (MirrorError, StoreError) as error:
            rospy.logwarn_throttle_identical(REMIND, f"mirror: {error}")
            self._away = True
            return
        if self._away:
            rospy.loginfo(f"mirror: the database is back; {copied} records were missing there")
        self._away = False

    def _opened(self) -> Mirror:
        if self._mirror is None:
            self._mirror = Mirror(self._database, self._folder, read_study(self._folder))
        return self._mirror


def main() -> int:
    """Run until shutdown (0), and look once more then; 2 for an address that cannot be meant.

    Parameters: ~study (folder), ~database (address), ~period (s of wall time between looks).
    """
    rospy.init_node("mirror")
    node = MirrorNode(Path(rospy.get_param("~study")), str(rospy.get_param("~database")))
    period = float(rospy.get_param("~period"))
    closing = threading.Event()
    rospy.on_shutdown(closing.set)
    try:
        while not closing.is_set():
            node.look()
            closing.wait(period)
        node.look()
    except ValueError as error:
        rospy.logfatal("mirror: %s", error)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
