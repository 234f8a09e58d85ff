# SPDX-License-Identifier: BSD-3-Clause
"""Lines of the load cells: cut anywhere, damaged, missing; and the simulated ones."""

import pytest

from fabric_dobot_driver.load_cells import HIGH, LineParser, Rows, SimulatedLine, Source


@pytest.mark.parametrize("cut", range(1, 12))
def test_lines_may_be_cut_anywhere(cut):
    data, parser, seen = b"1 8312\r\n2 -77\n", LineParser(), []
    for i in range(0, len(data), cut):
        seen += parser.feed(data[i : i + cut])
    assert seen == [(1, 8312), (2, -77)]
    assert parser.damaged == 0


@pytest.mark.parametrize("line", [b"1", b"1 2 3", b"one 2", b"1 8388608", b"1 1e3", b"\xff\x00"])
def test_a_damaged_line_is_counted_and_passed_over(line):
    parser = LineParser()
    assert parser.feed(line + b"\n1 5\n\n") == [(1, 5)]
    assert parser.damaged == 1


def test_an_endless_line_is_given_up():
    parser = LineParser()
    for _ in range(100):
        parser.feed(b"7" * 50)
    assert parser.damaged > 10
    assert parser.feed(b"\n2 6\n") == [(2, 6)]


def test_readings_join_into_rows_in_the_order_of_the_trays():
    rows = Rows([3, 1])
    assert rows.add(1, 10) is None
    assert rows.add(9, 99) is None  # nobody's channel
    assert rows.add(3, 30) == [30, 10]


def test_a_missing_reading_counts_as_saturated():
    rows = Rows([1, 2])
    rows.add(1, 10)
    assert rows.add(1, 11) == [10, HIGH]
    assert rows.add(2, 21) == [11, 21]


@pytest.mark.parametrize("channels", [[], [1, 1]])
def test_channels_have_to_differ(channels):
    with pytest.raises(ValueError, match="want different ones"):
        Rows(channels)


def changes(raw: list[int]):
    """When the count changed (s), and by how much."""
    for i, (before, after) in enumerate(zip(raw, raw[1:], strict=False), 1):
        if before != after:
            yield i / 80.0, after - before


def test_simulated_cubes_come_in_turn_and_weigh_what_they_should():
    line, parser = SimulatedLine([1, 2], 80.0, seed=101, source=Source(noise=0.0)), LineParser()
    seen: dict[int, list[int]] = {1: [], 2: []}
    for channel, raw in parser.feed(line.read(20.0)):
        seen[channel].append(raw)
    steps = {channel: list(changes(raw)) for channel, raw in seen.items()}
    assert steps == {1: [(5.0, 7560), (15.0, 7560)], 2: [(10.0, 7560)]}
    assert line.read(20.0) == b""
