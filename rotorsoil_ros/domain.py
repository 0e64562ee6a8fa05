"""A DDS domain for a process: programs on one domain hear each other."""

from functools import cache
import os
import socket
import sys

# Above them the ports of DDS reach those that the system hands out (DDSI-RTPS 2.3, 9.6.1.1).
DOMAINS = 100


@cache
def own_domain() -> int:
    """
    Return a domain that no other process of this package on this host has, until it ends.

    A name that only one socket can have stands for a domain: the system takes it back however
    the process ends. Where there are no such names (they are Linux's), or where all are taken,
    it is the number of the process that chooses.
    """
    first = os.getpid() % DOMAINS
    for tried in range(DOMAINS if sys.platform == 'linux' else 0):
        domain = 1 + (first + tried) % DOMAINS
        if _taken(domain):
            return domain
    return 1 + first


def _taken(domain: int) -> bool:
    """Take a domain, if nobody has."""
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f'\0rotorsoil_ros/domain/{domain}')
    except OSError:
        claim.close()
        return False
    claim.detach()  # held until the process ends
    return True
