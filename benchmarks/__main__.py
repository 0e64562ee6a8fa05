"""Run every benchmark, one after the other: python -m benchmarks."""

from pathlib import Path
import subprocess
import sys

HERE = Path(__file__).parent
ASIDE = {'ross_rotor', 'ross_random'}  # parts of others, for another interpreter


def main() -> int:
    """Run the rooms of this directory as programs of their own; return the worst status."""
    worst = 0
    for path in sorted(HERE.glob('[!_]*.py')):
        if path.stem not in ASIDE:
            print(f'== benchmarks.{path.stem}', flush=True)
            command = [sys.executable, '-m', f'benchmarks.{path.stem}']
            worst = max(worst, subprocess.run(command, cwd=HERE.parent, check=False).returncode)
    return worst


if __name__ == '__main__':
    raise SystemExit(main())
