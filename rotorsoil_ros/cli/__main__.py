"""Run the verbs without an installed script: `python -m rotorsoil_ros.cli`."""

import sys

from rotorsoil_ros.cli import main

sys.exit(main())
