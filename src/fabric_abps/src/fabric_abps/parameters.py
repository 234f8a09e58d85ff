# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the selector."""

from dataclasses import dataclass, fields

from fabric_abps.criteria import CRITERIA

KINDS = {str: "text", float: "a number", int: "a whole number", bool: "true or false"}


@dataclass(frozen=True)
class SelectorParameters:
    """How the selector learns and chooses; unless told, as in config/selector.yaml."""

    criterion: str = "greedy"  # a name in CRITERIA, or fixed
    fixed_policy: str = ""  # only with criterion fixed
    forgetting: float = 0.02  # probability that the person changes before a task, [0, 1)
    floor: float = 1e-4  # least belief in a type, (0, 1/n_types)
    effective_observations: float = 12.0  # a task weighs like at most so many, > 0
    change_rate: float = 0.05  # false alarms a task of the change detection, [0, 1); 0 is without
    change_window: int = 10  # tasks ago that a change is looked for, >= 1
    alarm_rate: float = 0.01  # of the flag "unlike anyone known" for a known person, (0, 1)
    alarm_window: int = 3  # tasks the flag looks back on, >= 1
    switch_inside: bool = False  # whether the policy may change inside a task
    switch_margin: float = 0.25  # points that a change inside a task must promise, >= 0

    @classmethod
    def load(cls, values: dict) -> "SelectorParameters":
        """From a dictionary of all fields, as a robot's configuration.

        Raises ValueError naming a field that is missing, unknown or of another kind, or a criterion
        that needs what only an experiment knows.
        """
        if not isinstance(values, dict):
            raise ValueError(f"parameters must be a mapping from names to values, got {values!r}")
        kinds = {field.name: type(field.default) for field in fields(cls)}
        for name in values:
            if name not in kinds:
                raise ValueError(f"parameter '{name}' is unknown")
        for name, kind in kinds.items():
            if name not in values:
                raise ValueError(f"parameter '{name}' is missing")
            _check_kind(name, values[name], kind)
        criterion = CRITERIA.get(values["criterion"])
        if criterion is not None and criterion().told_by_experiments:
            raise ValueError(
                f"criterion '{values['criterion']}' learns from what only an experiment can tell"
            )
        return cls(**values)

    def __post_init__(self) -> None:
        if not self.effective_observations > 0:
            raise ValueError(f"effective_observations must be > 0: {self.effective_observations}")
        if not 0 < self.alarm_rate < 1:
            raise ValueError(f"alarm_rate must be in (0, 1): {self.alarm_rate}")
        if not (isinstance(self.alarm_window, int) and self.alarm_window >= 1):
            raise ValueError(f"alarm_window must be a whole number >= 1: {self.alarm_window}")
        if not isinstance(self.switch_inside, bool):
            raise ValueError(f"switch_inside must be true or false: {self.switch_inside}")
        if not 0 <= self.switch_margin < float("inf"):
            raise ValueError(f"switch_margin must be >= 0 and finite: {self.switch_margin}")


def _check_kind(name: str, value: object, kind: type) -> None:
    """Raises ValueError unless the value is of the kind; a whole number is a number, too."""
    allowed = (int, float) if kind is float else kind
    if not isinstance(value, allowed) or isinstance(value, bool) != (kind is bool):
        raise ValueError(f"parameter '{name}' must be {KINDS[kind]}, got {value!r}")
