"""From what stands on a name plate to one page: what each of the three commands takes, cold."""

from pathlib import Path
import subprocess
import sys
import tempfile
import time

FAN = ['new', 'fan', '--answer', 'power_kw=75', '--answer', 'rpm=990', '--answer',
       'soil=dense_sand', '-o', 'fan.yaml']
COMMANDS = {'new': FAN, 'check': ['check', 'fan.yaml', '--cache', 'cache'],
            'report': ['report', 'fan.yaml', '--rpm', '990', '--cache', 'cache']}


def main() -> None:
    """Print the seconds of a case, of its check and of its report, with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in COMMANDS.items():
            start = time.perf_counter()
            done = subprocess.run([sys.executable, '-m', 'rotorsoil_ros.cli', *arguments],
                                  cwd=folder, capture_output=True, text=True, check=False)
            print(f'rotorsoil {name}: {time.perf_counter() - start:.1f} s, exit status '
                  f'{done.returncode}')
        size = (Path(folder) / 'report' / 'report.html').stat().st_size
        print(f'report.html: {size / 1024:.0f} KiB')


if __name__ == '__main__':
    main()
