"""What can go wrong, in four words."""


class RotorSoilError(ValueError):
    """Anything that this package refuses to do."""


class InputError(RotorSoilError):
    """A file or an argument that a user has to mend; the message names place, rule and value."""


class OutOfTableError(RotorSoilError):
    """A speed or frequency that a table does not cover: it is never extrapolated."""


class NotSolvedError(RotorSoilError):
    """A system that is singular or a refinement that did not reach its tolerance."""


def require(holds: bool, name: str, rule: str, value: float) -> None:
    """Raise a RotorSoilError that names the quantity, its rule with unit, and its value."""
    if not holds:
        raise RotorSoilError(f'{name} must be {rule}, got {value:g}')
