# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric experiment NAME [arguments]`: hands over to the experiment of that name."""

import importlib
import sys
from collections.abc import Sequence

EXPERIMENTS = {  # name: module with main(words) -> exit code
    "human-models": "fabric_sim.experiments.human_models",
    "long-term": "fabric_sim.experiments.long_term",
    "sensing": "fabric_sim.experiments.sensing",
    "short-term": "fabric_sim.experiments.short_term",
}


def main(words: Sequence[str]) -> int:
    """Run the experiment named by the first word; 2 when there is no such experiment."""
    name = words[0] if words else ""
    if name not in EXPERIMENTS:
        print(f"no experiment {name!r}; there are: {', '.join(EXPERIMENTS)}", file=sys.stderr)
        return 2
    return importlib.import_module(EXPERIMENTS[name]).main(words[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
