# SPDX-License-Identifier: BSD-3-Clause
"""Who may see and change what: two tokens, each opens one page and is then kept as a cookie.

The address that the server prints carries the token; the first visit turns it into a cookie that no
script can read and no other site can send. Participants can only answer and confirm.
"""

import hmac
import ipaddress
import json
import os
import secrets
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from urllib.parse import urlsplit

LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")
TOKEN_BYTES = 24


class Role(IntEnum):
    """What a visitor may do; a higher role may do what the lower ones may."""

    NOBODY = 0
    PARTICIPANT = 1
    EXPERIMENTER = 2


@dataclass(frozen=True)
class Keys:
    """The tokens of the two pages."""

    participant: str
    experimenter: str

    def role(self, token: str) -> Role:
        """Return the role a token gives; compares in constant time."""
        if hmac.compare_digest(token.encode(), self.experimenter.encode()):
            return Role.EXPERIMENTER
        if hmac.compare_digest(token.encode(), self.participant.encode()):
            return Role.PARTICIPANT
        return Role.NOBODY


def new_keys() -> Keys:
    """Return two fresh tokens."""
    return Keys(secrets.token_urlsafe(TOKEN_BYTES), secrets.token_urlsafe(TOKEN_BYTES))


def kept_keys(path: Path) -> Keys:
    """Return the tokens in a file that only its owner may read; make it when there is none.

    Pages that were open before a restart come back by themselves. A file that cannot be meant, or
    that others may read, is replaced by one with fresh tokens.
    """
    try:
        if path.stat().st_mode & 0o077 == 0:
            return Keys(
                **{name: _token(text) for name, text in json.loads(path.read_text()).items()}
            )
    except (OSError, ValueError, TypeError, AttributeError):
        pass
    keys = new_keys()
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_suffix(".tmp")
    scratch.unlink(missing_ok=True)
    with open(os.open(scratch, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w") as file:
        json.dump(vars(keys), file)
    os.replace(scratch, path)
    return keys


def _token(text: object) -> str:
    if not isinstance(text, str) or len(text) < TOKEN_BYTES:
        raise ValueError("no token")
    return text


def is_loopback(address: str) -> bool:
    """Say whether an address to listen on can be reached from this machine only."""
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


def host_allowed(address: str, host: str) -> bool:
    """Say whether a request may name this `Host` when the server listens on `address`.

    On loopback only names of this machine: another site that lets its own name point here is
    refused. Elsewhere the cookies, which belong to one name, are what keeps such a site out.
    """
    return not is_loopback(address) or urlsplit(f"//{host}").hostname in LOOPBACK_NAMES
