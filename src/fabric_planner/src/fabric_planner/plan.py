# SPDX-License-Identifier: BSD-3-Clause
"""Solves, evaluates, queries, checks and converts models: `./fabric plan MODEL [...] [--json]`.

Exit code 0 with the answer on stdout; 1 when --lint found errors; 2 with one line on stderr that
names what is wrong: an option, the file or the belief.
"""

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

import fabric_planner as fp
from fabric_planner.plan_jobs import run
from fabric_planner.plan_query import find_model


class OneLineParser(argparse.ArgumentParser):
    """Tells a bad option in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def seconds(text: str) -> float:
    value = float(text)
    if not math.isfinite(value) or value <= 0.0:
        raise argparse.ArgumentTypeError(f"'{text}' is no positive number of seconds")
    return value


def at_least(least: int) -> Callable[[str], int]:
    def count(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"'{text}' is less than {least}")
        return value

    return count


def parser() -> argparse.ArgumentParser:
    result = OneLineParser(prog="fabric plan", description=__doc__.split("\n")[0])
    result.add_argument("model", metavar="MODEL", help="a file or a shipped model's name")
    result.add_argument(
        "--normalise", action="store_true", help="rescale rows that do not sum to 1"
    )
    result.add_argument("--json", action="store_true", help="print one JSON object")
    _add_query(result.add_argument_group("what to do at a belief (the default)"))
    _add_solve(result.add_argument_group("solve offline"))
    _add_evaluate(result.add_argument_group("measure a policy"))
    _add_files(result.add_argument_group("check and convert"))
    return result


def _add_query(group: argparse._ArgumentGroup) -> None:
    defaults = fp.PlannerOptions()
    group.add_argument("--belief", help="p1,p2,... or state=p,...; default: the model's own")
    group.add_argument(
        "--gap", type=float, help=f"bounds this near are good enough; default {defaults.gap}"
    )
    group.add_argument(
        "--nodes", type=int, default=defaults.max_nodes, help="at most; default %(default)s"
    )
    group.add_argument(
        "--deadline", type=float, help="s a decision may take; default 2, 0.01 with --evaluate"
    )
    group.add_argument("--policy", metavar="FILE", help="ask this .policy instead of a search")
    group.add_argument(
        "--tree", type=at_least(1), nargs="?", const=2, metavar="DEPTH",
        help="show the search tree as text, DEPTH (default 2) actions deep",
    )  # fmt: skip
    group.add_argument("--tree-json", metavar="FILE", help="write the search tree as JSON")
    group.add_argument("--tree-plot", metavar="FILE", help="draw the search tree, a PNG")


def _add_solve(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--solve", type=seconds, metavar="SECONDS", help="improve both bounds until then or --gap"
    )
    group.add_argument("--save-policy", metavar="FILE", help="write the policy found")
    group.add_argument("--plot", metavar="FILE", help="draw the bounds over time, a PNG")


def _add_evaluate(group: argparse._ArgumentGroup) -> None:
    group.add_argument("--evaluate", type=at_least(2), metavar="N", help="simulate N episodes")
    group.add_argument("--seed", type=int, default=1, help="of the episodes; default %(default)s")


def _add_files(group: argparse._ArgumentGroup) -> None:
    group.add_argument("--lint", action="store_true", help="tell what looks like a mistake")
    group.add_argument("--convert", metavar="FILE", help="write the model as POMDPX")


def main(argv: Sequence[str] | None = None) -> int:
    options = parser()
    arguments = options.parse_args(argv)
    if arguments.solve is None and (arguments.save_policy or arguments.plot):
        options.error("--save-policy and --plot want --solve SECONDS")
    path = find_model(arguments.model)
    try:
        answer, text = run(path, arguments)
    except (fp.ModelError, OSError) as error:
        message = str(error)
        print(message if path in message else f"{path}: {message}", file=sys.stderr)
        return 2
    print(json.dumps(answer) if arguments.json else text)
    return int(any(finding["severity"] == "error" for finding in answer.get("lint", ())))


if __name__ == "__main__":
    sys.exit(main())
