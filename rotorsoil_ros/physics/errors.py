"""What can go wrong, in four words."""


class RotorSoilError(ValueError):
    """Anything that this package refuses to do."""


class InputError(RotorSoilError):
    """A file or an argument that a user has to mend; the message names place, rule and value."""


class OutOfTableError(RotorSoilError):
    """A speed or frequency that a table does not cover: it is never extrapolated."""


class NotSolvedError(RotorSoilError):
    """A system that is singular or a refinement that did not reach its tolerance."""
