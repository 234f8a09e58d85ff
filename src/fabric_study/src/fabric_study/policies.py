# SPDX-License-Identifier: BSD-3-Clause
"""What can decide for the robot in a task, and which decision model that is.

A policy is `abps` (a model is selected for every task), `none` (human alone), a decision model
file, or the name of a model that lies in the folder of models as SCENARIO_NAME.pomdpx. Under
`on_call`, one of these names, a raised hand asks for help.
"""

from pathlib import Path

ABPS = "abps"
NONE = "none"
ON_CALL = "on_call"
MODEL_SUFFIXES = (".pomdpx", ".pomdp")


def policy_names(scenario: str, models: Path) -> list[str]:
    """Return the names of the policies for a scenario, `none` among them."""
    prefix = f"{scenario}_"
    named = sorted(path.stem.removeprefix(prefix) for path in models.glob(f"{prefix}*.pomdpx"))
    return [*named, NONE]


def model_path(policy: str, scenario: str, models: Path) -> Path:
    """Return the decision model of a policy other than abps.

    Raises ValueError naming the policy and what there is in its place.
    """
    if policy.lower().endswith(MODEL_SUFFIXES):
        if not Path(policy).is_file():
            raise ValueError(f"policy {policy}: there is no such model file")
        return Path(policy)
    names = policy_names(scenario, models)
    if policy not in names:
        raise ValueError(
            f"policy {policy!r} is none of {', '.join([ABPS, *names])} and no model file"
        )
    return models / (f"{NONE}.pomdpx" if policy == NONE else f"{scenario}_{policy}.pomdpx")
