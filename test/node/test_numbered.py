"""Messages that did not come are counted by the numbers that their publisher gave them."""

from inspect import signature

import pytest

from rotorsoil_ros.node.numbered import NUMBER, Numbered


@pytest.fixture
def heard():
    return []


@pytest.fixture
def missed():
    return []


@pytest.fixture
def numbered(heard, missed):
    return Numbered(heard.append, missed.append)


def give(numbered, *numbers):
    for number in numbers:
        numbered(b'message', {NUMBER: number})


def test_the_first_number_says_nothing_and_a_gap_says_how_many(numbered, heard, missed):
    give(numbered, 1000, 1001, 1005)
    assert missed == [3]
    assert heard == [b'message'] * 3


def test_both_executors_are_understood_and_rclpy_gives_the_number(numbered, heard, missed):
    numbered(b'message', {NUMBER: 1})
    numbered((b'message', {NUMBER: 3}))
    assert (heard, missed) == ([b'message'] * 2, [1])
    signature(numbered).bind(b'message', {})
    with pytest.raises(TypeError):
        signature(numbered).bind(b'message')  # rclpy would take that for a wish for less


def test_a_publisher_that_begins_anew_has_lost_nothing(numbered, missed):
    give(numbered, 7, 8, 1, 2)
    assert missed == []


def test_a_middleware_without_numbers_has_lost_nothing(numbered, missed):
    give(numbered, None, None, 5, None, 9)
    assert missed == []


def test_of_several_publishers_nothing_is_counted_nor_of_the_one_that_stays(numbered, missed):
    give(numbered, 1)
    numbered.hear_of(2)
    give(numbered, 500_000, 2, 500_001, 3)
    numbered.hear_of(1)
    give(numbered, 500_009, 500_011)
    assert missed == [1]
