"""What a recording of rerun holds, and predictions to record."""

from pathlib import Path
import subprocess
import sys
import warnings

import numpy as np

from rotorsoil_ros.events import Predicted

START = 1_790_000_000_000_000_000
PERIOD = 10**7


def column(path, entity, component, *, static=False):
    """Read stamps [ns] and values of one component of one entity."""
    from rerun.chunk import RrdReader
    stamps, values = [], []
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # of the missing footer
        for chunk in RrdReader(str(path)).stream():
            batch = chunk.to_record_batch()
            if (chunk.entity_path == entity and chunk.is_static == static
                    and component in batch.schema.names):
                values += batch.column(component).to_pylist()
                if not static:
                    stamps += batch.column('time').cast('int64').to_pylist()
    return stamps, values


def assert_whole(recording):
    """Assert that other programs can read a recording and find their way in it."""
    verified = subprocess.run(
        [Path(sys.executable).with_name('rerun'), 'rrd', 'verify', recording],
        capture_output=True, text=True, check=False)
    assert verified.returncode == 0, verified.stderr


def predicted(machine, speeds, start=START, period=PERIOD):
    speed = np.asarray(speeds, dtype=float)
    predictor = machine.table.predictor(machine.case.unbalance)
    known = predictor.covers(speed)
    prediction = predictor.predict(np.where(known, speed, 300.0))
    prediction.parts[~known] = np.nan
    return Predicted('fan', start + period * np.arange(len(speed)), prediction)


class Paper:
    """A recording that keeps what is drawn as plain numbers."""

    def __init__(self):
        self.drawn = {}
        self.stamps = {}

    def still(self, entity, what):
        for batch in what.as_component_batches():
            self.drawn[entity, str(batch.component_descriptor().component)] = (
                batch.as_arrow_array().to_pylist())

    def send(self, entity, stamp_ns, columns):
        self.stamps[entity] = stamp_ns.tolist()
        for each in columns:
            self.drawn[entity, str(each.component_descriptor().component)] = (
                each.as_arrow_array().to_pylist())

    def strips(self, entity, stamp_ns, strips):
        self.stamps[entity] = stamp_ns.tolist()
        self.drawn[entity, 'strips'] = strips

    def series(self, entity, stamp_ns, values, **_):
        self.stamps[entity] = stamp_ns.tolist()
        self.drawn[entity, 'values'] = values.tolist()

    def begins(self, _, stamp_ns, __):
        return np.arange(len(stamp_ns))
