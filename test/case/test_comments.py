"""Editing a case: it says what it should, and every line of which nothing changes stays."""

from copy import deepcopy
from pathlib import Path

from hypothesis import given, settings, strategies
import pytest

from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring.comments import edited, guesses

CONFIG = Path(__file__).parents[2] / 'config'
FAN = (CONFIG / 'plant_fan.yaml').read_text()


def said(text):
    return document.parse(text, source='test')


@pytest.mark.parametrize('path', sorted(CONFIG.glob('*.yaml')), ids=lambda path: path.stem)
def test_nothing_changes_where_nothing_is_changed(path):
    assert edited(path.read_text(), said(path.read_text())) == path.read_text()


@pytest.mark.parametrize('settings, lines', [
    (['soil.shear_modulus=48e6'], 1),
    (['rotor.bearings.1.stiffness.xx=1.5e8', 'rotor.bearings.0.damping.zz=2e3'], 2),
    (['unbalances.0.moment=0.1'], 1),
    (['speed_range_rpm=[100, 2000]'], 1),
    (['uncertainty.shear_modulus_factor=1.3'], 1),
    (['rotor.bearings.0.pedestal={mass: 80.0, stiffness: {xx: 1e8, zz: 1e8}, damping: '
      '{xx: 1e3, zz: 1e3}}'], 1)])
def test_only_lines_that_change_are_touched(settings, lines):
    content = said(FAN)
    document.override(content, settings)
    text = edited(FAN, content)
    assert said(text) == content
    before, after = FAN.splitlines(), text.splitlines()
    fresh = [line for line in after if line not in before]
    assert len(fresh) == lines
    # Comments stay, those on the lines that changed too.
    assert FAN.count('#') == text.count('#')


def test_another_entry_of_a_list_follows_the_last():
    content = said(FAN)
    content['unbalances'].append({'disc': 'coupling', 'moment': 0.001})
    text = edited(FAN, content)
    assert said(text) == content
    assert '[kg m], [rad]\n  - {disc: coupling, moment: 0.001}\nspeed_range' in text


def test_what_is_taken_out_takes_its_collection_along_only():
    content = said(FAN)
    del content['rotor']['bearings'][0]['damping']['xx']
    content['soil']['density'] = 1850.0
    text = edited(FAN, content)
    assert said(text) == content
    assert FAN.splitlines()[:19] == text.splitlines()[:19]


def test_aliases_that_would_say_it_twice_are_written_anew():
    text = 'a: &same {x: 1}  # kept nowhere\nb: *same\n'
    content = {'a': {'x': 1}, 'b': {'x': 2}}
    assert said(edited(text, content)) == content


SCALARS = strategies.one_of(strategies.integers(-9, 9), strategies.booleans(),
                            strategies.sampled_from([1.5, 2e8, 'word', 'two words', None]))
TREES = strategies.recursive(SCALARS, lambda inner: strategies.one_of(
    strategies.lists(inner, max_size=3),
    strategies.dictionaries(strategies.sampled_from('abc'), inner, max_size=3)), max_leaves=8)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(strategies.dictionaries(strategies.sampled_from('abc'), TREES, min_size=1, max_size=3),
       strategies.dictionaries(strategies.sampled_from('abcd'), TREES, min_size=1, max_size=4))
def test_any_document_becomes_any_other(before, after):
    text = document.text_of(before, ['a head'])
    if said(text) != before:
        return  # a word that YAML reads as something else
    assert said(edited(text, deepcopy(after))) == said(document.text_of(after, []))


def test_marks_are_read_with_the_key_of_their_line():
    text = ('# "# guess" stands where nobody told\n'
            'soil:\n'
            '  density: 1900  # guess [kg/m^3]: dense sand\n'
            '  loss_factor: 0.05  # measured\n'
            'bearings:\n'
            '  - name: one\n'
            '    damping:  # guess: by size\n'
            '      xx: [1, 2]\n'
            '  - {name: two, mass: 3}  # guess\n')
    assert [(one.key, one.why) for one in guesses(text)] == [
        ('soil.density', 'dense sand'), ('bearings.0.damping', 'by size'), ('bearings.1', '')]
