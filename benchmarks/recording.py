"""How large is what the viewer is shown? `python -m benchmarks.recording` prints its parts."""

from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
import warnings

from rerun.chunk import RrdReader

from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.synthetic import Truth, write_synthetic
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.screen import recorder

CASE = Path('config/plant_fan.yaml')
START_NS = 1_790_000_000_000_000_000


def parts(recording: Path) -> tuple[int, Counter[str]]:
    """Return the number of pieces of a recording, and the bytes of each kind of thing in it."""
    pieces, size = 0, Counter[str]()
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        for chunk in RrdReader(str(recording)).stream():
            pieces += 1
            size['/'.join(chunk.entity_path.split('/')[2:3])] += chunk.to_record_batch().nbytes
    return pieces, size


def main() -> None:
    """Answer synthetic sensors of the shipped fan as the demonstration does, and measure."""
    with TemporaryDirectory() as scratch:
        directory = Path(scratch)
        machine = Machine.load(CASE)
        signals, recording = directory / 'signals.mcap', directory / 'run.rrd'
        write_synthetic(signals, 'fan', machine.model, machine.case.unbalance, truth=Truth(),
                        start_ns=START_NS)
        predict(machine, signals, directory / 'log.mcap', screen=recorder(recording, machine))
        pieces, size = parts(recording)
        for file in (signals, directory / 'log.mcap', recording):
            print(f'{file.name:14s} {file.stat().st_size / 1e6:8.2f} MB')
        print(f'{recording.name} has {pieces} pieces')
        for what, number in size.most_common():
            print(f'  {what:20s} {number / 1e6:8.3f} MB')


if __name__ == '__main__':
    main()
