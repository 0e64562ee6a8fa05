"""What a run told in one sentence: of factors and moments that are known beforehand."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsoil_ros.monitor.identification.sentence import in_a_sentence
from rotorsoil_ros.monitor.verdict import Verdict


def run(verdict=Verdict.FAILS, zones=()):
    return SimpleNamespace(verdict=verdict, zones=[
        SimpleNamespace(zone=zone, source='measured') for zone in zones])


def identified(scalars=(), factor=(), columns=(), moment=()):
    case = SimpleNamespace(
        rotor=SimpleNamespace(discs=[SimpleNamespace(name='coupling'),
                                     SimpleNamespace(name='wheel')]),
        unbalance=np.array([0.0, 0.028]))
    return SimpleNamespace(
        case=case, scalars=[SimpleNamespace(path=path) for path in scalars],
        factor=np.array(factor), columns=tuple(columns),
        moment=np.array(moment, dtype=complex))


def test_softer_ground_and_growing_unbalance():
    said, advice = in_a_sentence(run(), identified(
        ['soil.shear_modulus'], [0.70], ['wheel', 'growth of wheel'], [0.028, 6 * 0.028]))
    assert said == ('The machine does not behave as predicted: ground 30 % softer than in the '
                    'case, unbalance of wheel grew sevenfold')
    assert advice == ('Put the ground that was found into the case with --write-case; clean and '
                      'balance wheel')


@pytest.mark.parametrize('factor, words', [
    (1.02, 'ground as in the case'), (1.4, 'ground 40 % stiffer than in the case'),
    (2.5, 'ground 2.5 times stiffer than in the case')])
def test_ground(factor, words):
    assert words in in_a_sentence(run(), identified(['soil.shear_modulus'], [factor]))[0]


@pytest.mark.parametrize('end, words', [
    (1.4, 'grew by 40 %'), (2.0, 'grew twofold'), (2.5, 'grew 2.5-fold'),
    (9.9, 'grew tenfold'), (30.0, 'grew 30-fold')])
def test_growth(end, words):
    said, _ = in_a_sentence(run(), identified(
        (), (), ['wheel', 'growth of wheel'], [0.02, 0.02 * (end - 1.0)]))
    assert words in said


def test_unbalance_beside_that_of_the_case():
    said, advice = in_a_sentence(run(), identified((), (), ['wheel'], [0.056j]))
    assert 'unbalance of wheel 2 times that of the case' in said
    assert advice == 'Balance wheel'


@pytest.mark.parametrize('verdict, zones, words', [
    (Verdict.PASSES, (), 'Nothing has to be done'), (Verdict.UNDECIDED, (), 'Measure a slow'),
    (Verdict.FAILS, ('A', 'D'), 'Stop the machine'), (Verdict.FAILS, (), 'Ask what explains')])
def test_without_identification_the_verdict_says_what_to_do(verdict, zones, words):
    assert in_a_sentence(run(verdict, zones), None)[1].startswith(words)
