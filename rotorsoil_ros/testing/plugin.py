"""
The pytest plugin of the package: fixtures for tests of whoever talks to its node.

It comes with `pip install 'rotorsoil_ros[ros]'`; a test only names a fixture. What ROS needs is
imported when the first test asks for it.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from rotorsoil_ros.testing.graph import Graph
    from rotorsoil_ros.testing.twin import Twin

PROFILE_START_NS = 1_700_000_000_000_000_000


@pytest.fixture(scope='session')
def rotorsoil_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the directory of computed tables: $ROTORSOIL_CACHE, or one of this session."""
    given = os.environ.get('ROTORSOIL_CACHE')
    return Path(given) if given else tmp_path_factory.mktemp('rotorsoil_cache')


@pytest.fixture
def rotorsoil_graph(monkeypatch: pytest.MonkeyPatch) -> 'Iterator[Graph]':
    """Yield a ROS graph that nobody else sees."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    from rotorsoil_ros.testing.graph import Graph

    graph = Graph()
    try:
        yield graph
    finally:
        graph.close()


@pytest.fixture
def rotorsoil_case(tmp_path: Path) -> Callable[..., Path]:
    """
    Return what writes a case file for one test.

    `rotorsoil_case('plant_fan', 'foundations.0.mass=9000')` is the shipped case, or one of a
    path, with overrides as `--set` takes them.
    """
    def write(case: str | Path = 'paper_rotor', *overrides: str) -> Path:
        from rotorsoil_ros.case import config, document

        source = document.located(Path(case))
        content = document.read(source)
        document.override(content, overrides)
        target = tmp_path / source.name
        target.write_text(document.text_of(content, [f'{source.name} of one test.']))
        config.load(target)
        return target
    return write


@pytest.fixture
def rotorsoil_profile(tmp_path: Path) -> Callable[..., Path]:
    """
    Return what writes a recorded speed profile for one test.

    `rotorsoil_profile('fan', rpm=range(300, 1500, 10), every_s=0.1)`.
    """
    def write(machine: str, *, rpm: Sequence[float], every_s: float = 0.01) -> Path:
        import numpy as np

        from rotorsoil_ros.bags.profile import write_speed_profile
        from rotorsoil_ros.units import rpm_to_rad_s

        speeds = rpm_to_rad_s(np.asarray(rpm, dtype=float))
        target = tmp_path / f'{machine}_profile.mcap'
        write_speed_profile(target, machine, PROFILE_START_NS + np.rint(
            1e9 * every_s * np.arange(len(speeds))).astype(np.int64), speeds)
        return target
    return write


@pytest.fixture
def rotorsoil_twin(
    rotorsoil_graph: 'Graph', rotorsoil_cache: Path,
) -> 'Iterator[Callable[..., Twin]]':
    """
    Yield what starts a node that watches a machine.

    `rotorsoil_twin('plant_fan')`, or with a case file of your own, another name, and parameters:
    `rotorsoil_twin('fan.yaml', machine='fan', parameters={'speed.unit': 'rpm'})`. The node is
    active when it is returned and gone when the test is over.
    """
    from rotorsoil_ros.case.document import located
    from rotorsoil_ros.testing.twin import Twin

    with ExitStack() as stack:
        def start(
            case: str | Path = 'paper_rotor', *, machine: str = '',
            parameters: dict[str, Any] | None = None,
        ) -> 'Twin':
            path = located(Path(case))
            twin = Twin(rotorsoil_graph, machine or path.stem, path,
                        {'cache': str(rotorsoil_cache), **(parameters or {})})
            stack.callback(twin.release)
            return twin
        yield start
