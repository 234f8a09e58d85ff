# SPDX-License-Identifier: BSD-3-Clause
"""Candidate models for the library (5.2.2.1): the base model with its dials turned, and solved.

A candidate's file is the base model's with other numbers in its transition and its observation
function. Variables, initial belief and reward are copied as they are written.
"""

import re
from pathlib import Path

import numpy as np

import fabric_planner as fp
from fabric_abps.dials import Setting

DIGITS = 5  # of a chance in a file
WORK = 1e9  # multiplications that solving a candidate may take, half a second or so
TIME = 600.0  # s of CPU time; a guard, the work ends before
GAP = 0.01  # upper minus lower bound that is good enough


class CandidateError(ValueError):
    """A model that cannot be varied, or a candidate that means nothing; names file and element."""


class BaseModel:
    """The model that candidates are drawn around."""

    def __init__(self, path: Path) -> None:
        """Raises ModelError when the file is no model, CandidateError naming what it lacks."""
        self.path = path
        self.model = fp.load(path)
        self._text = path.read_text(encoding="utf-8")
        for element in ("Description", "StateTransitionFunction", "ObsFunction", "RewardFunction"):
            found = len(re.findall(rf"<{element}>.*?</{element}>", self._text, re.DOTALL))
            if found != 1:
                raise CandidateError(f"{path}: has {found} elements {element}, must have one")

    def text(self, setting: Setting, description: str) -> str:
        """The POMDPX file of a candidate; description must not need escapes in XML."""
        model = self.model
        T = setting.transition(model.states, model.actions, model.transition)
        O = setting.observation(model.states, model.terminal, model.observation)  # noqa: E741
        text = self._replaced(self._text, "Description", description)
        text = self._with_rows(text, "StateTransitionFunction", T)
        return self._with_rows(text, "ObsFunction", O)

    def _with_rows(self, text: str, element: str, table: np.ndarray) -> str:
        old = re.search(rf"<{element}>(.*?)<Parameter type=\"TBL\">", text, re.DOTALL)
        if old is None:
            raise CandidateError(f"{self.path}: {element} is no table")
        same = bool((table == table[:1]).all())
        names = ["*"] if same else self.model.actions
        lines = [
            f"        <Entry><Instance>{action} {state} -</Instance>"
            f"<ProbTable>{_row(row)}</ProbTable></Entry>"
            for action, rows in zip(names, table[: len(names)], strict=True)
            for state, row in zip(self.model.states, rows, strict=True)
        ]
        head = f'{old.group(1)}<Parameter type="TBL">\n'
        tail = "\n      </Parameter>\n    </CondProb>\n  "
        return self._replaced(text, element, head + "\n".join(lines) + tail)

    def _replaced(self, text: str, element: str, content: str) -> str:
        pattern = re.compile(rf"<{element}>.*?</{element}>", re.DOTALL)
        return pattern.sub(lambda _: f"<{element}>{content}</{element}>", text, count=1)

    def check(self, model: fp.Pomdp, where: str) -> None:
        """Raises CandidateError naming what the model checker finds and not in the base model."""
        known = {(finding.kind, tuple(finding.places)) for finding in fp.lint(self.model)}
        fresh = [
            finding.sentence
            for finding in fp.lint(model)
            if finding.severity != "info" and (finding.kind, tuple(finding.places)) not in known
        ]
        if fresh:
            raise CandidateError(f"{where}: " + "; ".join(fresh))


def _row(row: np.ndarray) -> str:
    """A row to DIGITS digits; what rounding leaves over goes to the largest, so it sums to 1."""
    units = np.round(row * 10**DIGITS).astype(int)
    units[units.argmax()] += 10**DIGITS - units.sum()
    return " ".join(f"{unit / 10**DIGITS:.{DIGITS}g}" for unit in units)


def solve(model: fp.Pomdp) -> fp.AlphaVectors:
    """Solve a candidate; equal on every machine."""
    return fp.solve(model, time=TIME, gap=GAP, work=WORK).lower
