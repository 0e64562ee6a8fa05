"""What is told of stretches that were refused, and when it is news."""

from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal, Refusals

CLIPPED = Refusal(Flaw.CLIPPED, 'clipped at 19.6 m/s^2')
NOISE = Refusal(Flaw.NOISE, 'below noise')


def told(*stretches):
    refusals = Refusals()
    for refusal in stretches:
        refusals.note(refusal)
    return refusals


def test_one_refused_stretch_is_no_news():
    assert told(None, CLIPPED, None).news() is None
    assert told(CLIPPED, CLIPPED).news() is None


def test_more_than_a_fifth_for_one_reason_is_told_once_and_its_end_too():
    refusals = told(*[None] * 16, *[CLIPPED] * 4)
    assert refusals.news() is None  # a fifth, not more
    refusals.note(CLIPPED)
    assert refusals.news() == '5 of the last 20 stretches refused: clipped at 19.6 m/s^2'
    assert refusals.news() is None
    for _ in range(20):
        refusals.note(None)
    assert refusals.news() == ''
    assert refusals.counts[Flaw.CLIPPED] == 5  # of the whole run


def test_a_machine_that_hardly_moves_is_no_fault_of_its_sensor():
    refusals = told(*[NOISE] * 20)
    assert refusals.news() is None
    assert refusals.values()['refused_below_noise'] == 20
    assert list(refusals.lines()) == ['20 of 20 stretches refused: below noise']


def test_lines_name_every_reason_with_its_count_and_what_was_left_out():
    refusals = told(CLIPPED, NOISE, CLIPPED, None)
    refusals.left_out.update(['spike left out', 'spike left out'])
    assert list(refusals.lines()) == [
        '2 of 4 stretches refused: clipped at 19.6 m/s^2', '1 of 4 stretches refused: below noise',
        'spike left out (2 times)']
