# SPDX-License-Identifier: BSD-3-Clause
"""Generative models from Python: those in C++ and those written in Python."""

import gc
import sys
import threading
import weakref
from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"
AMPLE = 1e6  # s: a deadline that never ends a search
LEFT, RIGHT = "left", "right"


class Tiger(fp.GenerativeModel):
    """fp.examples.tiger() once more, with words for states and observations."""

    n_actions = 3
    discount = 0.95
    reward_range = (-100.0, 10.0)
    action_names = ["listen", "open_left", "open_right"]

    def initial_state(self, random):
        return LEFT if random.uniform() < 0.5 else RIGHT

    def step(self, state, action, u):
        if action == 0:
            other = RIGHT if state == LEFT else LEFT
            return state, -1.0, f"hear {state if u < 0.85 else other}", False
        reward = -100.0 if (LEFT, RIGHT)[action - 1] == state else 10.0
        rest = 2.0 * u if u < 0.5 else 2.0 * u - 1.0
        heard = "hear left" if rest < 0.5 else "hear right"
        return (LEFT if u < 0.5 else RIGHT), reward, heard, False

    def observation_probability(self, next_state, action, observation):
        if action:
            return 0.5
        return 0.85 if observation == f"hear {next_state}" else 0.15

    def action_upper_bounds(self, state):
        later = 0.95 * 10.0 / (1.0 - 0.95)
        doors = [-100.0 if door == state else 10.0 for door in (LEFT, RIGHT)]
        return [-1.0 + later] + [door + later for door in doors]

    def default_action(self, states):
        return 0

    def lower_bound_at_horizon(self, state):
        return -1.0 / (1.0 - 0.95)


def despot(**changes):
    return fp.DespotOptions(
        **{"deadline": AMPLE, "scenarios": 40, "depth": 30, "max_nodes": 20, **changes}
    )


def pomcp(**changes):
    options = {"deadline": AMPLE, "max_simulations": 50, "max_depth": 20}
    return fp.PomcpOptions(**{**options, **changes})


def facts(decision):
    return (decision.action, decision.value, decision.runner_up, decision.nodes, decision.trials)


@pytest.mark.parametrize("planner, options", [(fp.Despot, despot()), (fp.Pomcp, pomcp())])
def test_a_python_tiger_decides_like_the_one_in_cpp(planner, options):
    ours, theirs = Tiger(), fp.examples.tiger()
    planners = planner(ours, options), planner(theirs, options)
    beliefs = [fp.ParticleBelief(model, 5, particles=200) for model in (ours, theirs)]
    for word, number in [("hear left", 0), ("hear left", 0), ("hear right", 1)]:
        mine, other = [p.decide(b) for p, b in zip(planners, beliefs, strict=True)]
        assert facts(mine) == facts(other)
        assert beliefs[0].update(0, word) == beliefs[1].update(0, number)
        if planner is fp.Pomcp:
            planners[0].advance(0, word)
            planners[1].advance(0, number)


def test_episodes_of_a_python_model_equal_those_in_cpp():
    ours = fp.evaluate_episodes(Tiger(), despot(), episodes=2, seed=3, max_steps=5)
    theirs = fp.evaluate_episodes(fp.examples.tiger(), despot(), episodes=2, seed=3, max_steps=5)
    np.testing.assert_array_equal(ours.returns, theirs.returns)
    assert ours.trials_per_step == theirs.trials_per_step


def test_only_what_is_required_is_needed():
    class Coin(fp.GenerativeModel):
        n_actions = 2
        discount = 0.5
        reward_range = (0.0, 1.0)

        def initial_state(self, random):
            return random.below(2)

        def step(self, state, action, u):
            return state, float(action == state), (state, "seen"), False

    coin = Coin()
    for planner in (fp.Despot(coin, despot()), fp.Pomcp(coin, pomcp())):
        belief = fp.ParticleBelief(coin, seed=1, particles=100)
        assert planner.decide(belief).action in (0, 1)
        assert belief.update(0, (1, "seen")) == fp.UpdateStatus.OK
        assert set(belief.sample(50, seed=2)) == {1}
        assert planner.decide(belief).action == 1


@pytest.mark.parametrize("method", ["initial_state", "step", "default_action"])
@pytest.mark.parametrize(
    "planner, options",
    [(fp.Despot, despot()), (fp.Pomcp, pomcp(rollout=fp.Rollout.DEFAULT_ACTION))],
)
def test_what_python_raises_reaches_the_caller(planner, options, method):
    broken = Tiger()
    ready = planner(broken, options)
    belief = fp.ParticleBelief(broken, 1, particles=20)

    def fail(*_):
        raise KeyError("lost the tiger")

    setattr(broken, method, fail)
    with pytest.raises(KeyError, match="lost the tiger"):
        if method == "initial_state":
            belief.reset(1)
        else:
            ready.decide(belief)
    delattr(broken, method)
    belief.reset(1)
    assert 0 <= ready.decide(belief).action < 3


@pytest.mark.parametrize(
    "result, says",
    [
        ((LEFT, float("nan"), "o", False), "the reward of step.. is nan"),
        ((LEFT, 1.0, "o"), "expected .state, reward, observation, terminal."),
        (([], 1.0, "o", False), "unhashable"),
    ],
)
def test_a_step_that_makes_no_sense_is_refused(result, says):
    class Odd(Tiger):
        def step(self, state, action, u):
            return result

    odd = Odd()
    with pytest.raises((fp.ModelError, TypeError), match=says):
        fp.Despot(odd, despot()).decide(fp.ParticleBelief(odd, 1, particles=10))


def test_missing_members_are_named():
    class Half(fp.GenerativeModel):
        n_actions = 2
        discount = 0.9

    with pytest.raises(fp.ModelError, match="reward_range is missing"):
        fp.Despot(Half())
    with pytest.raises(TypeError, match="no generative model: int"):
        fp.Despot(3)


def test_a_decision_leaves_no_states_behind():
    class Walk(fp.GenerativeModel):
        """States without end: every step makes a new one."""

        n_actions = 2
        discount = 0.9
        reward_range = (0.0, 1.0)

        class Place:
            alive = weakref.WeakSet()

            def __init__(self):
                self.alive.add(self)

        def initial_state(self, random):
            return self.Place()

        def step(self, state, action, u):
            return self.Place(), u, 0, False

    walk = Walk()
    planner, belief = fp.Pomcp(walk, pomcp()), fp.ParticleBelief(walk, 1, particles=10)
    for _ in range(3):
        planner.decide(belief)
        gc.collect()
        assert len(Walk.Place.alive) == 10


def test_models_planners_and_beliefs_are_freed():
    model = Tiger()
    planner, belief = fp.Despot(model, despot()), fp.ParticleBelief(model, 1, particles=10)
    planner.decide(belief)
    gone = weakref.ref(model)
    del model, planner, belief
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize(
    "model", [fp.examples.tiger(), fp.examples.tag(), fp.examples.rock_sample(4, 3),
              fp.examples.laser_tag(), fp.load_pomdpx(TIGER)]
)  # fmt: skip
def test_every_example_steps_and_plans(model):
    compiled = fp.compile_model(model)
    assert len(compiled.action_names) == compiled.n_actions
    state = compiled.initial_state(seed=4)
    assert state == compiled.initial_state(seed=4)
    for action in range(compiled.n_actions):
        after, reward, observation, terminal = compiled.step(state, action, 0.3)
        assert compiled.step(state, action, 0.3) == (after, reward, observation, terminal)
        assert compiled.reward_range[0] <= reward <= compiled.reward_range[1]
        if not terminal:
            assert compiled.observation_probability(after, action, observation) > 0.0
    decision = fp.Despot(compiled, despot()).decide(fp.make_belief(compiled, 1))
    assert 0 <= decision.action < compiled.n_actions
    assert decision.lower_bound <= decision.upper_bound


def test_a_table_is_a_generative_model_too():
    exact = fp.OnlinePlanner(fp.load_pomdpx(TIGER), fp.PlannerOptions(AMPLE, 0.5))
    table = fp.compile_model(fp.load_pomdpx(TIGER))
    planner = fp.Despot(table, despot(scenarios=300, max_nodes=2000))
    belief, probability = fp.make_belief(table, 1), np.array([0.5, 0.5])
    for heard in (0, 0):
        assert planner.decide(belief).action == exact.decide(probability).action
        belief.update(0, heard)
        probability = probability * [0.85, 0.15]
        probability /= probability.sum()
    assert planner.decide(belief).action == exact.decide(probability).action == 2


def test_a_belief_of_another_model_is_refused():
    belief = fp.make_belief(fp.examples.tiger(), 1)
    for other in (fp.examples.tiger(), fp.examples.tag()):
        with pytest.raises(fp.ModelError, match="another model"):
            fp.Despot(other, despot()).decide(belief)


def test_out_of_range_actions_and_numbers_are_refused():
    tag = fp.examples.tag()
    with pytest.raises(IndexError, match="action 5, expected 0 to 4"):
        tag.step(tag.initial_state(1), 5, 0.1)
    with pytest.raises(IndexError, match="action -1"):
        fp.make_belief(tag, 1).update(-1, 0)
    with pytest.raises(fp.ModelError, match="u is 1.0"):
        tag.step(tag.initial_state(1), 0, 1.0)
    with pytest.raises(fp.ModelError, match="episodes and max_steps are 0 and 90"):
        fp.evaluate_episodes(tag, despot(), episodes=0, seed=1)


def test_random_numbers_follow_their_seed():
    one, same, other = fp.Random(1), fp.Random(1), fp.Random(2)
    numbers = [one.uniform() for _ in range(100)]
    assert numbers == [same.uniform() for _ in range(100)]
    assert numbers != [other.uniform() for _ in range(100)]
    assert all(0.0 <= u < 1.0 for u in numbers)
    assert fp.random_of(0.25).uniform() == fp.random_of(0.25).uniform()
    with pytest.raises(fp.ModelError, match="below.0."):
        one.below(0)


def test_episodes_say_what_happened():
    episodes = fp.evaluate_episodes(fp.examples.tag(), despot(), episodes=4, seed=1)
    again = fp.evaluate_episodes(fp.examples.tag(), despot(), episodes=4, seed=1)
    np.testing.assert_array_equal(episodes.returns, again.returns)
    assert episodes.returns.shape == episodes.steps.shape == (4,)
    assert episodes.planning_time.shape == (episodes.steps.sum(),)
    assert episodes.mean == pytest.approx(episodes.returns.mean())
    assert episodes.standard_error > 0.0
    assert episodes.memory == despot().memory


def in_threads(count, work):
    results, threads = [None] * count, []
    for i in range(count):
        threads.append(threading.Thread(target=lambda i=i: results.__setitem__(i, work(i))))
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


@pytest.mark.parametrize("model", [Tiger(), fp.examples.tiger()])
def test_threads_get_what_one_thread_gets(model):
    def work(seed):
        planner = fp.Despot(model, despot(seed=seed))
        belief = fp.make_belief(model, seed)
        heard = "hear left" if isinstance(model, Tiger) else 0
        decisions = []
        for _ in range(2):
            decisions.append(facts(planner.decide(belief)))
            belief.update(0, heard)
        return decisions

    switch = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        assert in_threads(4, work) == [work(i) for i in range(4)]
    finally:
        sys.setswitchinterval(switch)


def test_threads_may_share_a_planner_and_a_belief():
    tiger = fp.examples.tiger()
    planner, belief = fp.Pomcp(tiger, pomcp()), fp.make_belief(tiger, 1)
    assert all(d.trials == 50 for d in in_threads(4, lambda _: planner.decide(belief)))


def test_planning_in_cpp_gives_the_lock_up():
    tag = fp.examples.tag()
    planner = fp.Pomcp(tag, fp.PomcpOptions(deadline=0.3))
    belief, done = fp.make_belief(tag, 1), threading.Event()
    thread = threading.Thread(target=lambda: (planner.decide(belief), done.set()))
    thread.start()
    turns = 0
    while not done.is_set():
        turns += 1
    thread.join()
    assert turns > 1000
