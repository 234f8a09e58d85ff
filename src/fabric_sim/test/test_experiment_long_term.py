# SPDX-License-Identifier: BSD-3-Clause
"""The long-term study: its people, its robots, and a whole small run."""

import csv
import json
from dataclasses import replace
from shutil import copyfile

import numpy as np
import pytest

import fabric_planner as fp
from fabric_abps import Library, Policy, Selector, SelectorParameters
from fabric_msgs.msg import Decision, Observation
from fabric_sim.batch_files import Files
from fabric_sim.character import CORNERS, Character
from fabric_sim.experiments import command, long_term
from fabric_sim.experiments.long_term_ablation import (
    PARAMETERS,
    Training,
    parameter_variants,
    size_variants,
    type_variants,
)
from fabric_sim.experiments.long_term_deciders import Prepared, PreparedDecider
from fabric_sim.experiments.long_term_hindsight import SHIFTS_TO_JUDGE, best_in_hindsight, estimated
from fabric_sim.experiments.long_term_run import ABPS, Context
from fabric_sim.experiments.long_term_shifts import (
    Shift,
    Strategy,
    World,
    shifts_of,
    unknown_person,
)
from fabric_sim.truth import Truth

SEED = 101
FILES = Files()
TYPES = ["expert_rested_attentive_collaborative", "beginner_tired_distracted_noncollaborative"]
NOWHERE = Truth("1,1,1,1", "evaluating", "idle", "needs_help", 1.0, 1.0, 1.0, 1.0, 0, 0)


def policy(name: str) -> Policy:
    return Policy(name, FILES.model(name, "inspection"), name)


LIBRARY = Library("inspection", (policy("proactive"), policy("none")), "proactive")


@pytest.fixture(scope="module")
def context() -> Context:
    context = Context(World("inspection"))
    context.add_policies(LIBRARY.policies)
    return context


@pytest.fixture(scope="module")
def base(context) -> Strategy:
    """ABPS with two policies and two known types, trained a little."""
    models = Training(context, 4, SEED, 1)(LIBRARY, TYPES)
    return Strategy(ABPS, "ABPS", LIBRARY, models, SelectorParameters())


# -- people ---------------------------------------------------------------------------------------


def test_everybody_is_unknown_and_another_in_every_order():
    people = [unknown_person(seed, number) for seed in range(SEED, SEED + 5) for number in range(9)]
    assert len(set(people)) == len(people)
    assert not set(people) & set(CORNERS.values())


def test_the_same_seed_gives_the_same_shifts_and_no_part_shares_chance_with_another():
    parts = ("adaptation", "hindsight", "convergence", "apart")
    shifts = {part: shifts_of(SEED, part, 3, 4, 30) for part in parts}
    assert shifts["hindsight"] == shifts_of(SEED, "hindsight", 3, 4, 30)
    seeds = [shift.seed for own in shifts.values() for person in own for shift in person]
    assert len(set(seeds)) == len(seeds)
    for own in shifts.values():
        assert [person[0].person for person in own] == [unknown_person(SEED, n) for n in range(3)]


def test_a_shift_under_a_constant_policy_does_not_depend_on_what_ran_before(context):
    [[shift, other]] = shifts_of(SEED, "adaptation", 1, 2, 3)
    first = context.world.constant(shift, LIBRARY["proactive"])
    context.world.constant(other, LIBRARY["proactive"])
    again = context.world.constant(shift, LIBRARY["proactive"])
    assert np.array_equal(first.figures, again.figures)
    assert first.figures.shape == (3, 4)


@pytest.mark.parametrize("scenario", ["inspection", "sorting"])
def test_rewards_alone_are_those_of_the_whole_course(scenario):
    world, tired = World(scenario), Character.parse("0.4,0.2,0.5,0.3")
    policy = Policy("proactive", FILES.model("proactive", scenario), "as written")
    world.prepare(policy)
    shift = Shift(tired, SEED, 3)
    whole = world.constant(shift, policy).figures[:, 0]
    assert world.rewards(shift, policy).tolist() == whole.tolist()


def test_a_selector_that_never_changes_does_what_the_constant_policy_does(context, base):
    fixed = SelectorParameters(criterion="fixed", fixed_policy="none")
    [[shift]] = shifts_of(SEED, "adaptation", 1, 1, 4)
    chosen = context.world.selected(shift, Selector(LIBRARY, base.models, fixed))
    constant = context.world.constant(shift, LIBRARY["none"])
    assert chosen.policies == constant.policies == ["none"] * 4
    assert np.array_equal(chosen.figures, constant.figures)
    assert np.array_equal(chosen.seconds, constant.seconds)


def test_what_a_selector_has_learnt_goes_on_to_the_next_shift(context, base):
    selector = base.selector()
    [[one], [other]] = shifts_of(SEED, "adaptation", 2, 1, 2)
    before = context.world.selected(one, selector)
    after = context.world.selected(other, selector)
    assert selector.tasks_seen == 4
    assert before.policies[0] == LIBRARY.base
    assert not np.allclose(before.types[-1], after.types[-1])
    assert after.types.sum(axis=1) == pytest.approx(np.ones(2))


# -- robots ---------------------------------------------------------------------------------------


def observations() -> list[Observation]:
    """A person who comes, grasps in vain, then stands idle."""
    return [
        Observation(sequence=n, task_id=1, trigger=min(n, 2) - 1, detected=True, **what)
        for n, what in enumerate(
            ({"idle": True}, {"grasp_attempt": True}, {"idle": True, "failed_attempts": 1}), 1
        )
    ]


def test_a_policy_taken_up_inside_a_task_goes_on_from_the_same_belief():
    robots = {}
    for name in ("proactive", "patient"):
        prepared = Prepared.of(policy(name), FILES.share("fabric_planner") / "config")
        robots[str(prepared.path)] = prepared
    one, other = robots
    decider = PreparedDecider(robots, one)
    agent = fp.DecisionAgent(one, fp.PlannerOptions(max_nodes=1), solver="offline",
                             policy=robots[one].solved)  # fmt: skip
    first, second, third = observations()
    for asked in (first, second):
        assert decider.decide(asked, NOWHERE).action == agent.decide(asked).action
    decider.set_model(other, keep_belief=True)
    agent.set_model(other, True)
    decision = decider.decide(third, NOWHERE)
    assert decision.belief == pytest.approx(agent.decide(third).belief)
    assert decision.action_index == robots[other].solved.action(np.array(decision.belief))
    assert decision.model_hash == agent.model_hash == decider.model_hash


def test_a_new_task_begins_afresh_after_a_switch():
    prepared = {
        name: Prepared.of(policy(name), FILES.share("fabric_planner") / "config")
        for name in ("none", "proactive")
    }
    robots = {str(robot.path): robot for robot in prepared.values()}
    decider = PreparedDecider(robots, str(prepared["none"].path))
    decider.decide(observations()[0], NOWHERE)
    decider.set_model(str(prepared["proactive"].path), keep_belief=True)
    decider.decide(observations()[1], NOWHERE)
    decider.reset()
    fresh = PreparedDecider(robots, str(prepared["proactive"].path))
    expected = fresh.decide(observations()[0], NOWHERE).belief
    fresh.reset()
    assert decider.decide(observations()[0], NOWHERE).belief == expected


ORIGINAL = """<?xml version="1.0"?>
<pomdpx version="1.0" id="original"><Discount>0.95</Discount><Variable>
<StateVar vnamePrev="s0" vnameCurr="s1"><ValueEnum>works waits</ValueEnum></StateVar>
<ObsVar vname="o"><ValueEnum>{symbols}</ValueEnum></ObsVar>
<ActionVar vname="a"><ValueEnum>idle grasp</ValueEnum></ActionVar><RewardVar vname="r"/></Variable>
<InitialStateBelief><CondProb><Var>s0</Var><Parent>null</Parent><Parameter type="TBL"><Entry>
<Instance>-</Instance><ProbTable>1 0</ProbTable></Entry></Parameter></CondProb></InitialStateBelief>
<StateTransitionFunction><CondProb><Var>s1</Var><Parent>a s0</Parent><Parameter type="TBL"><Entry>
<Instance>* - -</Instance><ProbTable>0.9 0.1 0.5 0.5</ProbTable></Entry></Parameter></CondProb>
</StateTransitionFunction><ObsFunction><CondProb><Var>o</Var><Parent>a s1</Parent>
<Parameter type="TBL"><Entry><Instance>* - -</Instance><ProbTable>uniform</ProbTable></Entry>
</Parameter></CondProb></ObsFunction><RewardFunction><Func><Var>r</Var><Parent>a s0</Parent>
<Parameter type="TBL"><Entry><Instance>grasp waits</Instance><ValueTable>1</ValueTable></Entry>
</Parameter></Func></RewardFunction></pomdpx>
"""


def write_original(path, symbols: int) -> None:
    names = " ".join(f"o{number}" for number in range(symbols))
    path.write_text(ORIGINAL.format(symbols=names), encoding="utf-8")


def test_models_of_an_original_layout_run_by_its_map(tmp_path):
    for symbols in (12, 14):
        path = tmp_path / f"layout_{symbols}.pomdpx"
        write_original(path, symbols)
        world = World("inspection")
        world.prepare(Policy("outside", path, "outside"))
        assert world.robots[str(path)].map_path.name == f"original_{symbols}.obs.yaml"
        course = world.constant(Shift(unknown_person(SEED), SEED, 1), Policy("outside", path, ""))
        assert np.isfinite(course.figures).all()


def test_the_map_of_original_reactive_models_names_their_states():
    states = ["TaskHuman", "GlobalSuccess", "HumanNeedsHelp", "WarningReceived", "TaskRobot",
              "GlobalFail"]  # fmt: skip
    path = FILES.share("fabric_planner") / "config/original_6.obs.yaml"
    rules = fp.ObservationMap.load(str(path), states)
    late = Observation(detected=True, idle=True, subtask_elapsed=15.0)
    assert states[rules.symbol(late, 0)] == "HumanNeedsHelp"
    assert states[rules.symbol(Observation(detected=True, idle=True), 0)] == "TaskHuman"
    assert states[rules.symbol(Observation(detected=True, warning=True), 2)] == "WarningReceived"


def test_only_parameters_that_differ_from_the_shipped_ones_are_ablated(base):
    labels = [variant.label for variant in parameter_variants(base)]
    assert "between tasks only" not in labels
    assert "inside too" in labels
    inside = replace(base, parameters=replace(base.parameters, switch_inside=True))
    assert "between tasks only" in [variant.label for variant in parameter_variants(inside)]


def test_a_variant_alters_one_parameter_unless_its_name_says_both():
    assert [len(changed) for group, _, changed in PARAMETERS if group != "both"] == [1] * 6


def test_fewer_types_and_smaller_libraries_are_parts_of_what_is_shipped():
    shipped = long_term.shipped("sorting")
    for variant in type_variants(shipped):
        strategy, types = variant.strategy, variant.strategy.models.types
        assert len(types) == int(variant.label)
        assert set(types) < set(shipped.models.types)
        assert strategy.library == shipped.library
        assert strategy.parameters == shipped.parameters
        strategy.selector()  # refuses models that do not fit the library
    assert len(type_variants(shipped)) == 3
    for variant in size_variants(shipped, "size", shipped.models, shipped.library, (5, 10)):
        library = variant.strategy.library
        assert len(library.policies) == int(variant.label)
        assert {"proactive", "reactive", library.base} <= set(library.names)
        assert variant.strategy.models.types == shipped.models.types
        variant.strategy.selector()


def test_models_from_outside_are_used_or_refused_by_name(context, tmp_path):
    copyfile(FILES.model("none", "inspection"), tmp_path / "still.pomdpx")
    map_of_none = FILES.model("none", "inspection").with_suffix(".obs.yaml")
    copyfile(map_of_none, tmp_path / "still.obs.yaml")
    (tmp_path / "broken.pomdpx").write_text("<pomdpx", encoding="utf-8")
    write_original(tmp_path / "strange.pomdpx", 15)
    names, refused = long_term.add_outsiders(context, tmp_path)
    assert names == ["outside still"]
    assert len(refused) == 2
    assert any("broken.pomdpx" in reason for reason in refused)
    assert any("strange.pomdpx" in reason and "layout" in reason for reason in refused)


def test_a_folder_without_a_usable_model_is_refused(context, tmp_path):
    with pytest.raises(ValueError, match="no model that can be used"):
        long_term.add_outsiders(context, tmp_path)
    (tmp_path / "broken.pomdpx").write_text("<pomdpx", encoding="utf-8")
    with pytest.raises(ValueError, match="broken.pomdpx"):
        long_term.add_outsiders(context, tmp_path)


# -- the best policy in hindsight ----------------------------------------------------------------


def judged(worth: np.ndarray, noise: float, seed: int):
    """Judge policies that are worth so much, (n_people, n_policies), with so much noise a shift."""
    rng = np.random.default_rng(seed)

    def judge(places, first, last) -> np.ndarray:
        means = np.array([worth[place] for place in places])
        return means[:, None] + rng.normal(0.0, noise, (len(places), last - first))

    return judge


def test_the_best_in_hindsight_beats_every_constant_on_other_tasks():
    rng = np.random.default_rng(SEED)
    people = [unknown_person(SEED, number) for number in range(40)]
    names = [f"policy {number}" for number in range(6)]
    worth = rng.normal(4.0, 1.0, (len(people), len(names)))  # nothing to do with the dials
    found = best_in_hindsight(names, people, judged(worth, 0.3, SEED))
    picked = worth[range(len(people)), [names.index(name) for name in found.best]]
    assert found.shifts == SHIFTS_TO_JUDGE
    assert picked.mean() > worth.max(axis=1).mean() - 0.1
    assert picked.mean() > worth.mean(axis=0).max() + 0.5


def test_similar_people_tell_what_a_persons_own_tasks_cannot():
    people = [unknown_person(SEED, number) for number in range(200)]
    dials = np.array([person.dials for person in people]) - 0.5
    worth = 4.0 + 0.6 * np.column_stack([dials, -dials])  # small beside the noise
    names = [f"policy {number}" for number in range(8)]
    found = best_in_hindsight(names, people, judged(worth, 0.5, SEED))
    picked = worth[range(len(people)), [names.index(name) for name in found.best]]
    possible = worth.max(axis=1).mean() - worth.mean(axis=0).max()
    assert picked.mean() - worth.mean(axis=0).max() > 0.75 * possible
    assert np.abs(found.rewards - worth).mean() < 0.1


def test_one_shift_of_everybody_is_enough_to_draw_estimates_together():
    people = [unknown_person(SEED, number) for number in range(200)]
    worth = np.full((len(people), 3), 4.0)
    found = worth + np.random.default_rng(SEED).normal(0.0, 1.0, worth.shape)
    drawn = estimated(people, found, found**2, np.ones_like(found))
    assert 0.3 < np.abs(drawn - worth).mean() / np.abs(found - worth).mean() < 0.7


def test_trainings_share_what_both_need(context):
    training = Training(context, 2, SEED, 1)
    training(LIBRARY, TYPES)
    one = training(LIBRARY, TYPES[1:])
    alone = Training(context, 2, SEED, 1)(LIBRARY, TYPES[1:])
    assert np.array_equal(one.performance.mean, alone.performance.mean)
    assert np.array_equal(one.observation.counts, alone.observation.counts)


# -- the command --------------------------------------------------------------------------------

WORDS = ["--seed", str(SEED), "--orders", "2", "--people", "2", "--tasks", "3"]
WORDS += ["--workers", "2", "--repeats", "2", "--no-ablations"]


@pytest.fixture(scope="module")
def small_run(tmp_path_factory, base):
    """Folder of a study of two policies with two orders of two people."""
    folder = tmp_path_factory.mktemp("study") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(long_term, "shipped", lambda *_: base)
        words = [*WORDS, "--jobs", "1", "--out", str(folder)]
        assert command.main(["long-term", *words]) == 0
    return folder


def rows_of(path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_strategy_meets_the_same_people(small_run):
    rows = rows_of(small_run / "shifts.csv")
    strategies = {row["strategy"] for row in rows}
    assert strategies == {*LIBRARY.names, ABPS, "oracle", *long_term.CHOOSERS}
    met = {
        name: [
            (row["order_seed"], row["place"], row["person"])
            for row in rows
            if row["strategy"] == name
        ]
        for name in strategies
    }
    assert len({tuple(people) for people in met.values()}) == 1
    assert len(met[ABPS]) == 4


def test_the_oracle_does_what_the_best_policy_of_each_person_did(small_run):
    rows = rows_of(small_run / "shifts.csv")
    keys = ("order_seed", "place", "person")
    done = {(row["strategy"], *(row[k] for k in keys)): row["reward"] for row in rows}
    for row in rows:
        if row["strategy"] == "oracle":
            place = tuple(row[key] for key in keys)
            assert row["reward"] == done[(row["best_in_hindsight"], *place)]


def test_what_abps_did_is_told_task_by_task(small_run):
    tasks = rows_of(small_run / "tasks.csv")
    shifts = rows_of(small_run / "shifts.csv")
    assert len(tasks) == 2 * 2 * 3
    assert tasks[0]["policy"] == LIBRARY.base
    own = [float(row["reward"]) for row in shifts if row["strategy"] == ABPS]
    assert np.mean([float(row["reward"]) for row in tasks]) == pytest.approx(np.mean(own), abs=1e-5)


def test_the_report_stands_by_itself_and_holds_every_table(small_run):
    page = (small_run / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 5
    assert "src=" not in page
    assert "<link" not in page
    for words in ("4.62", "75.2", "77.6", "always none", "oracle", "bandit (exp4)", "best constant",
                  "regret within 5.0 %", "half of the gap"):  # fmt: skip
        assert words in page
    assert page.count("<table>") == 4


def test_the_figures_are_written_for_machines_too(small_run):
    lines = json.loads((small_run / "tests.json").read_text(encoding="utf-8"))
    kinds = {line["kind"] for line in lines}
    assert kinds == {
        "mean", "abps_minus", "abps_minus_best", "abps_minus_constant_apart", "gap", "gap_apart",
        "closed_share", "regret", "converged", "unlike_anyone_known", "ablation", "goal",
    }  # fmt: skip


def test_the_number_of_processes_changes_nothing(small_run, base, monkeypatch, tmp_path):
    monkeypatch.setattr(long_term, "shipped", lambda *_: base)
    assert long_term.main([*WORDS, "--jobs", "2", "--out", str(tmp_path / "two")]) == 0
    for name in ("shifts.csv", "tasks.csv", "tests.json"):
        assert (tmp_path / "two" / name).read_bytes() == (small_run / name).read_bytes()


def test_a_folder_that_holds_a_run_is_left_alone(small_run, capsys):
    before = (small_run / "shifts.csv").read_bytes()
    assert long_term.main([*WORDS, "--out", str(small_run)]) == 2
    assert "another run" in capsys.readouterr().err
    assert (small_run / "shifts.csv").read_bytes() == before


def test_models_from_outside_that_are_all_broken_end_the_command(
    tmp_path, base, monkeypatch, capsys
):
    monkeypatch.setattr(long_term, "shipped", lambda *_: base)
    (tmp_path / "broken.pomdpx").write_text("<pomdpx", encoding="utf-8")
    words = [*WORDS, "--also", str(tmp_path), "--out", str(tmp_path / "run")]
    assert long_term.main(words) == 2
    assert "broken.pomdpx" in capsys.readouterr().err
    record = json.loads((tmp_path / "run/run.json").read_text(encoding="utf-8"))
    assert record["status"] == "failed"
    assert "broken.pomdpx" in record["reason"]


def test_a_study_that_cannot_be_reported_ends_with_a_sentence(base, monkeypatch, tmp_path, capsys):
    def refuse(*_):
        raise ValueError("the best policies earn -1.00 a task")

    monkeypatch.setattr(long_term, "shipped", lambda *_: base)
    monkeypatch.setattr(long_term, "run_study", lambda *_: None)
    monkeypatch.setattr(long_term, "write", refuse)
    assert long_term.main([*WORDS, "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "long-term: the best policies earn -1.00 a task\n"
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "failed"


def test_a_library_without_what_was_trained_on_it_ends_the_command(tmp_path, capsys):
    words = [*WORDS, "--library", str(tmp_path), "--out", str(tmp_path / "run")]
    assert long_term.main(words) == 2
    assert str(tmp_path / "models.npz") in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--orders", "1"], "2 or more"),
        (["--workers", "1"], "2 or more"),
        (["--tasks", "0"], "less than 1"),
        (["--scenario", "kitchen"], "kitchen"),
        (["--also", "/nowhere/at/all"], "no folder"),
        (["--library", "/nowhere/at/all"], "no folder"),
        (["--seed", "one"], "one"),
    ],
)
def test_words_that_cannot_be_meant_are_refused(words, complaint, capsys):
    with pytest.raises(SystemExit) as ended:
        long_term.main(words)
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


def test_a_decision_taken_up_inside_a_task_is_one_of_the_robots_actions():
    known = {Decision.IDLE, Decision.PLANNING, Decision.POINT, Decision.GRASP, Decision.CANCEL}
    robots = {}
    for name in ("none", "patient"):
        prepared = Prepared.of(policy(name), FILES.share("fabric_planner") / "config")
        robots[str(prepared.path)] = prepared
    decider = PreparedDecider(robots, next(iter(robots)))
    first, second, third = observations()
    decider.decide(first, NOWHERE)
    for path, observation in zip(reversed(robots), (second, third), strict=True):
        decider.set_model(path, keep_belief=True)
        decision = decider.decide(observation, NOWHERE)
        assert decision.action in known
        assert decision.observation_sequence == observation.sequence
        assert sum(decision.belief) == pytest.approx(1.0)
