"""Files of bodies that bend are read as their programs write them, and refused with all faults."""

from pathlib import Path

import beams
from foundations import REFERENCE
import numpy as np
import pytest
import pyuff
import scipy.io
import scipy.sparse

import rotorsoil_ros as rs
from rotorsoil_ros.case.flexible import matrices, tables
from rotorsoil_ros.case.flexible.files import read_flexible
from rotorsoil_ros.case.flexible.foreign import content_of
from rotorsoil_ros.case.flexible.universal import modes as universal
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import rad_s_to_hz

ELEMENTS = 10
# Ten straight elements in twist and stretch: (pi / 10)^2 / 24.
CLOSED = 4.2e-3
DOFS = 'node,name,kind,x,y,z,direction'
UP_TO = 340.0


def hertz(body):
    return rad_s_to_hz(body.frequencies)


def dofs_text(first='node'):
    """Return a table of the beam: all motions of its ends and a seat in the middle."""
    lines = [f'{first},name,kind,x,y,z,direction']
    for node, name, kind in ((1, 'left', 'contact'), (ELEMENTS + 1, 'right', 'contact'),
                             (ELEMENTS // 2 + 1, 'middle', 'seat')):
        y = beams.nodes(ELEMENTS)[node - 1]
        for direction, axis in enumerate(beams.AXES):
            index = node if first == 'node' else 6 * (node - 1) + direction + 1
            lines.append(f'{index},{name},{kind},0,{y:.9g},0,{axis}')
    return '\n'.join(lines) + '\n'


def calculix(folder, style='{row} {column}  {value:.13e}', *, end='\n', shuffle=False):
    """Write the beam as CalculiX does, by means of our own."""
    order = np.arange(6 * (ELEMENTS + 1))
    if shuffle:
        np.random.default_rng(3).shuffle(order)
    for suffix, matrix in zip(('sti', 'mas'), beams.matrices(ELEMENTS), strict=True):
        whole = matrix[np.ix_(order, order)]
        lines = [style.format(row=row + 1, column=column + 1, value=whole[row, column])
                 for column in range(len(whole)) for row in range(column + 1)]
        (folder / f'beam.{suffix}').write_bytes((end.join(lines) + end).encode())
    (folder / 'beam.dof').write_bytes(end.join(
        f'{place // 6 + 1}.{place % 6 + 1}' for place in order.tolist()).encode() + end.encode())
    (folder / 'dofs.csv').write_text(dofs_text())
    return folder


def read_beam(folder):
    return read_flexible(stiffness=folder / 'beam.sti', mass=folder / 'beam.mas',
                         dofs=folder / 'dofs.csv', up_to_hz=UP_TO, loss_factor=0.04)


@pytest.mark.parametrize('style, end, shuffle', [
    ('{row} {column}  {value:.13e}', '\n', False),
    ('{row} {column}  {value:.13e}', '\n', True),     # rows in the order of its own solver
    ('  {row}\t{column} {value:.13e}  ', '\r\n', False),
    ('{row} {column} {value:.13e}\n', '\n\n', False)])
def test_a_beam_of_calculix_has_the_frequencies_of_a_beam(tmp_path, style, end, shuffle):
    body = read_beam(calculix(tmp_path, style, end=end, shuffle=shuffle))
    expected = beams.closed_form()
    np.testing.assert_allclose(hertz(body), expected[expected < UP_TO], rtol=CLOSED)
    assert body.mass[0, 0] == pytest.approx(beams.DENSITY * beams.AREA * beams.LENGTH, rel=1e-9)
    # Its places are those of the table, whichever row they have.
    np.testing.assert_allclose(body.rows, beams.rigid(ELEMENTS)[
        [*range(6), *range(6 * ELEMENTS, 6 * ELEMENTS + 6), *range(30, 36)]], atol=1e-9)


def test_exponents_of_fortran_are_exponents(tmp_path):
    calculix(tmp_path)
    exact = read_beam(tmp_path)
    for name in ('beam.sti', 'beam.mas'):
        path = tmp_path / name
        path.write_text(path.read_text().replace('e', 'D'))
    np.testing.assert_allclose(read_beam(tmp_path).stiffness, exact.stiffness, rtol=1e-12)


def ccx(name):
    return REFERENCE / f'ccx_{name}'


def test_what_calculix_has_written_is_the_bar_of_its_input(tmp_path):
    nodes = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.3), (0.0, 0.3)]
    (tmp_path / 'dofs.csv').write_text('\n'.join([DOFS, *(
        f'{4 * layer + corner + 1},end_{layer}_{corner},probe,{x},{0.5 * layer},{z},{axis}'
        for layer in (0, 2) for corner, (x, z) in enumerate(nodes) for axis in 'xyz')]))
    body = read_flexible(stiffness=ccx('bar.sti'), mass=ccx('bar.mas'),
                         dofs=tmp_path / 'dofs.csv', up_to_hz=5000.0, loss_factor=0.0)
    mass = 7850.0 * 0.4 * 1.0 * 0.3
    assert body.mass[0, 0] == pytest.approx(mass, rel=1e-10)
    # Centre of gravity, from the static moments m z, -m y and m x.
    assert [body.mass[0, 4], -body.mass[2, 4], body.mass[2, 3]] == pytest.approx(
        [mass * 0.15, mass * 0.2, mass * 0.5], rel=1e-9)


def test_a_held_bar_gives_way_as_calculix_says_itself():
    stiffness = matrices.read(ccx('held.sti')).toarray()
    order = matrices.order_of_calculix(ccx('held.dof'), len(stiffness))
    assert (1, 1) not in order  # of the held end no motion is left
    load = np.zeros(len(stiffness))
    for node, direction, force in ((9, 1, 1e6), (11, 3, -2e6), (12, 2, 3e6)):
        load[order[node, direction]] = force
    moved = np.linalg.solve(stiffness, load)
    told = [line.split() for line in ccx('held.dat').read_text().splitlines() if line.strip()][1:]
    assert len(told) == 4
    for node, *expected in told:
        got = [moved[order[int(node), direction]] for direction in (1, 2, 3)]
        np.testing.assert_allclose(got, np.array(expected, dtype=float), rtol=1e-6)


def told(build):
    with pytest.raises(InputError) as refused:
        build()
    return [line.partition(': ')[2].replace("'", '') for line in str(refused.value).splitlines()]


@pytest.mark.parametrize('text, faults', [
    ('1 1 2.0\n\n1 two 3.0\n0 2 1.0\n2 2 inf\n2 2\n',
     ['line 3: column must be a whole number from 1 on, got two',
      'line 4: row must be a whole number from 1 on, got 0',
      'line 5: value must be a finite number, got inf',
      'line 6: must be row, column and value, got 2 2']),
    ('1 1 2.0\n1 2 1.0\n2 1 1.0\n2 2 2.0\n',
     ['must hold one triangle of a symmetric matrix, got both']),
    ('1 1 2.0\n1 2 1.0\n1 2 1.0\n2 2 2.0\n', ['row 1, column 2 stands here 2 times']),
    ('1.5 1 2.0\n', ['line 1: row must be a whole number from 1 on, got 1.5']),
    ('\n\n', ['is empty']),
    ('300000 300000 1.0\n', ['must have up to 200000 motions, got 300000'])])
def test_every_damaged_line_of_a_matrix_is_told(tmp_path, text, faults):
    path = tmp_path / 'job.sti'
    path.write_text(text)
    assert told(lambda: matrices.read(path)) == faults


@pytest.mark.parametrize('text, faults', [
    ('1.1\n1.2\n\n1.x\n1.1\nseven\n',
     ['line 4: must be node.direction, got 1.x', 'line 5: 1.1 stands here twice',
      'line 6: must be node.direction, got seven']),
    ('1.1\n1.2\n', ['must name the 3 motions of the matrices beside it, got 2'])])
def test_every_damaged_line_of_an_order_is_told(tmp_path, text, faults):
    path = tmp_path / 'job.dof'
    path.write_text(text)
    assert told(lambda: matrices.order_of_calculix(path, 3)) == faults


def universal_text(frequency, shapes, mass, numbers):
    """Return data sets 55 of real normal modes, three values a node, as their definition says."""
    lines = []
    for mode, (own, shape) in enumerate(zip(frequency, shapes, strict=True), 1):
        lines += ['    -1', '    55', *['NONE'] * 5,
                  ''.join(f'{value:10d}' for value in (1, 2, 2, 8, 2, 3)),
                  ''.join(f'{value:10d}' for value in (2, 4, 1, mode)),
                  ''.join(f'{value:13.5e}' for value in (own, mass, 0.0, 0.0))]
        for node, moved in zip(numbers, shape, strict=True):
            lines += [f'{node:10d}', ''.join(f'{value:13.5e}' for value in moved)]
        lines.append('    -1')
    return '\n'.join(lines) + '\n'


def beam_modes(count=6, mass=12.5):
    """Return frequencies, translations (m, nodes, 3) of a modal mass, exact ones, and nodes."""
    frequency, shapes = beams.modes(ELEMENTS)
    moved = shapes.reshape(ELEMENTS + 1, 6, -1)[:, :3, :count].transpose(2, 0, 1)
    return frequency[:count], np.sqrt(mass) * moved, moved, list(range(101, 102 + ELEMENTS))


@pytest.mark.parametrize('name', ['beam.unv', 'beam.uff', 'beam.csv'])
def test_modes_of_a_universal_file_are_those_of_the_beam(tmp_path, name):
    frequency, shapes, exact, numbers = beam_modes()
    path = tmp_path / name
    path.write_text(universal_text(frequency, shapes, 12.5, numbers))
    names, found, moved = universal(path)
    np.testing.assert_allclose(found, beams.closed_form()[:6], rtol=CLOSED)
    assert names[:4] == ['node_101_x', 'node_101_y', 'node_101_z', 'node_102_x']
    # Six printed digits; and as every shape has a sign, the largest motion is taken positive.
    expected = exact.reshape(6, -1).T
    expected = expected * np.sign(expected[np.abs(expected).argmax(axis=0), range(6)])
    got = moved * np.sign(moved[np.abs(expected).argmax(axis=0), range(6)])
    np.testing.assert_allclose(got, expected, atol=1e-5 * np.abs(expected).max())


def test_a_universal_file_that_pyuff_writes_reads_the_same(tmp_path):
    frequency, shapes, _, numbers = beam_modes()
    (tmp_path / 'own.unv').write_text(universal_text(frequency, shapes, 12.5, numbers))
    file = pyuff.UFF(str(tmp_path / 'theirs.unv'))
    for mode, (own, shape) in enumerate(zip(frequency, shapes, strict=True), 1):
        file.write_sets(pyuff.prepare_55(
            model_type=1, id1='NONE', id2='NONE', id3='NONE', id4='NONE', id5='NONE',
            analysis_type=2, data_ch=2, spec_data_type=8, data_type=2, load_case=1, mode_n=mode,
            freq=own, modal_m=12.5, modal_damp_vis=0.0, modal_damp_his=0.0,
            node_nums=np.array(numbers), r1=shape[:, 0], r2=shape[:, 1], r3=shape[:, 2]), 'add')
    theirs, own = universal(tmp_path / 'theirs.unv'), universal(tmp_path / 'own.unv')
    assert theirs[0] == own[0]
    for one, other in zip(theirs[1:], own[1:], strict=True):
        np.testing.assert_allclose(one, other, atol=2e-5 * np.abs(other).max())


@pytest.mark.parametrize('change, said', [
    ({'mass': 0.0}, 'data set 55 number 1: must have a modal mass > 0 kg, got 0'),
    ({'frequency': [0.0, 50.0]}, 'data set 55 number 1: must be an elastic mode with a frequency'),
    ({'numbers': ([1, 2], [1, 3])}, 'data set 55 number 2: has other nodes than the first'),
    ({'kind': 58}, 'holds no data set 55, mode shapes')])
def test_what_is_wrong_with_a_universal_file_is_told(tmp_path, change, said):
    first, second = change.get('numbers', ([1, 2], [1, 2]))
    frequency, mass = change.get('frequency', [40.0, 50.0]), change.get('mass', 1.0)
    shape = [[(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]]
    text = (universal_text(frequency[:1], shape, mass, first)
            + universal_text(frequency[1:], shape, mass, second))
    path = tmp_path / 'modes.unv'
    path.write_text(text.replace('    55\n', f'{change.get("kind", 55):6d}\n'))
    [line] = told(lambda: universal(path))
    assert line.startswith(said)


MARKET = '%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 4.0\n2 2 5.0\n'


@pytest.mark.parametrize('name', ['K.sti', 'K.dat', 'K.txt', 'K.hb', 'K.inp', 'K'])
def test_matrix_market_is_read_whatever_it_is_called(tmp_path, name):
    (tmp_path / name).write_text(MARKET)
    assert matrices.read(tmp_path / name).diagonal().tolist() == [4.0, 5.0]


FOREIGN = {
    'K.mtx': [
        (b'** substructure\n*USER ELEMENT, NODES=4\n', 'Abaqus or CalculiX', 'MATRIXSTORAGE'),
        (b'*MATRIX,TYPE=STIFFNESS\n1.0, 2.0\n', 'Abaqus or CalculiX', 'abaqus-mtx-parser'),
        (b'** a mesh\n*NODE\n1, 0., 0., 0.\n', 'an input', 'MATRIXSTORAGE'),
        (b'*HEADING\nmodel\n*NODE\n', 'an input', 'MATRIXSTORAGE'),
        (b'DMIG    KAAX    0       6       1       0\n', 'DMIG of Nastran', 'read_bdf'),
        (b'$TITLE   = X\nDMIG*   KAAX\n', 'DMIG of Nastran', 'read_bdf'),
        (b'SOL 103\nCEND\nBEGIN BULK\nDMIG,KAAX,0,6,1,0\n', 'DMIG of Nastran', 'read_bdf'),
        (b'\x04\x00\x00\x00\x03\x00\x00\x00', 'an op2 of Nastran', 'read_op2'),
        (b'       4       4       6       2KAAX    1P,5E16.9\n       1       1       4\n',
         'an op4 of Nastran', 'read_op4'),
        (b'title                  KEY\n 10 2 3 5 0\nRSA      4 4 10 0\n(26I3) (26I3) (5E15.8)\n',
         'Harwell-Boeing', 'load_km'),
        (b'PK\x03\x04\x14\x00\x00\x00\x08\x00modelDescription.xml', 'functional mock-up',
         'runs in time'),
        (b'PK\x03\x04\x14\x00\x00\x00\x00\x00\x00\x00!\x00data.npy', 'of numpy', 'load_npz'),
        (b'MATLAB 5.0 MAT-file', 'of MATLAB', 'loadmat'), (b'\x89HDF\r\n', 'HDF5', 'h5py')],
    'K.op2': [(b'anything', 'an op2', 'pyNastran')],
    'K.op4': [(b'\x18\x00\x00\x00binary', 'an op4', 'pyNastran')],
    'K.pch': [(b'no words', 'DMIG', 'mmwrite')],
    'K.full': [(b'\x00\x01', 'of ANSYS', 'load_km')],
    'K.sub': [(b'\x00\x01', 'of ANSYS', 'load_km')],
    'K.fmu': [(b'', 'functional mock-up', 'stiffness and mass')],
    'K.xlsx': [(b'PK\x03\x04....[Content_Types].xml', 'a workbook', 'CSV')]}


@pytest.mark.parametrize('name, content, whose, way', [
    (name, *one) for name, contents in FOREIGN.items() for one in contents])
def test_a_file_of_another_program_is_refused_with_the_way(tmp_path, name, content, whose, way):
    path = tmp_path / name
    path.write_bytes(content)
    [line] = told(lambda: matrices.read(path))
    assert whose in line
    assert way in line


def test_triples_without_their_suffix_are_told_how_to_be_called(tmp_path):
    (tmp_path / 'K.txt').write_text('1 1 2.0\n')
    [line] = told(lambda: matrices.read(tmp_path / 'K.txt'))
    assert line == ('must begin with %%MatrixMarket, got 1 1 2.0\\n; call the stiffness and mass '
                    'of CalculiX .sti and .mas')


@pytest.mark.parametrize('text, said', [
    ('%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 4.0\n', 'is no whole'),
    ('%%MatrixMarket matrix coordinate real general\n2 3 1\n1 1 4.0\n', 'must be square'),
    ('%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 4.0 1.0\n', 'must be real'),
    ('%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 nan\n', 'finite numbers'),
    ('%%MatrixMarket matrix coordinate real general\n1 1 1\n2 1 1.0\n', 'is no whole'),
    ('%%MatrixMarket matrix coordinate real general\nx\n', 'is no whole'),
    ('', 'must begin with')])
def test_damaged_matrix_market_is_refused_in_one_line(tmp_path, text, said):
    path = tmp_path / 'K.mtx'
    path.write_text(text)
    [line] = told(lambda: matrices.read(path))
    assert said in line


@pytest.mark.parametrize('text, faults', [
    (f'{DOFS}\n1,a,chair,0,0,0,x\n2,B!,seat,0,zero,0,up\n0,c,seat,0,0,inf,z\n4,d,seat,0,0\n',
     ['line 2: kind must be one of seat, contact, probe, internal, got chair',
      'line 3: direction must be one of x, y, z, rx, ry, rz, or xyz of a node, got up',
      'line 3: name must be small letters, digits and _, got B!',
      'line 3: y [m] must be a finite number, got zero',
      'line 4: z [m] must be a finite number, got inf',
      'line 4: node must be a whole number from 1 on, got 0',
      'line 5: must have 7 cells, got 5']),
    ('node,name,kind,x,y,direction,colour,kind\n',
     ['line 1: column colour is not known; known are name, kind, x, y, z, direction, index, '
      'node, area',
      'line 1: column z is missing', 'line 1: column kind stands here twice']),
    (f'{DOFS},area\n1,a,seat,0,0,0,x,-2\n', ['line 2: area must be >= 0 m^2, got -2'])])
def test_every_fault_of_a_table_of_motions_is_told(tmp_path, text, faults):
    path = tmp_path / 'dofs.csv'
    assert told(lambda: tables.motions(path, text)) == faults


def test_every_fault_of_modes_is_told(tmp_path):
    path = tmp_path / 'modes.csv'
    assert told(lambda: tables.modes(
        path, 'dof,mode_1,mode_2\nhz,12,x\na_x,1.0,nan\na_z,1.0\n')) == [
        'line 2: mode_2 must be a finite number, got x',
        'line 3: mode_2 must be a finite number, got nan',
        'line 4: must have 3 cells, got 2']
    assert told(lambda: tables.modes(
        path, 'dof,mode_1,mode_2\nhz,0,-3\na_x,1,1\na_x,1,1\n')) == [
        'motion a_x stands here twice',
        'frequency of mode_1 must be > 0 Hz, of elastic modes only, got 0; rigid motion belongs '
        'into the file rigid',
        'frequency of mode_2 must be > 0 Hz, of elastic modes only, got -3; rigid motion belongs '
        'into the file rigid']


def test_many_faults_are_counted_and_not_all_told(tmp_path):
    text = '\n'.join(['x,y'] * 30)
    lines = told(lambda: tables.numbers_of(tmp_path / 'residual.csv', text))
    assert len(lines) == 21
    assert lines[-1] == 'and 40 more like these'


@pytest.fixture
def beam_files(tmp_path):
    """Return a folder with the beam by its modes."""
    frequency, shapes = beams.modes(ELEMENTS)
    kept, names = 6, [f'{place}_{axis}' for place in ('patch_1', 'patch_2', 'b1')
                      for axis in beams.AXES]
    rows = [*range(6), *range(6 * ELEMENTS, 6 * ELEMENTS + 6), *range(30, 36)]
    scaled = shapes[rows] / (2.0 * np.pi * frequency)
    stiffness, mass = beams.matrices(ELEMENTS)
    rigid = beams.rigid(ELEMENTS)
    for name, table in (
            ('residual', scaled[:, kept:] @ scaled[:, kept:].T),
            ('rigid', np.concatenate([rigid.T @ mass @ rigid, rigid[rows]]))):
        np.savetxt(tmp_path / f'{name}.csv', table, delimiter=',')
    (tmp_path / 'modes.csv').write_text('\n'.join([
        'dof,' + ','.join(f'mode_{mode + 1}' for mode in range(kept)),
        'hz,' + ','.join(map(repr, frequency[:kept].tolist())),
        *(f'{name},' + ','.join(map(repr, row.tolist()))
          for name, row in zip(names, shapes[rows, :kept], strict=True))]))
    lines = dofs_text('index').replace('left', 'patch_1').replace('right', 'patch_2')
    (tmp_path / 'dofs.csv').write_text(lines.replace('middle', 'b1'))
    for name, matrix in zip('KM', (stiffness, mass), strict=True):
        scipy.io.mmwrite(tmp_path / f'{name}.mtx', scipy.sparse.coo_matrix(matrix), precision=16)
    return tmp_path


def by_modes(folder, **files):
    return read_flexible(loss_factor=0.04, **{name: folder / f'{name}.csv' for name in (
        'modes', 'residual', 'rigid')}, **files)


def test_modes_and_matrices_of_one_beam_are_one_body(beam_files):
    tabled = by_modes(beam_files)
    whole = read_flexible(stiffness=beam_files / 'K.mtx', mass=beam_files / 'M.mtx',
                          dofs=beam_files / 'dofs.csv', loss_factor=0.04,
                          up_to_hz=float(hertz(tabled)[-1]) + 1.0)
    np.testing.assert_allclose(whole.stiffness, tabled.stiffness, rtol=1e-9)
    np.testing.assert_allclose(whole.mass, tabled.mass, rtol=1e-9, atol=1e-6)
    # Their flexibility at rest, the signs of the modes apart.
    for one in (whole, tabled):
        scaled = one.shapes / np.sqrt(one.stiffness)
        np.testing.assert_allclose(
            scaled @ scaled.T + one.residual,
            (tabled.shapes / tabled.stiffness) @ tabled.shapes.T + tabled.residual,
            atol=1e-12)


def test_arrays_and_files_of_one_beam_are_one_body(beam_files):
    tabled = by_modes(beam_files)
    again = rs.FlexibleBody.from_modes(
        tabled.dofs, frequencies=tabled.frequencies, shapes=tabled.shapes,
        residual=tabled.residual, mass=tabled.mass, loss_factor=0.04)
    np.testing.assert_allclose(again.rows, tabled.rows, atol=1e-12)
    rows = [*range(6), *range(6 * ELEMENTS, 6 * ELEMENTS + 6), *range(30, 36)]
    elements = rs.FiniteElements.at(
        *beams.matrices(ELEMENTS), dict(zip(rows, tabled.dofs, strict=True)))
    body = elements.body(float(tabled.frequencies[-1]) + 1.0, loss=0.04)
    np.testing.assert_allclose(body.stiffness, tabled.stiffness, rtol=1e-9)
    np.testing.assert_allclose(body.residual, tabled.residual, atol=1e-12)
    with pytest.raises(rs.RotorSoilError, match='files must be modes, residual and rigid, or'):
        rs.read_flexible(loss_factor=0.0, stiffness='K.mtx', mass='M.mtx')


def test_faults_of_all_files_of_a_body_come_at_once(beam_files):
    for name in ('modes', 'residual', 'rigid'):
        path = beam_files / f'{name}.csv'
        path.write_text(f'{path.read_text()}\nx\n')
    with pytest.raises(InputError) as refused:
        by_modes(beam_files, dofs=beam_files / 'none.csv')
    files = [Path(line.partition(': ')[0]).name for line in str(refused.value).splitlines()]
    assert files == ['modes.csv', 'rigid.csv', 'residual.csv', 'none.csv']


def damage(path, change):
    table = np.loadtxt(path, delimiter=',')
    np.savetxt(path, change(table), delimiter=',')


def test_residual_and_mass_have_to_be_symmetric_and_of_the_modes(beam_files):
    def skewed(table):
        table[0, 1] += table.max()
        return table

    damage(beam_files / 'residual.csv', skewed)
    damage(beam_files / 'rigid.csv', skewed)
    first, second = told(lambda: by_modes(beam_files))
    assert first.startswith('mass must be symmetric within 0.0001 of its largest entry, got')
    assert second.startswith('flexibility must be symmetric within 0.0001 of its largest entry')
    damage(beam_files / 'residual.csv', lambda table: table[:-1])
    damage(beam_files / 'rigid.csv', lambda table: table[:-1])
    first, second = told(lambda: by_modes(beam_files))
    assert first == ('must have six rows of mass and 18 of rigid motion, those of the modes, '
                     'got 23')
    assert second == 'must have 18 rows and columns, those of the modes, got 17 and 18'


def test_places_have_to_be_those_of_the_rigid_motion(beam_files):
    assert by_modes(beam_files, dofs=beam_files / 'dofs.csv').names[:2] == ['patch_1_x',
                                                                            'patch_1_y']
    path = beam_files / 'dofs.csv'
    path.write_text(path.read_text().replace(',b1,seat,0,3,0,', ',b1,seat,0,3.5,0,'))
    lines = told(lambda: by_modes(beam_files, dofs=path))
    assert lines == [
        f'line {line}: place of b1_{axis} must be that of the file rigid, from the same origin, '
        'got 0.5 m away' for line, axis in ((14, 'x'), (16, 'z'))]


def test_a_binary_table_is_no_text(tmp_path):
    (tmp_path / 'a.csv').write_bytes(b'1,2\x00')
    assert content_of(tmp_path / 'a.csv')
    assert told(lambda: read_flexible(
        modes=tmp_path / 'a.csv', residual=tmp_path / 'a.csv', rigid=tmp_path / 'a.csv',
        loss_factor=0.0)) == ['is not a text file (it holds zero bytes)'] * 3
