"""Tables in files: found again, never mistaken, never half written."""

from dataclasses import replace
import logging
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case import cache
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.config import load

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
ARRAYS = {'a': np.arange(3.0), 'b': np.array(['x', 'yz']), 'c': np.eye(2) * (1.0 + 2.0j)}
KEY = content_key('test')


def test_arrays_come_back_bit_for_bit(tmp_path):
    files = Cache(tmp_path / 'new' / 'directory')
    assert files.load('kind', KEY) is None
    files.store('kind', KEY, ARRAYS)
    back = files.load('kind', KEY)
    assert back is not None
    assert back.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(back[name], array)
        assert back[name].dtype == array.dtype


def test_key_sees_every_number_and_no_name_of_a_variable():
    case = load(PAPER)
    assert content_key(case.rotor) == content_key(load(PAPER).rotor)
    moved = replace(case.rotor, shaft_height=np.nextafter(0.6, 1.0))
    assert content_key(case.rotor) != content_key(moved)
    assert content_key(np.array([1.0])) != content_key(np.array([1.0 + 0j]))
    assert content_key(1.0, 2.0) != content_key(2.0, 1.0)


def test_key_of_something_without_canonical_form_is_refused():
    with pytest.raises(TypeError, match='object cannot be part of a key'):
        content_key(object())


def test_key_moves_with_the_algorithm(monkeypatch):
    monkeypatch.setattr(cache, 'ALGORITHM', cache.ALGORITHM + 1)
    assert content_key('test') != KEY


def _stored(directory):
    files = Cache(directory)
    files.store('kind', KEY, ARRAYS)
    return files, files.path('kind', KEY)


@pytest.mark.parametrize('spoil', [
    lambda good: b'', lambda good: b'junk', lambda good: good[:len(good) // 2],
    lambda good: good[:100] + bytes([good[100] ^ 1]) + good[101:],
    lambda good: good.replace(b'x\x00\x00\x00', b'w\x00\x00\x00'),
])
def test_damaged_file_is_reported_and_not_used(tmp_path, caplog, spoil):
    files, path = _stored(tmp_path)
    good = path.read_bytes()
    path.write_bytes(spoil(good))
    assert path.read_bytes() != good
    with caplog.at_level(logging.WARNING):
        assert files.load('kind', KEY) is None
    assert f'{path} cannot be read and is computed again' in caplog.text


def test_no_flipped_bit_gets_through(tmp_path, caplog):
    files, path = _stored(tmp_path)
    good = path.read_bytes()
    random = np.random.default_rng(1)
    for place in random.integers(len(good), size=300):
        spoiled = bytearray(good)
        spoiled[place] ^= 1 << random.integers(8)
        path.write_bytes(spoiled)
        back = files.load('kind', KEY)
        assert back is None or all(np.array_equal(back[name], ARRAYS[name]) for name in ARRAYS)


def test_file_of_another_key_is_reported_and_not_used(tmp_path, caplog):
    files, path = _stored(tmp_path)
    other = content_key('other')
    path.rename(files.path('kind', other))
    with caplog.at_level(logging.WARNING):
        assert files.load('kind', other) is None
    assert 'holds something else' in caplog.text


@pytest.mark.parametrize('foreign', [
    lambda path: np.savez(path, a=1.0), lambda path: np.eye(2).dump(path),
    lambda path: path.with_suffix('.npy').rename(path),
    lambda path: np.savez(path, __key__=np.array([None], dtype=object))])
def test_foreign_file_is_reported_and_not_used(tmp_path, caplog, foreign):
    files = Cache(tmp_path)
    np.save(files.path('kind', KEY).with_suffix('.npy'), np.eye(2))
    foreign(files.path('kind', KEY))
    assert files.load('kind', KEY) is None
    assert caplog.records


def test_file_that_lost_an_array_is_not_used(tmp_path, caplog):
    files, path = _stored(tmp_path)
    with np.load(path) as whole:
        rest = {name: whole[name] for name in whole.files if name != 'b'}
    np.savez(path, **rest)
    assert files.load('kind', KEY) is None
    assert 'holds something else' in caplog.text


def test_objects_are_not_pickled(tmp_path):
    with pytest.raises(TypeError, match='pickled'):
        Cache(tmp_path).store('kind', KEY, {'a': np.array([{}])})


def test_directory_that_cannot_be_written_is_reported(tmp_path, caplog):
    obstacle = tmp_path / 'file'
    obstacle.touch()
    Cache(obstacle / 'below').store('kind', KEY, ARRAYS)
    assert 'cannot be written' in caplog.text


def test_interrupted_write_leaves_nothing_behind(tmp_path, monkeypatch, caplog):
    def fail(*_):
        raise OSError('disk full')

    monkeypatch.setattr(cache.os, 'replace', fail)
    Cache(tmp_path).store('kind', KEY, ARRAYS)
    assert list(tmp_path.iterdir()) == []
    assert 'disk full' in caplog.text


def _write_often(directory, value):
    for _ in range(30):
        Cache(directory).store('kind', KEY, {'a': np.full(50_000, value)})


def test_two_processes_lose_nothing(tmp_path):
    context = get_context('spawn')
    writers = [context.Process(target=_write_often, args=(tmp_path, value))
               for value in (1.0, 2.0)]
    for writer in writers:
        writer.start()
    seen = 0
    while any(writer.is_alive() for writer in writers):
        if Cache(tmp_path).path('kind', KEY).exists():
            back = Cache(tmp_path).load('kind', KEY)
            assert back is not None
            assert np.unique(back['a']).size == 1
            seen += 1
    assert seen > 0
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert list(tmp_path.iterdir()) == [Cache(tmp_path).path('kind', KEY)]


def test_directory_is_the_chosen_one_then_the_environment_then_the_users(tmp_path, monkeypatch):
    monkeypatch.setenv('ROTORSOIL_CACHE', '/a')
    monkeypatch.setenv('XDG_CACHE_HOME', '/b')
    monkeypatch.setenv('HOME', '/c')
    assert cache.directory(tmp_path) == tmp_path
    assert cache.directory() == Path('/a')
    monkeypatch.delenv('ROTORSOIL_CACHE')
    assert cache.directory() == Path('/b/rotorsoil')
    monkeypatch.delenv('XDG_CACHE_HOME')
    assert cache.directory() == Path('/c/.cache/rotorsoil')


def test_another_content_under_the_same_key_is_computed_again(tmp_path, caplog):
    files = Cache(tmp_path)
    files.store('kind', KEY, ARRAYS)
    with np.load(files.path('kind', KEY)) as stored:
        arrays = dict(stored)
    name = next(name for name in ARRAYS if ARRAYS[name].size)
    arrays[name] = np.zeros_like(arrays[name])
    np.savez(files.path('kind', KEY), **arrays)
    assert files.load('kind', KEY) is None
    assert 'holds something else' in caplog.text


def test_a_table_of_one_user_is_readable_to_the_service_of_another(tmp_path):
    Cache(tmp_path).store('kind', KEY, ARRAYS)
    assert Cache(tmp_path).path('kind', KEY).stat().st_mode & 0o777 == 0o644


def test_a_directory_may_be_told_as_a_string(tmp_path):
    rs.load(str(PAPER), cache_directory=str(tmp_path / 'there')).table  # noqa: B018
    assert any((tmp_path / 'there').iterdir())
