# SPDX-License-Identifier: BSD-3-Clause
"""The trained models of one library in one .npz file, read without pickle."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabric_abps.library import Library
from fabric_abps.observation_model import ObservationModel
from fabric_abps.performance import PerformanceModel

FORMAT = 2
_KEYS = (
    "format", "scenario", "types", "policies", "library_hash", "seed",
    "utility_count", "utility_mean", "utility_variance", "variance_floor", "predictive",
    "transitions", "typicality", "concentration",
)  # fmt: skip


class ModelsError(ValueError):
    """The file cannot be used; the message names file and entry."""


@dataclass(frozen=True)
class TrainedModels:
    """Observation and performance model, and what they were trained on."""

    scenario: str
    types: tuple[str, ...]
    policies: tuple[str, ...]
    library_hash: str  # Library.hash at training time
    seed: int  # root seed of the training
    performance: PerformanceModel
    observation: ObservationModel

    def __post_init__(self) -> None:
        shape = (len(self.types), len(self.policies))
        for what, names in (("types", self.types), ("policies", self.policies)):
            if not names or len(set(names)) != len(names):
                raise ModelsError(f"{what}: must be distinct names, one at least")
        for what, array in (
            ("performance model", self.performance.mean),
            ("observation model", self.observation.counts),
        ):
            if array.shape[:2] != shape:
                raise ModelsError(
                    f"{what}: is for {array.shape[:2]} types and policies, not {shape}"
                )

    def check(self, library: Library) -> None:
        """Raises ModelsError unless trained on exactly this library."""
        if self.scenario != library.scenario:
            raise ModelsError(
                f"models are for scenario '{self.scenario}', the library for '{library.scenario}'"
            )
        if list(self.policies) != library.names:
            raise ModelsError(
                f"models know the policies {', '.join(self.policies)}; "
                f"the library has {', '.join(library.names)}"
            )
        if self.library_hash != library.hash:
            raise ModelsError(
                "a model file of the library has changed since the training "
                f"(library {library.hash[:12]}, trained on {self.library_hash[:12]}): train again"
            )

    def part(self, library: Library, types: Sequence[str]) -> "TrainedModels":
        """The models as they know `types` and the policies of a smaller library, nothing else.

        Means stay as all types and policies have drawn them together. Raises ModelsError naming
        what they were not trained on.
        """
        for name, known in [(n, self.types) for n in types] + [
            (n, self.policies) for n in library.names
        ]:
            if name not in known:
                raise ModelsError(f"the models were not trained on {name}")
        places = np.ix_(
            [self.types.index(name) for name in types],
            [self.policies.index(name) for name in library.names],
        )
        of, seen = self.performance, self.observation
        return TrainedModels(
            library.scenario,
            tuple(types),
            tuple(library.names),
            library.hash,
            self.seed,
            PerformanceModel(
                of.count[places],
                of.mean[places],
                of.variance[places],
                of.variance_floor,
                of.predictive,
            ),
            ObservationModel(seen.counts[places], seen.typicality[places], seen.concentration),
        )

    def save(self, path: "str | Path") -> None:
        """Write the file; a reader sees the old one or the new one, never half of it."""
        path = Path(path)
        partial = path.with_name(path.name + ".part")
        with partial.open("wb") as stream:
            np.savez_compressed(
                stream,
                format=FORMAT,
                scenario=self.scenario,
                types=np.array(self.types),
                policies=np.array(self.policies),
                library_hash=self.library_hash,
                seed=np.array(self.seed, dtype=np.uint64),
                utility_count=self.performance.count,
                utility_mean=self.performance.mean,
                utility_variance=self.performance.variance,
                variance_floor=self.performance.variance_floor,
                predictive=self.performance.predictive,
                transitions=self.observation.counts,
                typicality=self.observation.typicality,
                concentration=self.observation.concentration,
            )
        os.replace(partial, path)

    @classmethod
    def load(cls, path: "str | Path") -> "TrainedModels":
        """Read and check a file; raises ModelsError naming file and entry."""
        data = _read(Path(path))
        try:
            return cls(
                scenario=str(data["scenario"]),
                types=tuple(str(name) for name in data["types"]),
                policies=tuple(str(name) for name in data["policies"]),
                library_hash=str(data["library_hash"]),
                seed=int(data["seed"]),
                performance=PerformanceModel(
                    data["utility_count"],
                    data["utility_mean"],
                    data["utility_variance"],
                    float(data["variance_floor"]),
                    str(data["predictive"]),
                ),
                observation=ObservationModel(
                    data["transitions"], data["typicality"], float(data["concentration"])
                ),
            )
        except (ValueError, TypeError, OverflowError) as error:
            raise ModelsError(f"{path}: {error}") from error


def _read(path: Path) -> dict[str, NDArray]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            data = {key: archive[key] for key in archive.files}
    except OSError as error:
        raise ModelsError(f"{path}: cannot be read: {error.strerror or error}") from error
    except Exception as error:  # NumPy and zipfile raise a dozen kinds for damaged bytes
        raise ModelsError(f"{path}: not a file of trained models: {error}") from error
    if "format" not in data or data["format"].shape != () or data["format"] != FORMAT:
        raise ModelsError(f"{path}: format {data.get('format')} is not {FORMAT}")
    for key in _KEYS:
        if key not in data:
            raise ModelsError(f"{path}: entry '{key}' is missing")
    return data
