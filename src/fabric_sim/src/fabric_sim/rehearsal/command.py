# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric study rehearse PROTOCOL`: a whole study by simulated people, and its report.

    python3 -m fabric_sim.rehearsal.command protocol:=experiment-1 people:=14 seed:=101 ...

Writes a study folder as the console does (study.json says that it is simulated), power.csv, and
the study's report with the published values beside. Equal words give equal records apart from the
study's id.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fabric_sim.rehearsal import power
from fabric_sim.rehearsal.people import Laboratory, play_visits
from fabric_sim.rehearsal.summary import aligned, beside_published
from fabric_sim.rehearsal.tables import study_of
from fabric_sim.rehearsal.visit_record import write_study
from fabric_study.protocol import load_protocol
from fabric_study.study_data import load_study
from fabric_study.study_report import write_study_report
from fabric_study.study_report_power import POWER_FILE

BANNER = "Simulated people, simulated answers: nothing here says anything about real people."


@dataclass(frozen=True)
class Plan:
    """The words of the command, parsed. people: 0 is as many as the protocol has."""

    protocol: str
    people: int
    seed: int
    power: int
    workers: int
    out_dir: Path

    @classmethod
    def parse(cls, words: Sequence[str]) -> Plan:
        """Read `name:=value` words that fabric_bringup.arguments has checked."""
        value = dict(word.split(":=", 1) for word in words)
        return cls(
            protocol=value["protocol"],
            people=int(value["people"]),
            seed=int(value["seed"]),
            power=int(value["power"]),
            workers=int(value["workers"]) or multiprocessing.cpu_count(),
            out_dir=Path(value["out_dir"]),
        )


def rehearse(plan: Plan, laboratory: Laboratory) -> str:
    """Play, write and report a study; return what there is to tell."""
    people = plan.people or laboratory.protocol.people
    visits = play_visits(laboratory, max(people, plan.power), plan.workers)
    write_study(plan.out_dir, laboratory.protocol, plan.seed, visits[:people])
    paths = [plan.out_dir]
    if plan.power:
        many = study_of(laboratory.protocol, visits[: plan.power])
        curves = power.contrasts(many, plan.seed, plan.workers)
        power.table_of(curves).to_csv(plan.out_dir / POWER_FILE, index=False)
        paths.append(plan.out_dir / POWER_FILE)
    page, no_pdf = write_study_report(plan.out_dir)
    paths += [page] if no_pdf else [page, page.with_suffix(".pdf")]
    told = [*aligned(beside_published(load_study(plan.out_dir))), BANNER]
    return "\n".join(filter(None, [*told, no_pdf, *(f"wrote {path}" for path in paths)]))


def main(words: Sequence[str]) -> int:
    """Run the command; return its exit code, 2 when a word or a file is refused."""
    plan = Plan.parse(words)
    try:
        laboratory = Laboratory.of(load_protocol(plan.protocol), plan.seed)
    except (ValueError, OSError) as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    print(rehearse(plan, laboratory))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
