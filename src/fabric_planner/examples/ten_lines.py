# SPDX-License-Identifier: BSD-3-Clause
"""The planner in ten lines: load, solve, plan, simulate, evaluate."""

import fabric_planner as fp
from fabric_planner.paths import models_folder

model = fp.load(models_folder() / "inspection_proactive.pomdpx")  # or a .pomdp
solution = fp.solve(model, time=1.0)  # offline: a policy and bounds that hold
print("optimal value between", solution.lower_value, "and", solution.upper_value)
planner = fp.OnlinePlanner(model, fp.PlannerOptions(deadline=0.01))  # online: 10 ms a decision
decision = planner.decide(model.initial_belief)
print(model.actions[decision.action], "is worth at least", decision.value)
for step in fp.simulate(model, planner, steps=5, seed=1):
    print(model.actions[step.action], "->", model.observations[step.observation], step.reward)
print(fp.evaluate(model, solution.lower, episodes=200, seed=1))
