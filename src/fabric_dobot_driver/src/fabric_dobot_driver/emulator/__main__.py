# SPDX-License-Identifier: BSD-3-Clause
"""A virtual Dobot Magician on a pseudo-terminal: python3 -m fabric_dobot_driver.emulator."""

import argparse
import dataclasses
import math
import os
import signal
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import NoReturn

from fabric_dobot_driver.emulator.emulator import Emulator, tell
from fabric_dobot_driver.emulator.fuzz import fuzz
from fabric_dobot_driver.emulator.settings import Settings
from fabric_dobot_driver.emulator.words import WORDS, parse_script

CONFORMANCE = Path(__file__).resolve().parents[3] / "conformance"


def main(words: list[str] | None = None) -> int:
    """Runs the emulator, or tells a running one something; the exit code."""
    args = _parser().parse_args(words)
    try:
        if args.tell is not None:
            return _tell(args)
        if args.fuzz is not None:
            return _fuzz(args)
        if args.conformance is not None:
            _conformance(args.conformance)
        return _run(args)
    except (OSError, ValueError) as error:
        print(f"emulator: {error}", file=sys.stderr)
        return 2


def _run(args: argparse.Namespace) -> int:
    script = parse_script(args.faults, "--faults")
    if args.script is not None:
        script += parse_script(args.script.read_text(encoding="utf-8"), str(args.script))
    settings = dataclasses.replace(
        Settings(), home_time=args.home_time, pulses_per_mm=args.pulses_per_mm
    )
    with ExitStack() as stack:
        log = None
        if args.log is not None:
            log = stack.enter_context(args.log.open("w", buffering=1, encoding="utf-8"))
        emulator = Emulator(
            args.link,
            settings,
            seed=args.seed,
            speed=args.speed,
            script=sorted(script),
            log=log,
            announce=lambda path: print(path, flush=True),
        )
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: emulator.stop())
        emulator.run()
    return 0


def _tell(args: argparse.Namespace) -> int:
    if args.link is None:
        raise ValueError("--tell wants the --link of the emulator that is meant")
    answer = tell(args.link, args.tell)
    print(answer)
    return 1 if answer.startswith("error") else 0


def _fuzz(args: argparse.Namespace) -> int:
    for name, value in fuzz(args.fuzz, args.seed)._asdict().items():
        print(f"{name:9} {value:.3f}" if isinstance(value, float) else f"{name:9} {value}")
    return 0


def _conformance(clients: list[str]) -> NoReturn:
    if not CONFORMANCE.is_dir():
        raise ValueError(f"{CONFORMANCE} is not there: --conformance wants the source tree")
    os.execv(sys.executable, [sys.executable, str(CONFORMANCE), *clients])


def _parser() -> argparse.ArgumentParser:
    rows = [f"  {name + ' ' + word.usage:22} {word.help}" for name, word in WORDS.items()]
    parser = argparse.ArgumentParser(
        prog="./fabric emulator",
        description="A virtual Dobot Magician on a pseudo-terminal, whose path is printed first.",
        epilog="words:\n" + "\n".join(rows),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add(
        "--link",
        type=Path,
        help="a symbolic link that always leads to the port; with it, "
        "words are taken at the socket LINK.control",
    )
    add("--seed", type=int, default=0, help="of everything random")
    add("--speed", type=_positive, default=1.0, help="how much faster than real time")
    add("--faults", default="", metavar="SPEC", help='words at times: "5: silence 2; 9: unplug 3"')
    add("--script", type=Path, metavar="FILE", help="the same from a file, one entry a line")
    add("--log", type=Path, metavar="FILE", help="one JSON line for each frame and event")
    add(
        "--home-time",
        type=_positive,
        default=Settings.home_time,
        metavar="S",
        help="how long homing takes (default %(default)s)",
    )
    add(
        "--pulses-per-mm",
        type=_positive,
        default=Settings.pulses_per_mm,
        metavar="N",
        help="of the belt (default %(default)s)",
    )
    add("--tell", metavar="WORDS", help="say words to the emulator that runs at LINK, and end")
    add("--fuzz", type=int, metavar="N", help="send N damaged frames to an arm in virtual time")
    add(
        "--conformance",
        nargs="*",
        metavar="CLIENT",
        help="run public clients against the emulator and print a table of times",
    )
    return parser


def _positive(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{text}, want a positive number")
    return value


if __name__ == "__main__":
    sys.exit(main())
