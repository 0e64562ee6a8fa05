"""What can go wrong, in four words."""

from collections.abc import Iterator
from contextlib import contextmanager

BAD_INPUT = 2  # exit status


class RotorSoilError(ValueError):
    """Anything that this package refuses to do."""


class InputError(RotorSoilError):
    """A file or an argument that a user has to mend; the message names place, rule and value."""


class OutOfTableError(RotorSoilError):
    """A speed or frequency that a table does not cover: it is never extrapolated."""


class NotSolvedError(RotorSoilError):
    """A system that is singular or a refinement that did not reach its tolerance."""


@contextmanager
def solved(what: str) -> Iterator[None]:
    """Turn what numpy and scipy raise where numbers do not fit into an error of this package."""
    import numpy as np  # not above: a command that only tells its options needs none

    try:
        yield
    except RotorSoilError:
        raise
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise NotSolvedError(f'{what} cannot be computed: {error}') from error
    except MemoryError as error:
        raise NotSolvedError(f'{what} cannot be computed: it needs too much memory, '
                             f'{error or "more than there is"}') from error
    except ValueError as error:
        # The words of scipy for numbers that have overflown.
        if 'infs or NaNs' not in str(error):
            raise
        raise NotSolvedError(f'{what} cannot be computed: a number is too large or too small') \
            from error


def require(holds: bool, name: str, rule: str, value: float) -> None:
    """Raise a RotorSoilError that names the quantity, its rule with unit, and its value."""
    if not holds:
        raise RotorSoilError(f'{name} must be {rule}, got {value:g}')
