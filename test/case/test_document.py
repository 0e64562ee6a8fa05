"""YAML as an engineer writes it, and as nobody should."""

from pathlib import Path

import pytest

from rotorsoil_ros.case.document import (
    _FastLoader,
    _loaded,
    _Loader,
    chosen,
    located,
    override,
    parse,
    read,
    SHIPPED,
)
from rotorsoil_ros.errors import InputError


@pytest.mark.parametrize('text, value', [
    ('48e6', 48e6), ('1e9', 1e9), ('1.E-3', 1e-3), ('.5', 0.5), ('-3', -3), ('010', 10),
    ('1:30', '1:30'), ('on', 'on'), ('no', 'no'), ('true', True), ('', None), ('~', None),
    ('2024-13-45', '2024-13-45'), ('"3"', '3'), ('99999999999999999999', 1e20),
])
def test_scalars_are_those_of_yaml_1_2(text, value):
    got = parse(text, source='x')
    assert got == value
    assert type(got) is type(value)


def test_every_key_at_fault_is_told():
    with pytest.raises(InputError) as caught:
        parse('a: {b: 1, b: 2}\nc: 1\n[d]: 0\nc: 2', source='x')
    assert str(caught.value).splitlines() == [
        'x: line 1: the key b stands here twice', 'x: line 3: a key must be a word',
        'x: line 4: the key c stands here twice']


def test_anchors_and_merges_work():
    got = parse('a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\n', source='x')
    assert got == {'a': {'x': 1, 'y': 2}, 'b': {'x': 1, 'y': 3}}


@pytest.mark.parametrize('text', [
    *(file.read_text(encoding='utf-8') for file in sorted(SHIPPED.glob('*.yaml'))),
    'a: &a {x: [1, -.5, .inf, ~, on, 1:30, "é"]}\nb: {<<: *a}\nc: >-\n  two\n  lines\nb: 1\n'
    '[d]: 2\n'])
def test_the_fast_reader_reads_what_the_slow_one_does(text):
    assert repr(_loaded(text, _FastLoader)) == repr(_loaded(text, _Loader))


def test_what_is_no_yaml_is_told_in_the_words_of_the_slow_reader():
    # libyaml takes a tab behind a colon, and has words of its own.
    for text, words in (('a:\tb', "found character '\\t' that cannot start any token"),
                        ('a: [1,\nb: 2', "expected ',' or ']', but got '<stream end>'")):
        with pytest.raises(InputError) as caught:
            parse(text, source='x')
        assert words in str(caught.value)


def _bomb():
    """Return a kilobyte that would expand to 10^12 values."""
    layers = ['a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]']
    layers += [f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 9)}]' for i in range(1, 12)]
    return '\n'.join(layers)


@pytest.mark.parametrize('text, problem', [
    ('a: 1\na: 2', r'line 2: the key a stands here twice'),
    ('a: {b: 1, b: 2}', r'line 1: the key b stands here twice'),
    ('{[1]: 2}', r'line 1: a key must be a word'),
    ('a: &a [*a]', r'line 1: the alias \*a repeats nothing that ends before it'),
    ('a: *b', r'line 1: the alias \*b repeats nothing that ends before it'),
    ('a: !!python/object:os.system ls', r'line 1: tags \(!\) are not allowed'),
    ('!!int ""', r'line 1: tags \(!\) are not allowed'),
    ('[' * 100_000, r'line 1: nested deeper than 24 levels'),
    ('- ' * 100_000, r'line 1: nested deeper than 24 levels'),
    (_bomb(), r'line 5: more than 50000 values, repeated ones counted'),
    ('a: [' + '1,' * 60_000 + ']', r'line 1: more than 50000 values'),
    ('a: [1', r'line 1: .*expected .,. or .\]'),
    ('a: 1\n---\nb: 2', r'line 2: .*another document'),
    ('a: \x00', r'unacceptable character'),
])
def test_bad_text_is_refused_in_one_line(text, problem):
    with pytest.raises(InputError, match=rf'^x: {problem}') as caught:
        parse(text, source='x')
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('content, problem', [
    (b'\xff\xfe', r'is not a text file in UTF-8 \(byte 0\)'),
    (b'#' * 300_000, r'is larger than 256 KiB: no case file'),
    (b'', r'must hold keys and values, got None'),
    (b'- 1', r'must hold keys and values, got \[1\]'),
])
def test_file_that_is_no_case_is_refused(tmp_path, content, problem):
    path = tmp_path / 'x.yaml'
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf'^{path}: {problem}$'):
        read(path)


def test_byte_order_mark_is_skipped(tmp_path):
    path = tmp_path / 'x.yaml'
    path.write_bytes(b'\xef\xbb\xbfa: 1')
    assert read(path) == {'a': 1}


def test_missing_file_and_directory_are_refused(tmp_path):
    with pytest.raises(InputError, match=r'nothing.yaml: cannot be read: No such file'):
        read(tmp_path / 'nothing.yaml')
    with pytest.raises(InputError, match=r'cannot be read: Is a directory$'):
        read(tmp_path)


def test_name_of_a_shipped_case_stands_for_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert located(Path('plant_fan')) == SHIPPED / 'plant_fan.yaml'
    assert chosen(Path('fan_house#fan_2')) == (SHIPPED / 'fan_house.yaml', ('source=fan_2',))
    (tmp_path / 'plant_fan').write_text('a: 1')  # a file of the user's comes first
    assert located(Path('plant_fan')) == Path('plant_fan')
    with pytest.raises(InputError, match=r'^fan: cannot be read: .* \(shipped cases: fan_house, '):
        read(located(Path('fan')))


def test_override_replaces_and_adds_in_order():
    document = {'blocks': [{'mass': 1.0}, {'mass': 2.0}], 'soil': None}
    override(document, ['blocks.1.mass=7', 'soil.loss=1e-1', 'name=a=b', 'blocks.1.mass=42e1'])
    assert document == {'blocks': [{'mass': 1.0}, {'mass': 420.0}], 'soil': {'loss': 0.1},
                        'name': 'a=b'}


def test_override_of_one_place_leaves_its_alias_alone():
    document = parse('a: &a {x: [1]}\nb: *a\n', source='x')
    override(document, ['b.x.0=2'])
    assert document == {'a': {'x': [1]}, 'b': {'x': [2]}}


@pytest.mark.parametrize('setting, problem', [
    ('mass', 'must be key.path=value'), ('=1', 'must be key.path=value'),
    ('blocks..mass=1', 'must be key.path=value'),
    ('blocks.2.mass=1', 'blocks has 2 entries, counted from 0, and no entry 2'),
    ('blocks.-1.mass=1', 'blocks has 2 entries, counted from 0, and no entry -1'),
    ('blocks.mass=1', 'blocks has 2 entries, counted from 0, and no entry mass'),
    ('blocks.0.mass.x=1', 'blocks.0.mass has no keys below it, it is 1'),
    ('blocks.0.mass=[1', 'line 1: '),
])
def test_override_that_leads_nowhere_is_named(setting, problem):
    document = {'blocks': [{'mass': 1}, {'mass': 2}]}
    with pytest.raises(InputError) as caught:
        override(document, [setting])
    assert str(caught.value).startswith(f'--set {setting}: {problem}')
