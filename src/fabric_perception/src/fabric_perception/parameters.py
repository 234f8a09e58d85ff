# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the observation agent: one place for unit, range and default."""

from dataclasses import dataclass

from fabric_msgs.settings import check_settings, setting


@dataclass(frozen=True)
class ObservationParameters:
    """How percepts become observations (Fig. 6.5); raises ValueError naming a bad value."""

    same_action_timeout: float = setting(
        3.0, "s", 0.1, 60.0, "an observation is due this long after the last one (6.3.1.3)"
    )
    action_threshold: float = setting(
        0.5, "1", 0.25, 1.0, "a gesture counts only with at least this posterior probability"
    )
    action_percepts: int = setting(
        2, "percepts", 1, 20, "equal percepts in a row before another gesture is believed"
    )
    detection_percepts: int = setting(
        2, "percepts", 1, 50, "percepts in a row before the person counts as come or gone"
    )
    head_percepts: int = setting(
        2, "percepts", 1, 50, "percepts in a row before looking around begins or ends"
    )
    warning_hold: float = setting(
        1.0, "s", 0.0, 10.0, "a warning told by the fast road lasts at least this long"
    )
    settling_time: float = setting(
        2.0, "s", 0.0, 10.0, "time for a placement to be reported before an attempt has failed"
    )
    evidence_age_limit: float = setting(
        1.0, "s", 0.1, 10.0, "gesture evidence older than this is not used"
    )
    pairing_tolerance: float = setting(
        0.0, "s", 0.0, 0.5, "hands and head seen so far apart are of one moment; 0: equal stamps"
    )
    joint_percepts: int = setting(
        1, "percepts", 1, 20, "in a row with the same hands and head before either has changed"
    )

    def __post_init__(self) -> None:
        check_settings(self)
