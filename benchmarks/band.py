"""How often the true machine leaves the band of a case on cones, with and without model form."""

from dataclasses import replace
from pathlib import Path
import tempfile

import numpy as np

from rotorsoil_ros.case import config, models
from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.design.tables import infinite_element_model
from rotorsoil_ros.ground.soil import Soil

CASE = Path(__file__).parents[1] / 'config' / 'plant_fan.yaml'
SOILS = 60
RATIOS = 5
BEYOND = 1.1


def main() -> None:
    """Print shares of the soils and of all speeds and channels."""
    case = config.load(CASE)
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder)
        model = models.coupled_model(case, directory)
        table = models.response_table(case, model, directory)
        speed = np.linspace(*case.speed_range, 1500)
        nominal = table.predictor(case.unbalance).answer(speed).displacement
        moving = np.abs(nominal).max(axis=0) > 1e-9 * np.abs(nominal).max()
        truths = [np.abs(displacement[:, moving]) for displacement in true(case, model, speed,
                                                                          directory)]
        for with_form in (False, True):
            spread = replace(case.uncertainty, model_form=with_form)
            band = models.response_band(case, model, table, directory, spread)
            assert band is not None
            found = band.envelope(case.unbalance).at(speed).around(nominal)
            over = np.array([truth / found.high[:, moving] for truth in truths])
            under = np.array([truth / found.low[:, moving] for truth in truths])
            print(f'model form {"in" if with_form else "out"}: {len(band.tables)} machines; '
                  f'soils beyond the upper edge by more than 10 %: '
                  f'{np.mean(over.max(axis=(1, 2)) > BEYOND):.0%}, most {over.max():.2f}; '
                  f'values above the upper edge {np.mean(over > 1.0):.1%}, below the lower '
                  f'{np.mean(under < 1.0):.1%}; '
                  f'width high / low, median {np.median((found.high / found.low)[:, moving]):.2f}')


def true(case, model, speed, directory):
    """Yield the response on random soils within the spread, on infinite elements solved for nu."""
    random, soil, spread = np.random.default_rng(7), case.soil, case.uncertainty
    low, high = case.speed_range
    for number in range(SOILS):
        nu = soil.poisson_ratio + spread.poisson_ratio * (2.0 * (number % RATIOS) / (RATIOS - 1)
                                                          - 1.0)
        one = Soil(soil.shear_modulus * spread.shear_modulus_factor ** random.uniform(-1.0, 1.0),
                   round(nu, 4), soil.density, soil.loss_factor)
        ground = tuple(infinite_element_model(
            one, block.contact, 'disc', cache=Cache(directory), speed_range=(low, high))
            for block in model.foundations)
        truth = replace(model, soil_models=ground)
        yield truth.unbalance_response(speed, case.unbalance).displacement


if __name__ == '__main__':
    main()
