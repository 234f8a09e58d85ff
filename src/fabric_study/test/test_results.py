# SPDX-License-Identifier: BSD-3-Clause
"""Tables of a run: always formatted alike, refused when damaged, summed up with intervals."""

import math

import pytest
from scipy import stats

from fabric_msgs.msg import Decision
from fabric_study.meter import COLUMNS
from fabric_study.results import (
    ResultsWriter,
    TimingWriter,
    format_value,
    mean_interval,
    percentile,
    read_results,
    read_timing,
    summary_table,
    summary_text,
)


def row(**values):
    base = dict.fromkeys(COLUMNS)
    base.update(task=1, seed=5, scenario="sorting", human="expert", policy="proactive")
    base.update(model="proactive", discounted_reward=1.5, success=1, warnings=0, duration_s=20.0)
    base.update(decisions=7, human_succeeded=1, human_failed=0, robot_succeeded=0, robot_failed=0)
    return {**base, **values}


def test_cells_are_formatted_the_same_every_time():
    cells = [format_value(value) for value in (None, 3, "a", 1 / 3, 2.0, -0.0, True)]
    assert cells == ["", "3", "a", "0.333333", "2.000000", "0.000000", "1"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_never_written(value):
    with pytest.raises(ValueError, match="a result is"):
        format_value(value)


def test_rows_are_on_disk_as_soon_as_they_are_written(tmp_path):
    path = tmp_path / "results.csv"
    writer = ResultsWriter(path)
    writer.write(row(human="0.1,0.2,0.3,0.4", stage1_accuracy=None, efficiency=0.25))
    (read,) = read_results(path)
    assert read["human"] == "0.1,0.2,0.3,0.4"
    assert (read["task"], read["efficiency"], read["stage1_accuracy"]) == (1, 0.25, None)
    writer.close()


def test_equal_rows_give_equal_files(tmp_path):
    for name in ("a", "b"):
        writer = ResultsWriter(tmp_path / name)
        writer.write(row(discounted_reward=0.1 + 0.2))
        writer.close()
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_the_results_of_another_run_are_not_overwritten(tmp_path):
    path = tmp_path / "results.csv"
    ResultsWriter(path).close()
    with pytest.raises(FileExistsError, match="results.csv holds the results of another run"):
        ResultsWriter(path)


def test_rows_can_be_appended_under_the_same_header_only(tmp_path):
    path = tmp_path / "results.csv"
    for task in (1, 2):
        writer = ResultsWriter(path, append=True)
        writer.write(row(task=task))
        writer.close()
    assert [read["task"] for read in read_results(path)] == [1, 2]
    with pytest.raises(ValueError, match="columns are task, seed"):
        TimingWriter(path, append=True)


def test_a_row_with_other_columns_is_refused(tmp_path):
    writer = ResultsWriter(tmp_path / "results.csv")
    with pytest.raises(ValueError, match="columns are task; must be"):
        writer.write({"task": 1})
    writer.close()


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("20.000000", "fast", "line 2: duration_s is 'fast'; it must be a number"),
        ("20.000000", "nan", "line 2: duration_s is nan; it must be finite"),
        ("1,5,sorting", "1.5,5,sorting", "line 2: task is '1.5'"),
        ("1,5,sorting", "0,1,5,sorting", "line 2: "),
        ("task,seed", "task,root", "columns are task, root"),
    ],
)
def test_a_damaged_file_is_refused_with_line_column_and_value(tmp_path, old, new, message):
    path = tmp_path / "results.csv"
    writer = ResultsWriter(path)
    writer.write(row())
    writer.close()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ValueError) as caught:
        read_results(path)
    assert message in str(caught.value)
    assert "results.csv" in str(caught.value)


def test_decisions_are_timed_in_a_file_of_their_own(tmp_path):
    path = tmp_path / "timing.csv"
    writer = TimingWriter(path)
    decision = Decision(task_id=2, observation_sequence=9, planning_time=0.25, nodes=30)
    writer.write_decisions("proactive", [decision])
    writer.close()
    (read,) = read_timing(path)
    assert read["planning_time_s"] == 0.25
    assert (read["task"], read["observation"], read["deadline_missed"]) == (2, 9, 0)


def test_the_interval_agrees_with_an_independent_library():
    values = [2.0, 3.5, 1.0, 4.0, 2.5]
    mean, half = mean_interval(values)
    low, high = stats.t.interval(0.95, 4, loc=stats.tmean(values), scale=stats.sem(values))
    assert (mean - half, mean + half) == pytest.approx((low, high))


def test_the_interval_of_few_values_is_undefined():
    assert mean_interval([]) == (None, None)
    assert mean_interval([2.0]) == (2.0, None)


def test_percentiles_are_values_that_occurred():
    values = [float(value) for value in range(100, 0, -1)]
    assert (percentile(values, 0.5), percentile(values, 0.99)) == (50.0, 99.0)
    assert percentile([7.0], 0.99) == 7.0
    assert percentile([], 0.5) is None


def test_the_summary_has_a_column_for_each_policy_and_leaves_out_the_undefined():
    rows = [row(), row(discounted_reward=2.5), row(policy="reactive", warnings=3)]
    table = summary_table(rows)
    assert table[0] == ["measure", "proactive", "reactive"]
    assert table[1] == ["tasks", "2", "1"]
    measures = {line[0]: line[1:] for line in table}
    assert measures["reward"] == ["2.000 ± 6.353", "1.500"]
    assert "stage 1" not in measures


def test_the_text_tells_the_latency(tmp_path):
    timing = [
        {"policy": "proactive", "planning_time_s": 0.001 * n, "deadline_missed": 0}
        | {"fallback_used": int(n == 3)}
        for n in range(1, 101)
    ]
    text = summary_text([row()], timing)
    assert "proactive: p50 50.0 ms, p99 99.0 ms over 100 decisions" in text
    assert "fallback used 1" in text
