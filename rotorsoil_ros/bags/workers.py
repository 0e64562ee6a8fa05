"""Who answers many bags at once: processes of this machine, or those of a cluster."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.forkserver import ensure_running
import os
from typing import Any

from rotorsoil_ros.background import Mapper
from rotorsoil_ros.bags.archive import Job, Record
from rotorsoil_ros.errors import InputError

ENGINE = 'rotorsoil_ros.bags.archive'  # and all that it needs
THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS')

Answers = Callable[[Job], Record]


def processes(number: int) -> Mapper[Job, Record]:
    """
    Return what answers in processes that live until all is done.

    A bag that ends its process (for want of memory, as a rule) costs the others nothing: what
    was being answered when it happened is answered again, each in a process of its own, and
    what ends that too has a record that says so.
    """
    def answers(function: Answers, jobs: Iterable[Job], /) -> Iterator[Record]:
        left = list(jobs)
        while left:
            with pool_of(min(number, len(left))) as pool:
                futures = [pool.submit(function, job) for job in left]
                try:
                    for future in futures:
                        yield future.result()
                        del left[0]
                    return
                except BrokenProcessPool:
                    begun = [job for job in left if job.begun.exists()]
                    if not begun:  # processes end before they begin anything
                        raise
            for job in begun:
                _alone(function, job)
            while left and (record := left[0].known()) is not None:
                yield record
                del left[0]

    return answers


def pool_of(number: int) -> ProcessPoolExecutor:
    """
    Return processes that know nothing of this one.

    Where the system can, one process imports the engine, once, and becomes each of them, also
    those of the next pool; else each imports it.
    """
    if 'forkserver' not in get_all_start_methods():
        return ProcessPoolExecutor(number, mp_context=get_context('spawn'))
    context = get_context('forkserver')
    context.set_forkserver_preload([ENGINE])
    with _one_thread():
        ensure_running()
    return ProcessPoolExecutor(number, mp_context=context)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Have a process start with one thread: what has several, as numpy may, can hang in a fork."""
    given = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, '1'))
    try:
        yield
    finally:
        for name, value in given.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _alone(function: Answers, job: Job) -> None:
    """Answer a bag that was begun when a process ended; its record tells what became of it."""
    try:
        with pool_of(1) as pool:
            pool.submit(function, job).result()
    except BrokenProcessPool:
        job.keep(Record(str(job.bag), failure='its process was ended twice (memory?)'))
        job.begun.unlink(missing_ok=True)


def cluster(address: str) -> Mapper[Job, Record]:
    """
    Return what answers on the workers of a Dask cluster.

    Parameters
    ----------
    address : str
        Of its scheduler, such as `tcp://10.0.0.1:8786`. Its workers have this package and see
        bags, output and cache under the same paths.

    Raises
    ------
    InputError
        If distributed is not installed, or nobody answers there.

    """
    try:
        from distributed import Client, KilledWorker
    except ImportError as error:
        raise InputError('a cluster needs distributed: pip install rotorsoil_ros[cluster]'
                         ) from error
    try:
        client: Any = Client(address)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(f'{address}: no scheduler of a cluster answers: {error}') from error

    def answers(function: Answers, jobs: Iterable[Job], /) -> Iterator[Record]:
        given = list(jobs)
        with client:
            for job, future in zip(given, client.map(function, given, pure=False), strict=True):
                try:
                    yield future.result()
                except KilledWorker as error:
                    yield job.keep(Record(str(job.bag), failure=str(error)))

    return answers
