# SPDX-License-Identifier: BSD-3-Clause
"""Who works in which task: the same person goes on, another one starts fresh."""

from fabric_sim.character import Character, human_of_task, named_generator
from fabric_sim.worker import Worker
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters


class Staff:
    """The people of a run under the argument `human:=`."""

    def __init__(
        self,
        human: str,
        seed: int,
        parameters: WorkerParameters | None = None,
        library: ModelLibrary | None = None,
    ) -> None:
        """Raises CharacterError naming the value and the allowed ones."""
        self._human = human
        self._seed = seed
        self._parameters = parameters or WorkerParameters.load()
        self._library = library or ModelLibrary(self._parameters.model)
        self._character: Character = human_of_task(human, seed, 1)
        self._worker: Worker | None = None

    def worker(self, task_number: int) -> Worker:
        """The worker of a task, numbered from 1: with a history if it is the one of the last."""
        character = human_of_task(self._human, self._seed, task_number)
        if self._worker is None or character != self._character:
            rng = named_generator(self._seed, "worker", task_number)
            self._character = character
            self._worker = Worker(character, rng, self._parameters, self._library)
        return self._worker
