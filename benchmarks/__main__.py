"""Run every benchmark, one after the other: python -m benchmarks."""

from pathlib import Path
import subprocess
import sys

HERE = Path(__file__).parent


def main() -> int:
    """Run the rooms of this directory as programs of their own; return the worst status."""
    worst = 0
    for path in sorted(HERE.glob('[!_]*.py')):
        print(f'== {path.name}', flush=True)
        worst = max(worst, subprocess.run([sys.executable, str(path)], check=False).returncode)
    return worst


if __name__ == '__main__':
    raise SystemExit(main())
