"""What is measured: each room runs as `python -m benchmarks.<name>`, all as `-m benchmarks`."""

from pathlib import Path
import sys

# The dense solve that the tests hold the fast one against, and their machines.
sys.path.append(str(Path(__file__).resolve().parents[1] / 'test'))
