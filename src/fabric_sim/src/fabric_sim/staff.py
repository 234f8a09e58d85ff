# SPDX-License-Identifier: BSD-3-Clause
"""Who works in which task: the same person goes on, another one starts fresh."""

from fabric_sim.cell_parameters import MANUAL
from fabric_sim.character import Character, CharacterError, human_of_task, named_generator
from fabric_sim.drift import DriftingStaff
from fabric_sim.worker import Worker
from fabric_sim.worker_file import FileWorker, WorkerFile, is_worker_file
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

DRIFTING = "drifting"  # one person in moods that change from task to task


class Staff:
    """The simulated people of a run under the argument `human:=`."""

    def __init__(
        self,
        human: str,
        seed: int,
        parameters: WorkerParameters | None = None,
        library: ModelLibrary | None = None,
    ) -> None:
        """Raises CharacterError naming value and allowed ones, ValueError naming a bad file."""
        if human == MANUAL:
            raise CharacterError(
                "human type 'manual' needs somebody at the keys; allowed here: any other"
            )
        self._human = human
        self._seed = seed
        self._parameters = parameters or WorkerParameters.load()
        self._library = library or ModelLibrary(self._parameters.model)
        self._character: Character | None = None
        self._file: WorkerFile | None = None
        self._worker: Worker | None = None
        self._drifting: DriftingStaff | None = None
        self._unused = named_generator(seed, "worker")  # every task brings a generator of its own
        if is_worker_file(human):
            self._file = WorkerFile.load(human, self._parameters)
        elif human == DRIFTING:
            self._drifting = DriftingStaff(seed, None, self._parameters, self._library)
        else:
            human_of_task(human, seed, 1)

    def worker(self, task_number: int) -> Worker:
        """The worker of a task, numbered from 1: with a history if it is the one of the last."""
        if self._file is not None:
            return self._worker_of_file(task_number)
        if self._drifting is not None:
            return self._drifting.worker(task_number)
        character = human_of_task(self._human, self._seed, task_number)
        if self._worker is None or character != self._character:
            self._character = character
            self._worker = Worker(character, self._unused, self._parameters, self._library)
        return self._worker

    def _worker_of_file(self, task_number: int) -> Worker:
        if self._worker is None:
            rng = named_generator(self._seed, "worker", task_number)
            self._worker = FileWorker(self._file, rng, self._parameters)
        return self._worker


def check_human(human: str) -> None:
    """Raises ValueError naming the type or the file that cannot be simulated."""
    if human != MANUAL:
        Staff(human, seed=0)
