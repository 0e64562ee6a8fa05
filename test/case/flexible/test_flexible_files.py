"""Files of bodies that bend: what is no body is refused, and shared nodes are one."""

from pathlib import Path
import shutil

from foundations import frame_elements, REFERENCE
import numpy as np
import pytest
import scipy.sparse

from rotorsoil_ros.case.flexible import matrices, tables
from rotorsoil_ros.case.flexible.files import read_flexible
from rotorsoil_ros.case.flexible.interface import Interface
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.flexible.body import Dof
from rotorsoil_ros.machine.flexible.reduction import FiniteElements

FILES = {'modes': 'raft_modes.csv', 'residual': 'raft_residual.csv', 'rigid': 'raft_rigid.csv'}
HEADER = 'index,name,kind,x,y,z,direction,area\n'


def read(folder):
    """Read the raft of a folder."""
    files = {kind: folder / name for kind, name in FILES.items()}
    return read_flexible(loss_factor=0.04, **files)


def numbers(path):
    """Return the numbers of a file of the reference, comments and names left out."""
    return np.genfromtxt(path, delimiter=',', comments='#')


@pytest.mark.parametrize('file, change, said', [
    ('residual', lambda found: 0.0 * found,
     'residual must not be zero where 20 modes tell of 44 motions'),
    ('residual', lambda found: np.triu(found), 'flexibility must be symmetric within'),
    ('residual', lambda found: -found, 'residual must not be negative in any direction'),
    ('rigid', lambda found: np.vstack([found[:6], found[7:], found[6]]),
     'fan_1_b1_x must move along x of the file rigid as its place does'),
    ('rigid', lambda found: np.vstack([np.diag([1.0, 1, 2, 1, 1, 1]) * found[:6], found[6:]]),
     'mass must be the same along x, y and z, got 115200, 115200, 230400 kg'),
])
def test_modes_whose_files_do_not_belong_together_are_refused(tmp_path, file, change, said):
    for name in FILES.values():
        shutil.copy(REFERENCE / name, tmp_path)
    np.savetxt(tmp_path / FILES[file], change(numbers(REFERENCE / FILES[file])), delimiter=',')
    with pytest.raises(RotorSoilError, match=said):
        read(tmp_path)


@pytest.mark.parametrize('text, said', [
    ('%%MatrixMarket matrix coordinate pattern symmetric\n1 1 1\n1 1\n', 'got pattern'),
    ('%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 3.0\n',
     'got skew-symmetric'),
    ('%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 3,5\n',
     'line 3: numbers must be separated by blanks, and decimals by points, got a comma')])
def test_matrices_of_another_kind_are_refused(tmp_path, text, said):
    path = tmp_path / 'K.mtx'
    path.write_text(text)
    with pytest.raises(RotorSoilError, match=said):
        matrices.read(path)


def asked(text, size=12):
    """Return what a table of motions asks of matrices of that many."""
    rows = tables.motions(Path('dofs.csv'), HEADER + text)
    return Interface.of(Path('dofs.csv'), rows, size, None)


@pytest.mark.parametrize('text, said', [
    ('1,a,contact,0,0,0,xyz,1\n4,a,contact,1,0,0,xyz,1\n1,a,contact,0,0,0,xyz,1\n',
     'line 4: index 1 stands twice in a'),
    ('1,a,contact,0,0,0,xyz,1\n4,a,seat,1,0,0,xyz,1\n',
     'line 3: kind of a must be the same on every line, got seat and contact'),
    ('1,a,seat,0,0,0,x,\n1,b,seat,1,0,0,x,\n',
     'line 3: index 1 must be one motion of one place'),
    ('1,a,contact,0,0,0,z,2\n2,b,contact,1,0,0,z,\n',
     r'line 3: area \[m\^2\] is missing, while other contacts have theirs'),
    ('1,a,contact,0,0,0,x,2\n2,a,contact,0,0,0,z,3\n',
     'line 3: area of a must be the same on every line, got 3 and 2'),
    ('12,a,contact,0,0,0,xyz,1\n', 'line 2: index must be up to 10, the matrices have 12'),
])
def test_motions_that_contradict_each_other_are_told_by_their_line(text, said):
    with pytest.raises(RotorSoilError, match=said):
        asked(text)


def test_area_of_a_contact_is_told_once():
    found = asked('1,a,contact,0,0,0,x,\n2,a,contact,0,0,0,y,\n3,a,contact,0,0,0,z,2.5\n')
    assert [dof.area for dof in found.dofs] == [2.5, 2.5, 2.5]
    with pytest.raises(RotorSoilError, match='cells must be separated by commas'):
        tables.motions(Path('dofs.csv'), HEADER.replace(',', ';'))


def test_motion_that_two_places_share_is_one():
    """A node that two places share moves rigidly as itself, and so does what hangs on it."""
    text = (REFERENCE / 'frame_dofs.csv').read_text()
    alone = frame_elements()
    first = next(line for line in text.splitlines() if ',seat,' in line).split(',')
    also = ','.join([first[0], first[1].replace('bearing', 'again'), 'probe', *first[3:]])
    rows = tables.motions(Path('dofs.csv'), f'{text.rstrip()}\n{also}\n')
    found = Interface.of(Path('dofs.csv'), rows, alone.stiffness.shape[0], None)
    assert len(found.dofs) == len(alone.interface) + 1
    shared = FiniteElements.of(alone.stiffness, alone.mass, found.dofs, found.pick, found.known)
    np.testing.assert_allclose(shared.rigid, alone.rigid, atol=1e-6)
    assert shared.held < 1e-9


def points(stiffness, mass):
    """Return elements of four points, each free along x, y and z, from diagonals over all."""
    dofs = {3 * point + axis: Dof(f'p{point}', 'xyz'[axis], 'seat', place)
            for point, place in enumerate(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0),
                                           (0.0, 0.0, 1.0))) for axis in range(3)}
    found = scipy.sparse.diags(stiffness).tolil()
    # A bar between the first two of them.
    found[0, 3] = found[3, 0] = -found[0, 0]
    return FiniteElements.of(found.tocsc(), scipy.sparse.diags(mass).tocsc(),
                             tuple(dofs.values()), scipy.sparse.identity(12, format='csc'), dofs)


BAR, ONES = np.eye(12)[0] + np.eye(12)[3], np.ones(12)


@pytest.mark.parametrize('stiffness, mass, said', [
    (0.0 * BAR, ONES, 'stiffness must be > 0 N/m somewhere'),
    (-BAR, ONES, 'stiffness must be >= 0 on its diagonal, got -1'),
    (BAR, 0.0 * ONES, 'mass must be > 0 kg in every rigid motion, got 0'),
    (BAR, ONES - 3.0 * np.eye(12)[11], 'mass must be >= 0 on its diagonal, got -2'),
    (BAR, ONES, 'stiffness must hold the body together, got 7 motions or more'),
])
def test_matrices_of_no_body_are_refused(stiffness, mass, said):
    with pytest.raises(RotorSoilError, match=said):
        points(stiffness, mass).body(100.0, loss=0.0)


def test_all_modes_are_kept_where_all_are_asked_for():
    """Beyond half of them the search for some gives way to all: nothing is left to a residual."""
    frame = frame_elements()
    body = frame.body(1e7, loss=0.0)
    assert len(body.stiffness) == frame.stiffness.shape[0] - 6
    modal = (body.shapes / body.stiffness) @ body.shapes.T
    assert np.abs(body.residual).max() < 1e-6 * np.abs(modal).max()


def test_free_body_cannot_be_grounded():
    with pytest.raises(RotorSoilError, match='grounded must be false of a body that nothing'):
        frame_elements().grounded(300.0, loss=0.0)
