"""Fifty machines on three kinds of soil are three computations of soil, and every one is told."""

from pathlib import Path

import pytest

from rotorsoil_ros.case import config, loading
from rotorsoil_ros.case.loading import load_all, soil_keys
from rotorsoil_ros.errors import InputError


@pytest.fixture
def cases(case_file, tmp_path):
    """Return what writes a variant of the paper's rotor."""
    def write(name, *changes, model='cone'):
        text = case_file.read_text().replace('model: cone', f'model: {model}')
        for before, after in changes:
            assert before in text
            text = text.replace(before, after)
        path = tmp_path / f'{name}.yaml'
        path.write_text(text)
        return path

    return write


def test_every_table_is_computed_once_and_told(cases, tmp_path):
    light, heavy = cases('light'), cases('heavy', ('mass: 42.0', 'mass: 420.0'))
    told = []
    machines = load_all([light, heavy, light], cache_directory=tmp_path / 'c', tell=told.append)
    assert set(machines) == {light, heavy}
    assert machines[light].table.key != machines[heavy].table.key
    assert sorted(line[:27] for line in told) == [
        '1 of 2 tables computed: ' + str(tmp_path)[:3], '2 of 2 tables computed: '
        + str(tmp_path)[:3]]
    again = []
    load_all([light, heavy], cache_directory=tmp_path / 'c', tell=again.append)
    assert again == []


def test_soils_of_one_kind_are_computed_by_one_case(cases, tmp_path, monkeypatch):
    infinite = 'infinite_elements'
    soft = cases('soft', ('shear_modulus: 48.0e6', 'shear_modulus: 47.0e6'), model=infinite)
    stiff = cases('stiff', model=infinite)
    damp = cases('damp', ('poisson_ratio: 0.25', 'poisson_ratio: 0.45'), model=infinite)
    assert soil_keys(config.load(soft)) == soil_keys(config.load(stiff))
    stages = []
    monkeypatch.setattr(loading, 'tabulate', lambda files, *_, **__: stages.append(files))
    monkeypatch.setattr(loading, '_is_tabulated', lambda *_: False)
    monkeypatch.setattr(loading, '_complete', lambda file, _: file)
    load_all([soft, stiff, damp], cache_directory=tmp_path / 'c', tell=print)
    assert stages == [[soft, damp], [soft, stiff, damp]]


def test_what_a_process_complains_of_is_the_complaint(cases, tmp_path):
    good, bad = cases('good'), cases('bad')
    told = []
    with pytest.raises(InputError, match=r'nowhere\.yaml'):
        loading.tabulate([tmp_path / 'nowhere.yaml'], tmp_path / 'c', tell=told.append)
    bad.write_text('name: 3')
    with pytest.raises(InputError, match=r'bad\.yaml: name'):
        load_all([good, bad], cache_directory=tmp_path / 'c', tell=told.append)
    assert not Path(tmp_path / 'c').exists()


def test_many_tables_share_a_process_and_the_case_that_fails_is_named(
        cases, tmp_path, monkeypatch):
    monkeypatch.setattr(loading, 'SHARES', 1)
    monkeypatch.setattr(loading.os, 'cpu_count', lambda: 1)
    files = [cases(f'machine_{mass}', ('mass: 42.0', f'mass: {mass}.0')) for mass in (41, 43)]
    told = []
    loading.tabulate(files, tmp_path / 'c', tell=told.append)
    assert told == [f'2 of 2 tables computed: {files[0]}, {files[1]}']
    assert len(list((tmp_path / 'c').iterdir())) == 2
    wrong = cases('wrong', ('mass: 42.0', 'mass: -42.0'))
    with pytest.raises(InputError, match=r'wrong\.yaml: foundations'):
        loading.tabulate([files[0], wrong], tmp_path / 'c', tell=told.append)
