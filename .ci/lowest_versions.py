"""
Print the lower bounds of setup.py as constraints for pip.

The viewer is left out: rerun wants a younger numpy than the engine does.
"""

import re
import runpy

import setuptools


def bounds() -> list[str]:
    """Return `name==version` of each library that the package runs with."""
    caught: dict[str, object] = {}
    setuptools.setup = lambda **given: caught.update(given)
    runpy.run_path('setup.py')
    extras = caught['extras_require']
    wanted = [*caught['install_requires'], *(
        bound for name in ('ros', 'frames', 'tables', 'bags', 'mqtt', 'opcua', 'zenoh')
        for bound in extras[name])]
    return sorted({f'{name}=={version}' for name, version in re.findall(
        r'^([\w-]+)(?:\[\w+\])?>=([\w.]+)', '\n'.join(wanted), re.MULTILINE)})


if __name__ == '__main__':
    print('\n'.join(bounds()))
