# SPDX-License-Identifier: BSD-3-Clause
"""Words and scripts of the emulator are checked before anything runs."""

import pytest

from fabric_dobot_driver.emulator.__main__ import main
from fabric_dobot_driver.emulator.words import Planned, parse, parse_script


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("dance", "no word 'dance'"),
        ("", "no word ''"),
        ("silence", "want: silence S"),
        ("silence 1 2", "want: silence S"),
        ("di 1", "want: di ADDRESS 0|1"),
        ("di 21 1", "21, want 1 to 20"),
        ("adc 1.5 1", "1.5"),
        ("alarm 0x80", "0x80, want 0 to 127"),
        ("delay -1", "-1, want 0 to 3600"),
        ("cube nan", "nan, want"),
        ("cube 1 pink", "'pink', want red, green, blue"),
        ("infrared maybe", "'maybe', want on, off, auto"),
    ],
)
def test_words_that_there_are_not_are_refused_by_name(line, said):
    with pytest.raises(ValueError) as error:
        parse(line)
    assert said in str(error.value)


def test_a_script_is_sorted_by_its_times_and_may_have_comments():
    text = "5: silence 2; cube 60 red\n# nothing\n1.5: alarm 0x11  # why not\n"
    assert parse_script(text, "text") == [
        Planned(0.0, "cube 60 red"),
        Planned(1.5, "alarm 0x11"),
        Planned(5.0, "silence 2"),
    ]


@pytest.mark.parametrize(
    "entry",
    ["x: cube", "-1: cube", "nan: cube", "inf: cube", "3: dance", "3: silence x", "drop nan"],
)
def test_a_wrong_entry_of_a_script_is_named(entry):
    with pytest.raises(ValueError, match=r"plan\.txt: entry 2, ") as error:
        parse_script(f"1: cube\n{entry}", "plan.txt")
    assert repr(entry) in str(error.value)


@pytest.mark.parametrize(
    "words",
    [
        ["--faults", "1: dance"],
        ["--script", "no/such/file"],
        ["--tell", "state"],
        ["--tell", "state", "--link", "no/such/link"],
        ["--log", "no/such/folder/log"],
    ],
)
def test_bad_arguments_end_with_2_and_a_sentence(words, capsys):
    assert main(words) == 2
    assert capsys.readouterr().err.startswith("emulator: ")


@pytest.mark.parametrize("words", [["--speed", "0"], ["--home-time", "nan"], ["--seed", "x"]])
def test_bad_numbers_end_with_2_and_name_the_option(words, capsys):
    with pytest.raises(SystemExit) as end:
        main(words)
    assert end.value.code == 2
    assert words[0] in capsys.readouterr().err
