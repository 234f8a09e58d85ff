# SPDX-License-Identifier: BSD-3-Clause
"""Anticipatory Bayesian policy selection (thesis 5.2.2, Alg. 1): the core, free of ROS nodes."""

from fabric_abps.belief import TypeBelief
from fabric_abps.change import ChangeDetector
from fabric_abps.criteria import CRITERIA, make_criterion
from fabric_abps.library import Library, LibraryError, Policy
from fabric_abps.models import ModelsError, TrainedModels
from fabric_abps.observation_model import ObservationModel
from fabric_abps.parameters import SelectorParameters
from fabric_abps.performance import PerformanceModel
from fabric_abps.persist import Memory, MemoryFileError, fingerprint
from fabric_abps.selector import Choice, Selector
from fabric_abps.signals import SignalEncoder, code_name
from fabric_abps.train import Job, child_seed, train

__all__ = [
    "CRITERIA",
    "ChangeDetector",
    "Choice",
    "Job",
    "Library",
    "LibraryError",
    "Memory",
    "MemoryFileError",
    "ModelsError",
    "ObservationModel",
    "PerformanceModel",
    "Policy",
    "Selector",
    "SelectorParameters",
    "SignalEncoder",
    "TrainedModels",
    "TypeBelief",
    "child_seed",
    "code_name",
    "fingerprint",
    "make_criterion",
    "train",
]
