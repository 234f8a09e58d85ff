# SPDX-License-Identifier: BSD-3-Clause
"""What the page server asks of the study behind it, and what a page may ask of the server."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from fabric_study.web.access import Role

LARGEST_TEXT = 4000  # characters of an answer or a note
LARGEST_NUMBER = 1_000_000


class Refused(Exception):
    """A request that cannot be granted; the text is a sentence for whoever asked.

    status: of the answer, 409 when the request came at the wrong moment, 400 when it is malformed.
    """

    def __init__(self, sentence: str, status: int = 409) -> None:
        super().__init__(sentence)
        self.status = status


class Desk(Protocol):
    """What stands behind the pages.

    Besides these two, one method for each entry of COMMANDS, with its fields as arguments; it
    returns something for JSON or an awaitable of it, and raises Refused or ValueError.
    """

    def participant(self) -> Mapping[str, Any]:
        """Return what the participant may see, by section, ready for JSON."""

    def console(self) -> Mapping[str, Any]:
        """Return what the experimenter sees, by section, ready for JSON."""


@dataclass(frozen=True)
class Command:
    """One thing that a page may ask for: by whom, and with which fields of which types."""

    role: Role
    fields: Mapping[str, tuple[type, ...]] = field(default_factory=dict)


ANSWER = (str, int, float, type(None))
COMMANDS: Mapping[str, Command] = {
    # person and step: those that the page shows, so that nothing is done to somebody or something
    # that came later
    "answer": Command(
        Role.PARTICIPANT, {"person": (str,), "step": (str,), "item": (str,), "value": ANSWER}
    ),
    "finish_step": Command(Role.PARTICIPANT, {"step": (str,), "accept_missing": (bool,)}),
    "ready": Command(Role.PARTICIPANT, {"step": (str,)}),
    "open_visit": Command(Role.EXPERIMENTER, {"index": (int,), "language": (str,)}),
    "continue_visit": Command(Role.EXPERIMENTER, {"person": (str,), "language": (str,)}),
    "begin_task": Command(Role.EXPERIMENTER, {"step": (str,)}),
    "abort_task": Command(Role.EXPERIMENTER, {"reason": (str,)}),
    "set_auto_start": Command(Role.EXPERIMENTER, {"on": (bool,)}),
    "pause": Command(Role.EXPERIMENTER),
    "resume": Command(Role.EXPERIMENTER),
    "abort_visit": Command(Role.EXPERIMENTER, {"reason": (str,)}),
    "note": Command(Role.EXPERIMENTER, {"text": (str,)}),
    "stop": Command(Role.EXPERIMENTER),
    "release": Command(Role.EXPERIMENTER),
    "call": Command(Role.PARTICIPANT),
}


def parsed(command: Command, body: bytes) -> dict[str, Any]:
    """Return the fields in a request's body (JSON), checked.

    Raises Refused (400) naming the field and what it must be.
    """
    try:
        content = json.loads(body.decode("utf-8"), parse_constant=_not_finite)
    except (ValueError, RecursionError) as error:
        raise Refused(f"The request is not JSON: {error}.", 400) from None
    if not isinstance(content, dict):
        raise Refused("The request must be a JSON object.", 400)
    for name in content:
        if name not in command.fields:
            raise Refused(f"The request has a field '{name:.40}' that is not known.", 400)
    for name, types in command.fields.items():
        if name not in content:
            raise Refused(f"The request lacks the field '{name}'.", 400)
        _check(name, content[name], types)
    return content


def _check(name: str, value: Any, types: tuple[type, ...]) -> None:
    if type(value) not in types:  # a bool is no number here
        allowed = " or ".join(WORDS[kind] for kind in types)
        raise Refused(f"The field '{name}' must be {allowed}.", 400)
    if isinstance(value, str) and len(value) > LARGEST_TEXT:
        raise Refused(f"The field '{name}' is longer than {LARGEST_TEXT} characters.", 400)
    if isinstance(value, (int, float)) and abs(value) > LARGEST_NUMBER:
        raise Refused(f"The field '{name}' is beyond {LARGEST_NUMBER}.", 400)


WORDS = {
    str: "a text",
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    type(None): "null",
}


def _not_finite(text: str) -> None:
    raise ValueError(f"{text} is no number")
