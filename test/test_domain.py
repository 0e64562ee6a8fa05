"""Processes that talk DDS do not hear each other."""

import subprocess
import sys

from rotorsoil_ros.domain import DOMAINS, own_domain

TAKE = 'from rotorsoil_ros.domain import own_domain; print(own_domain(), flush=True); input()'


def test_no_two_processes_have_one_domain_and_a_process_keeps_its_own():
    others = [subprocess.Popen([sys.executable, '-c', TAKE], text=True, stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE) for _ in range(4)]
    taken = [own_domain(), *(int(other.stdout.readline()) for other in others)]
    for other in others:
        other.communicate('\n')
    assert len(set(taken)) == len(taken)
    assert all(1 <= domain <= DOMAINS for domain in taken)
    assert own_domain() == taken[0]


def test_the_system_takes_back_what_a_process_had():
    """Two that would choose the same number, one after the other."""
    choose = 'import os; os.getpid = lambda: 41; ' + TAKE.replace('input()', 'os._exit(1)')
    first, second = (subprocess.run([sys.executable, '-c', choose], text=True,
                                    stdout=subprocess.PIPE, check=False).stdout
                     for _ in range(2))
    assert int(first) == int(second)
