"""Which machine is watched: its case, its table, and what may be said of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.case import cache, config, models
from rotorsoil_ros.physics.arrays import ComplexArray
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.infinite import InfiniteElementModel
from rotorsoil_ros.physics.response import ResponseTable

UNITS = {
    'position': 'displacement, m or rad, zero-to-peak',
    'velocity': 'm/s or rad/s, zero-to-peak',
    'effort': 'transmitted force, N or N m, zero-to-peak',
    'phase': 'rad',
    'convention': 'x(t) = Re(X exp(+i omega t))',
}


@dataclass(frozen=True, slots=True)
class Machine:
    """A case with its models, its response table, and the cache where more of it may lie."""

    case: config.Case
    model: CoupledModel
    table: ResponseTable
    directory: Path

    @classmethod
    def load(
        cls, case_file: Path, *, cache_directory: Path | None, overrides: Sequence[str] = (),
    ) -> 'Machine':
        """Read a case and load its table, computing it where the cache has none."""
        case = config.load(case_file, overrides)
        directory = cache.directory(cache_directory)
        model = models.coupled_model(case, directory)
        return cls(case, model, models.response_table(case, model, directory), directory)

    def _compliance_keys(self) -> dict[str, str]:
        return {f'compliance of {foundation.name}': models.key_of(soil)
                for foundation, soil in zip(self.model.foundations, self.model.soil_models,
                                            strict=True)
                if isinstance(soil, InfiniteElementModel)}

    def description(self, name: str, unbalance: ComplexArray) -> Mapping[str, object]:
        """Return what the predictions under this name and this unbalance rest on."""
        return {
            'machine': name, 'case': self.case.name, 'version': rotorsoil_ros.__version__,
            'support': self.case.support.model,
            'tables': {'response': self.table.key, **self._compliance_keys()},
            'accuracy': self.table.accuracy,
            'speed_range_rad_s': list(self.table.speed_range),
            'gaps_rad_s': self.table.gaps.tolist(), 'channels': list(self.table.channels),
            'unbalance': {
                disc: {'moment_kg_m': float(np.abs(value)), 'phase_rad': float(np.angle(value))}
                for disc, value in zip(self.table.planes, unbalance, strict=True)},
            'units': UNITS,
        }
