"""What a plant has measured becomes a bag: every unit, date and spelling, or it is refused."""

from datetime import datetime
import math
from pathlib import Path
import struct

import numpy as np
from openpyxl import Workbook
import pytest
import pyuff

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import read_profile, speed_profile
from rotorsoil_ros.bags.tables.imported import import_table
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import rpm_to_rad_s
from rotorsoil_ros.wire.cdr import Layout
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.sensors import joint_states

from records import import_run_up

START = 1_700_000_000_000_000_000
CASES = Path(__file__).parents[2] / 'cases'
SPEED = {'column': 'Speed', 'unit': 'rpm'}
TIME = {'column': 'Time', 'unit': 's'}
DE, NDE = 'drive_end_housing_x', 'free_end_housing_z'


def amplitude(unit='um p-p', column='A'):
    return {'column': column, 'unit': unit}


def phase(sense='lag', column='P', unit='deg'):
    return {'column': column, 'unit': unit, 'sense': sense}


def mapped(time=TIME, speed=SPEED, **channels):
    """Return a map; a channel is its amplitude, or that and its phase."""
    said = {'machine': 'fan', 'speed': speed, 'channels': {
        name: dict(zip(('amplitude', 'phase'), parts, strict=False))
        for name, parts in (channels or {DE: (amplitude(), phase())}).items()}}
    return said if time is None else {**said, 'time': time}


def measured(path, quantity):
    payloads = [payload for source, _, payload in bag_reader.messages(path, lambda *_: True)
                if source.topic == f'/fan/measured/{quantity}']
    return joint_states(Layout.of(JOINT_STATE, payloads[0]), payloads)


def imported(tmp_path, text, said=None, *, encoding='utf-8', name='run.csv', **options):
    (tmp_path / name).write_bytes(text.encode(encoding))
    out = tmp_path / 'out.mcap'
    found = import_table(tmp_path / name, said or mapped(), out, start_ns=START, **options)
    return found, out


PLAIN = 'Time,Speed,A,P\n0,600,20,90\n1.5,1200,5,-90\n'


def test_time_speed_amplitude_and_phase_are_those_of_the_table(tmp_path):
    found, out = imported(tmp_path, PLAIN)
    profile = read_profile(out)
    assert (profile.machine, profile.stamp_ns.tolist()) == ('fan', [START, START + 1_500_000_000])
    np.testing.assert_allclose(profile.speed, [20.0 * math.pi, 40.0 * math.pi], rtol=1e-15)
    size, angle = measured(out, 'amplitude'), measured(out, 'phase')
    assert size.names == angle.names == (DE,) == found.channels
    assert size.stamp_ns.tolist() == angle.stamp_ns.tolist() == profile.stamp_ns.tolist()
    np.testing.assert_allclose(size.position[:, 0], [10e-6, 2.5e-6], rtol=1e-15)
    np.testing.assert_allclose(angle.position[:, 0], [-0.5 * math.pi, 0.5 * math.pi], rtol=1e-15)
    assert np.isnan(size.velocity).all()
    assert np.isnan(angle.velocity).all()


# The same run as plants write it.
SPELLED = {
    'byte order mark': ('\ufeff' + PLAIN, 'utf-8'),
    'utf-16': (PLAIN.replace(',', '\t'), 'utf-16'),
    'semicolons and decimal commas': (
        'Time;Speed;A;P\r\n0,0;600,0;20,0;90\r\n1,5;1200,0;5,0;-90,0\r\n', 'utf-8'),
    'points that group': (
        'Time;Speed;A;P\n0,0;600;20,0;90\n1,5;1.200;5,00;-90\n', 'utf-8'),
    'commas that group': ('Time,Speed,A,P\n0,600,20,90\n1.5,"1,200",5,-90\n', 'utf-8'),
    'units in the header': (
        'Time [s],Speed (rpm),A [µm p-p],P [°]\n0,600,20,90\n1.5,1200,5,-90\n', 'utf-8'),
    'latin letters': (
        'Time [s];Speed (U/min);A [µm p-p];P [°]\n0;600;20;90\n1,5;1200;5;-90\n', 'cp1252'),
    'a row of units': ('Time,Speed,A,P\ns,rpm,um p-p,deg\n0,600,20,90\n1.5,1200,5,-90\n', 'utf-8'),
    'a row of units with digits': (
        'Time,Speed,A,P\ns,1/min,um p-p,deg\n0,600,20,90\n1.5,1200,5,-90\n', 'utf-8'),
    'a word above the names': (
        'Run,,DE,\nTime,Speed,A,P\ns,rpm,um p-p,deg\n0,600,20,90\n1.5,1200,5,-90\n', 'utf-8'),
    'all in quotes': ('"Time","Speed","A","P"\n"0","600","20","90"\n"1.5","1200","5","-90"\n',
                      'utf-8'),
    'a separator that is told': ('sep=|\nTime|Speed|A|P\n0|600|20|90\n1.5|1200|5|-90\n', 'utf-8'),
    'lines before and comments': (
        f'# a run\nInstrument;XY-3\nSerial;7\n\n{PLAIN.replace(",", ";")}', 'utf-8'),
    'other case': (PLAIN.replace('Speed', 'SPEED '), 'utf-8')}


@pytest.mark.parametrize('spelled', SPELLED)
def test_however_it_is_spelled_it_is_the_same_run(tmp_path, spelled):
    text, encoding = SPELLED[spelled]
    _, out = imported(tmp_path, text, encoding=encoding)
    np.testing.assert_allclose(read_profile(out).speed_rpm, [600.0, 1200.0], rtol=1e-12)
    assert np.diff(read_profile(out).stamp_ns).tolist() == [1_500_000_000]
    np.testing.assert_allclose(measured(out, 'amplitude').position[:, 0], [10e-6, 2.5e-6])


def test_names_may_go_over_two_rows_of_which_one_is_of_several_columns(tmp_path):
    text = 'Time,Speed,DE,,NDE,\n,,A,P,A,P\ns,rpm,um p-p,deg,um p-p,deg\n0,600,20,90,4,1\n'
    said = mapped(**{DE: (amplitude(column='DE A'), phase(column='DE P')),
                     NDE: (amplitude(column='NDE A'), phase(column='NDE P'))})
    _, out = imported(tmp_path, text, said)
    np.testing.assert_allclose(measured(out, 'amplitude').position, [[10e-6, 2e-6]])
    by_number = mapped({'column': 1, 'unit': 's'}, {'column': 2, 'unit': 'rpm'}, **{
        DE: (amplitude(column=3), phase(column=4)), NDE: (amplitude(column=5), phase(column=6))})
    _, out = imported(tmp_path, text, by_number)
    np.testing.assert_allclose(measured(out, 'amplitude').position, [[10e-6, 2e-6]])


def test_other_tongues_say_the_same_units(tmp_path):
    text = 'Temps [s];Vitesse [tr/min];A [µm c-c];P [degrés]\n0;600;20;90\n1,5;1200;5;-90\n'
    said = mapped({'column': 'Temps'}, {'column': 'Vitesse'}, **{DE: (
        {'column': 'A'}, {'column': 'P', 'sense': 'lag'})})
    _, out = imported(tmp_path, text, said, encoding='cp1252')
    np.testing.assert_allclose(read_profile(out).speed_rpm, [600.0, 1200.0], rtol=1e-12)
    np.testing.assert_allclose(measured(out, 'amplitude').position[:, 0], [10e-6, 2.5e-6])


@pytest.mark.parametrize('cell', ['n.a.', '#NV', '---', 'k.A.', '#DIV/0!', 'NaN'])
def test_a_cell_that_says_nothing_is_not_measured(tmp_path, cell):
    _, out = imported(tmp_path, PLAIN + f'2,1300,{cell},{cell}\n')
    assert np.isfinite(measured(out, 'amplitude').position[:, 0]).tolist() == [True, True, False]


def test_units_may_stand_in_the_header_alone(tmp_path):
    text, _ = SPELLED['units in the header']
    said = mapped({'column': 'Time'}, {'column': 'Speed'}, **{DE: (
        {'column': 'A'}, {'column': 'P', 'sense': 'lead'})})
    _, out = imported(tmp_path, text, said)
    np.testing.assert_allclose(read_profile(out).speed_rpm, [600.0, 1200.0], rtol=1e-12)
    np.testing.assert_allclose(measured(out, 'phase').position[:, 0], [0.5 * math.pi,
                                                                        -0.5 * math.pi])


@pytest.mark.parametrize('unit, position, velocity', [
    ('um p-p', 0.5e-6, None), ('µm pk-pk', 0.5e-6, None), ('um 0-p', 1e-6, None),
    ('um rms', math.sqrt(2.0) * 1e-6, None), ('mil p-p', 12.7e-6, None), ('m', 1.0, None),
    ('mm/s rms', None, math.sqrt(2.0) * 1e-3), ('mm/s 0-p', None, 1e-3), ('m/s', None, 1.0),
    ('in/s peak', None, 0.0254),
    # of a harmonic motion x = -a / omega^2, at 600 rpm
    ('g 0-p', 9.80665 / (20.0 * math.pi) ** 2, None),
    ('m/s² rms', math.sqrt(2.0) / (20.0 * math.pi) ** 2, None)])
def test_every_unit_of_a_plant_is_zero_to_peak_in_si(tmp_path, unit, position, velocity):
    said = mapped(**{DE: (amplitude(unit), phase('lead'))})
    _, out = imported(tmp_path, 'Time,Speed,A,P\n0,600,1,30\n', said)
    size, angle = measured(out, 'amplitude'), measured(out, 'phase')
    for given, found, turned in ((position, size.position, angle.position),
                                 (velocity, size.velocity, angle.velocity)):
        if given is None:
            assert np.isnan([found, turned]).all()
        else:
            assert found[0, 0] == pytest.approx(given, rel=1e-14)
            is_acceleration = unit.startswith(('g', 'm/s²'))
            lead = math.radians(30.0) - (math.pi if is_acceleration else 0.0)
            assert turned[0, 0] == pytest.approx(lead, abs=1e-14)


@pytest.mark.parametrize('time, cells, seconds', [
    ({'column': 'Time', 'unit': 'ms'}, ('0', '1500'), 1.5),
    ({'column': 'Time', 'unit': 'min'}, ('0', '2'), 120.0),
    ({'column': 'Time', 'format': '%H:%M:%S'}, ('23:59:59', '00:00:01'), 2.0),
    ({'column': 'Time', 'format': 'elapsed'}, ('30:59:59.5', '2 00:00:01.5'), 61202.0),
    ({'column': 'Time', 'format': 'elapsed'}, ('0:01', '1:01.25'), 60.25),
    ({'column': 'Time', 'format': '%H:%M:%S.%f'}, ('10:00:00.25', '10:00:00.75'), 0.5),
    ({'every': 0.25}, ('', ''), 0.25), ({'every': 'turn'}, ('', ''), 0.1)])
def test_time_is_kept_and_dated_where_the_table_has_no_date(tmp_path, time, cells, seconds):
    text = 'Time,Speed,A,P\n' + ''.join(
        f'{cell},{speed},1,0\n' for cell, speed in zip(cells, (600, 1200), strict=True))
    found, out = imported(tmp_path, text, mapped(time))
    stamps = read_profile(out).stamp_ns
    assert stamps.tolist() == [START, START + round(seconds * 1e9)]
    assert 'no date is told' in ' '.join(found.remarks)


@pytest.mark.parametrize('time, cells, first', [
    ({'column': 'Time', 'format': 'iso'}, '2026-03-01T10:00:00.5+01:00', '2026-03-01T09:00:00.5'),
    ({'column': 'Time', 'format': '%d.%m.%Y %H:%M:%S'}, '01.03.2026 10:00:00,5',
     '2026-03-01T10:00:00'),
    ({'column': 'Time', 'format': '%d.%m.%Y %H:%M:%S.%f', 'zone': 'Europe/Berlin'},
     '01.07.2026 10:00:00,5', '2026-07-01T08:00:00.5'),
    ({'column': 'Time', 'unit': 's'}, '1772359200.5', '2026-03-01T10:00:00.5'),
    ({'column': 'Time', 'format': 'excel'}, '46082,4375', '2026-03-01T10:30:00'),
    ({'column': 'Time', 'unit': 's', 'start': '2026-03-01T10:00:00'}, '0.5',
     '2026-03-01T10:00:00.5')])
def test_a_date_is_a_date(tmp_path, time, cells, first):
    if not time.get('format', '').endswith('%S'):
        _, out = imported(tmp_path, f'Time;Speed;A;P\n{cells};600;1;0\n', mapped(time))
        wanted = datetime.fromisoformat(first + '+00:00').timestamp()
        assert read_profile(out).stamp_ns[0] == round(wanted * 1e9)
    else:
        with pytest.raises(InputError, match='row 2: time: must be a time of the format'):
            imported(tmp_path, f'Time;Speed;A;P\n{cells};600;1;0\n', mapped(time))


def test_rows_without_a_time_are_steady_points(tmp_path):
    found, out = imported(tmp_path, PLAIN, mapped(None))
    assert np.diff(read_profile(out).stamp_ns).tolist() == [10 * 10**9]
    assert 'each row is taken as a steady point' in found.remarks[0]


def test_several_channels_of_which_some_have_no_phase_or_no_value(tmp_path):
    text = 'Time,Speed,A,P,B\n0,600,20,90,1\n1,610,,n/a,2\n2,620,30,95,-\n'
    _, out = imported(tmp_path, text, mapped(**{
        DE: (amplitude(), phase()), NDE: (amplitude('mm/s rms', 'B'),)}))
    size, angle = measured(out, 'amplitude'), measured(out, 'phase')
    assert size.names == (DE, NDE)
    np.testing.assert_allclose(size.position[:, 0], [10e-6, math.nan, 15e-6])
    np.testing.assert_allclose(size.velocity[:, 1], [math.sqrt(2.0) * 1e-3,
                                                     2.0 * math.sqrt(2.0) * 1e-3, math.nan])
    assert np.isfinite(angle.position[:, 0]).tolist() == [True, False, True]
    assert np.isnan(angle.position[:, 1]).all()


def test_all_faults_of_a_table_are_told_at_once_with_their_rows(tmp_path):
    text = ('Time,Speed,A,P\n0,600,20,90\n1,fast,20,90\n0.5,610,-3,90\n2,,20,ninety\n'
            '3,620,inf,1\n4,-5,1,1\n')
    with pytest.raises(InputError) as raised:
        imported(tmp_path, text)
    lines = str(raised.value).splitlines()
    assert [line.split('run.csv: ')[1] for line in lines] == [
        "row 3: speed: must be a number, got 'fast'",
        f"row 4: {DE} amplitude: must be >= 0, got '-3'",
        "row 4: time: must not go backwards, got '0.5'",
        f"row 5: {DE} phase: must be a number, got 'ninety'",
        "row 5: speed: must be told and >= 0, got ''",
        f"row 6: {DE} amplitude: must be a number, got 'inf'",
        "row 7: speed: must be told and >= 0, got '-5'"]
    assert not (tmp_path / 'out.mcap').exists()


MAP_FAULTS = """machine: 3fan
tme: {column: Time}
speed: {column: Speed, unit: rpms, ratio: 0}
channels:
  de x: {amplitude: {column: A, unit: um}}
  nde_x:
    amplitude: {column: A, unit: furlong p-p}
    phase: {column: P, unit: grad}
"""


def test_all_faults_of_a_map_are_told_at_once_with_their_keys(tmp_path):
    (tmp_path / 'map.yaml').write_text(MAP_FAULTS)
    (tmp_path / 'run.csv').write_text(PLAIN)
    with pytest.raises(InputError) as raised:
        import_table(tmp_path / 'run.csv', tmp_path / 'map.yaml', tmp_path / 'out.mcap')
    told = str(raised.value)
    for words in ('machine: must be a name', 'tme: is not a known key; did you mean time?',
                  "speed.unit: must be rpm, Hz, rad/s or deg/s, got 'rpms'",
                  'speed.ratio: must be finite and not 0', 'channels.de x: must be a name',
                  'channels.de x.amplitude.unit: must say p-p (peak-to-peak), 0-p',
                  'channels.nde_x.amplitude.unit: must be a displacement, velocity',
                  "channels.nde_x.phase.unit: must be deg or rad, got 'grad'",
                  'channels.nde_x.phase.sense: must be said: lag'):
        assert f'map.yaml: {words}' in told
    assert len(told.splitlines()) == 9


@pytest.mark.parametrize('said, words', [
    (mapped(**{DE: ({'column': 'A'},)}), 'amplitude.unit: must be a displacement'),
    (mapped(**{DE: (amplitude(), {'column': 'P', 'unit': 'deg'})}), 'phase.sense: must be said'),
    (mapped(speed={'column': 'Speed'}), 'speed.unit: must be said: rpm, Hz'),
    (mapped({'column': 'Time'}), 'time.unit: must be said'),
    (mapped({'column': 'Time', 'every': 1.0}), 'time: must have either a column or'),
    (mapped({'every': 'row'}), 'time.every: must be turn or'),
    (mapped({'column': 'Time', 'unit': 's', 'zone': 'Europe/Nowhere'}), 'time.zone: must be a'),
    (mapped({'column': 'Time', 'unit': 's', 'start': 'soon'}), 'time.start: must be a time'),
    (mapped(speed={'column': 'Sped', 'unit': 'rpm'}), "no column 'Sped'; did you mean 'speed'"),
    (mapped(speed={'column': 9, 'unit': 'rpm'}), 'must be a column from 1 to 4, got 9')])
def test_what_nobody_can_know_is_asked_for(tmp_path, said, words):
    with pytest.raises(InputError, match=words):
        imported(tmp_path, PLAIN, said)


def test_a_unit_that_the_header_contradicts_is_refused(tmp_path):
    with pytest.raises(InputError, match="which says 'mm/s rms', got 'um p-p'"):
        imported(tmp_path, PLAIN.replace('A', 'A [mm/s rms]'))


@pytest.mark.parametrize('titled, said, agree', [
    ('um p-p', 'um 0-p', False), ('mils', 'mil p-p', True), ('ips', 'in/s pk', True),
    ('micron pk-pk', 'um p-p', True), ('mm/s', 'm/s rms', False), ('deg', 'um p-p', False)])
def test_units_agree_by_what_they_mean(tmp_path, titled, said, agree):
    text = PLAIN.replace('A', f'A [{titled}]')
    if agree:
        assert imported(tmp_path, text, mapped(**{DE: (amplitude(said), phase())}))
    else:
        with pytest.raises(InputError, match='must agree with the name of the column'):
            imported(tmp_path, text, mapped(**{DE: (amplitude(said), phase())}))


def test_a_name_that_two_columns_have_is_refused_with_their_numbers(tmp_path):
    text = 'Time,Speed,A,A,P\n0,600,1,2,3\n'
    with pytest.raises(InputError, match=r"'A' names 2 columns.*3, 4"):
        imported(tmp_path, text)
    _, out = imported(tmp_path, text, mapped(**{DE: (amplitude(column=4), phase(column=5))}))
    np.testing.assert_allclose(measured(out, 'amplitude').position[:, 0], [1e-6])


def test_cells_that_are_missing_at_the_end_of_a_row_say_nothing(tmp_path):
    _, out = imported(tmp_path, PLAIN + '2,1300\n')
    assert np.isfinite(measured(out, 'amplitude').position[:, 0]).tolist() == [True, True, False]


@pytest.mark.parametrize('text, words', [
    ('', 'is empty'), ('Time,Speed,A,P\n', 'has no row below row 1'), ('\0\1\2', 'is no text')])
def test_what_is_no_table_is_refused(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        imported(tmp_path, text)


def test_a_workbook_is_read_with_its_dates_and_the_sheet_that_is_named(tmp_path):
    book = Workbook()
    book.active.append(['nothing here'])
    page = book.create_sheet('run 2')
    page.append(['Instrument', 'XY-3'])
    page.append(['Time', 'Speed', 'A', 'P'])
    for second, (speed, size, angle) in enumerate(((600, 20.0, 90), (1200, 5.0, -90))):
        page.append([datetime(2026, 3, 1, 10, 0, second), speed, size, angle])
    book.save(tmp_path / 'run.xlsx')
    said = {**mapped({'column': 'Time', 'format': 'iso'}), 'sheet': 'run 2'}
    out = tmp_path / 'out.mcap'
    import_table(tmp_path / 'run.xlsx', said, out)
    wanted = round(datetime.fromisoformat('2026-03-01T10:00:00+00:00').timestamp()) * 10**9
    assert read_profile(out).stamp_ns.tolist() == [wanted, wanted + 10**9]
    np.testing.assert_allclose(measured(out, 'amplitude').position[:, 0], [10e-6, 2.5e-6])
    with pytest.raises(InputError, match=r'has no sheet .*there are Sheet, run 2'):
        import_table(tmp_path / 'run.xlsx', {**said, 'sheet': 'run'}, tmp_path / 'b.mcap')
    (tmp_path / 'no.xlsx').write_bytes(b'PK\3\4 and no more')
    with pytest.raises(InputError, match=r'no\.xlsx: is not a workbook'):
        import_table(tmp_path / 'no.xlsx', said, tmp_path / 'b.mcap')


def universal(path, *, complex_data, spec=19, is_even=False):
    """Write speed over the abscissa of data set 58 with an independent writer."""
    speeds = np.array([600.0, 1200.0])
    vector = np.array([10e-6 * np.exp(-0.5j * np.pi), 2.5e-6 * np.exp(0.5j * np.pi)])
    found = pyuff.prepare_58(
        func_type=1, rsp_node=12, rsp_dir=1, ref_dir=1, ref_node=1, binary=0, id1='DE hor',
        data=vector if complex_data else np.abs(vector), x=speeds, abscissa_spec_data_type=spec,
        abscissa_axis_units_lab='rpm', ordinate_axis_units_lab='m', ordinate_spec_data_type=8,
        abscissa_spacing=int(is_even), abscissa_min=600.0, abscissa_inc=600.0,
        ord_data_type=6 if complex_data else 4, num_pts=2,
        orddenom_spec_data_type=0)
    pyuff.UFF(str(path)).write_sets([found], mode='overwrite')


def in_binary(path):
    """Turn the numbers of a universal file into the binary ones of a data set 58b."""
    lines = path.read_text().splitlines()
    numbers = [float(number) for line in lines[13:-1] for number in line.split()]
    data = struct.pack(f'<{len(numbers)}d', *numbers)
    head = f'    58b{1:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}'
    path.write_bytes('\n'.join([lines[0], head, *lines[2:13], '']).encode() + data
                     + b'\n    -1\n')


@pytest.mark.parametrize('complex_data, is_binary', [(True, False), (False, False), (True, True)])
def test_a_universal_file_is_read_with_vectors_or_amplitudes(tmp_path, complex_data, is_binary):
    universal(tmp_path / 'run.uff', complex_data=complex_data, is_even=is_binary)
    if is_binary:
        in_binary(tmp_path / 'run.uff')
    name = 'DE hor amplitude' if complex_data else 'DE hor'
    parts = (amplitude('m', name), phase('lead', 'DE hor phase', 'rad'))
    out = tmp_path / 'out.mcap'
    import_table(tmp_path / 'run.uff', mapped(
        None, {'column': 'speed'}, **{DE: parts if complex_data else parts[:1]}), out)
    np.testing.assert_allclose(read_profile(out).speed_rpm, [600.0, 1200.0], rtol=1e-6)
    np.testing.assert_allclose(measured(out, 'amplitude').position[:, 0], [10e-6, 2.5e-6],
                               rtol=1e-5)
    if complex_data:
        np.testing.assert_allclose(measured(out, 'phase').position[:, 0],
                                   [-0.5 * math.pi, 0.5 * math.pi], rtol=1e-5)
    (tmp_path / 'no.uff').write_text('no universal file\n')
    with pytest.raises(InputError, match=r'no\.uff: '):
        import_table(tmp_path / 'no.uff', mapped(), tmp_path / 'b.mcap')


def test_a_bag_directory_is_written_as_one(tmp_path):
    (tmp_path / 'run.csv').write_text(PLAIN)
    import_table(tmp_path / 'run.csv', mapped(), tmp_path / 'bag', start_ns=START)
    assert read_profile(tmp_path / 'bag').stamp_ns[0] == START
    with pytest.raises(InputError, match='bag: exists'):
        import_table(tmp_path / 'run.csv', mapped(), tmp_path / 'bag', start_ns=START)


def test_a_run_up_gets_the_time_of_its_revolutions(tmp_path):
    text = 'Speed,A,P\n1200,2.5,-90\n600,1.0,180\n'  # sorted the wrong way round
    _, out = imported(tmp_path, text, mapped({'every': 'turn'}, **{
        DE: (amplitude('um 0-p'), phase('lead'))}))
    profile = read_profile(out)
    assert profile.stamp_ns.tolist() == [START, START + 100_000_000]  # a turn at 600 rpm
    np.testing.assert_allclose(profile.speed, [20.0 * math.pi, 40.0 * math.pi], rtol=1e-15)
    np.testing.assert_allclose(measured(out, 'amplitude').position[:, 0], [1.0e-6, 2.5e-6])
    with pytest.raises(InputError, match='speed must be > 0 where each row is a turn'):
        imported(tmp_path, 'Speed,A,P\n0,1,1\n600,1,1\n', mapped({'every': 'turn'}))


def test_the_measured_run_up_ramps_at_228_rpm_per_second(tmp_path):
    import_run_up(tmp_path / 'rk4.mcap')
    [batch] = speed_profile(tmp_path / 'rk4.mcap')
    assert len(batch.speed) == 210
    ramp = (batch.speed[-1] - batch.speed[0]) / ((batch.stamp_ns[-1] - batch.stamp_ns[0]) * 1e-9)
    assert ramp == pytest.approx(rpm_to_rad_s(228.0), rel=0.05)


ONE_CHANNEL = [
    '--machine', 'plant_fan', '--channel', 'drive_end_journal_x', '--speed', 'rpm',
    '--speed-unit', 'rpm', '--amplitude', 'amp_1x_um', '--amplitude-unit', 'um 0-p',
    '--phase', 'phase_1x_deg', '--phase-unit', 'deg', '--phase-sense', 'lead']


def test_the_table_that_excel_wrote_ends_in_a_verdict(tmp_path, capsys, cache):
    out, source = tmp_path / 'run.mcap', CASES / 'csv_with_bom' / 'run_up.csv'
    assert main(['import', str(source), '-o', str(out), *ONE_CHANNEL]) == 0
    assert 'plant_fan: 49 rows in 480.0 s, 300 to 1500 rpm' in capsys.readouterr().out
    assert main(['compare', str(out), 'config/plant_fan.yaml', '-o', str(tmp_path / 'compared'),
                 '--cache', str(cache)]) == 0
    said = capsys.readouterr().out
    assert '49      49' in said  # all points are used
    assert 'verdict   passes' in said


@pytest.mark.parametrize('options, words', [
    ([], ['which column is what must be said', '--map MAP.yaml']),
    (ONE_CHANNEL[:8], ['--amplitude: is missing']),
    ([*ONE_CHANNEL[:10], '--phase', 'phase_1x_deg'], ['--phase-sense: must be said']),
    (ONE_CHANNEL[2:], ['--machine: is missing']),
    ([*ONE_CHANNEL[:2], *ONE_CHANNEL[4:]], ['--channel: is missing']),
    ([*ONE_CHANNEL, '--time-every', 'often'], ['--time-every: must be turn or']),
    ([*ONE_CHANNEL, '--map', 'map.yaml'], ['--map: already says'])])
def test_options_that_say_too_little_are_refused_by_their_names(
        tmp_path, capsys, options, words):
    source = CASES / 'csv_with_bom' / 'run_up.csv'
    assert main(['import', str(source), '-o', str(tmp_path / 'run.mcap'), *options]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert not (tmp_path / 'run.mcap').exists()
