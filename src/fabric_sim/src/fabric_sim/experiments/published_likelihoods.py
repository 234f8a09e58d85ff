# SPDX-License-Identifier: BSD-3-Clause
"""Figure 6.29 of the thesis as printed: likelihoods of eight simulated and fourteen real people."""

#: The thesis' models 1 to 8 by the names of our corners; all of them attentive.
MODELS = (
    "expert_rested_attentive_collaborative",
    "expert_rested_attentive_noncollaborative",
    "expert_tired_attentive_collaborative",
    "expert_tired_attentive_noncollaborative",
    "beginner_rested_attentive_collaborative",
    "beginner_rested_attentive_noncollaborative",
    "beginner_tired_attentive_collaborative",
    "beginner_tired_attentive_noncollaborative",
)

#: Fig. 6.29a: row who generated, column who explains.
SIMULATED = (
    (0.227, 0.226, 0.178, 0.126, 0.087, 0.096, 0.129, 0.078),
    (0.205, 0.223, 0.155, 0.113, 0.072, 0.085, 0.105, 0.063),
    (0.187, 0.179, 0.215, 0.091, 0.047, 0.039, 0.060, 0.044),
    (0.176, 0.171, 0.108, 0.212, 0.042, 0.036, 0.048, 0.039),
    (0.128, 0.129, 0.088, 0.078, 0.185, 0.102, 0.044, 0.058),
    (0.132, 0.133, 0.090, 0.079, 0.066, 0.193, 0.043, 0.058),
    (0.176, 0.190, 0.186, 0.144, 0.083, 0.052, 0.228, 0.124),
    (0.107, 0.101, 0.083, 0.068, 0.041, 0.033, 0.049, 0.172),
)

#: Fig. 6.29b: fourteen participants by the eight models.
PARTICIPANTS = (
    (0.208, 0.146, 0.087, 0.082, 0.081, 0.083, 0.110, 0.061),
    (0.141, 0.132, 0.082, 0.075, 0.071, 0.072, 0.122, 0.058),
    (0.226, 0.189, 0.094, 0.094, 0.100, 0.102, 0.062, 0.062),
    (0.165, 0.153, 0.098, 0.087, 0.082, 0.083, 0.174, 0.067),
    (0.164, 0.154, 0.080, 0.080, 0.085, 0.086, 0.063, 0.055),
    (0.143, 0.132, 0.077, 0.073, 0.069, 0.071, 0.095, 0.051),
    (0.133, 0.126, 0.208, 0.080, 0.072, 0.073, 0.197, 0.072),
    (0.128, 0.119, 0.066, 0.065, 0.064, 0.065, 0.068, 0.045),
    (0.138, 0.132, 0.078, 0.073, 0.076, 0.077, 0.097, 0.057),
    (0.133, 0.127, 0.086, 0.077, 0.072, 0.073, 0.137, 0.063),
    (0.153, 0.143, 0.116, 0.085, 0.079, 0.080, 0.166, 0.069),
    (0.127, 0.122, 0.071, 0.068, 0.071, 0.073, 0.083, 0.052),
    (0.124, 0.118, 0.076, 0.069, 0.068, 0.069, 0.115, 0.056),
    (0.175, 0.201, 0.088, 0.084, 0.083, 0.162, 0.090, 0.057),
)
