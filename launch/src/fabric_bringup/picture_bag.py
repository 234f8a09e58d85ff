# SPDX-License-Identifier: BSD-3-Clause
"""Whether a bag holds pictures, for `./fabric replay`; ROS' reader of bags is needed when asked.

`python3 -m fabric_bringup.picture_bag pictures|observations FILE [name:=value ...]` ends with 0 for
yes, 1 for no, 2 with a line on stderr when the bag cannot be read.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from fabric_perception.picture_replay import PictureReplayError, holds_pictures, parse_names


def topics_of(file: str) -> list[str]:
    """Names of all topics of a bag with messages; raises OSError or rosbag's errors."""
    import rosbag

    with rosbag.Bag(file) as bag:
        return list(bag.get_type_and_topic_info().topics)


def main(arguments: Sequence[str]) -> int:
    """The answer as an exit code."""
    import rosbag

    question, file, *words = arguments
    names = dict(word.split(":=", 1) for word in words).get("names", "")
    try:
        topics = topics_of(file)
        if question == "pictures":
            return 0 if holds_pictures(topics, parse_names(names)) else 1
        return 0 if any(topic.strip("/") == "observation" for topic in topics) else 1
    except (OSError, rosbag.ROSBagException, PictureReplayError) as error:
        print(f"fabric: {file}: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
