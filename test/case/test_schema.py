"""The page docs/case_file.md names every key that a case file may have."""

from pathlib import Path
import re

import pytest

from rotorsoil_ros.case.entries.bearing import BearingEntry
from rotorsoil_ros.case.entries.entry import Entry
from rotorsoil_ros.case.schema import Document, LayerEntry

PAGE = (Path(__file__).parents[2] / 'docs' / 'case_file.md').read_text()


def kinds(entry):
    """Return every kind of mapping that is made of one."""
    own = entry.__subclasses__()
    return [*own, *(deeper for kind in own for deeper in kinds(kind))]


# Others are made of the same stuff, as what `new` asks.
ENTRIES = [kind for kind in kinds(Entry)
           if kind.__module__ in (Document.__module__, BearingEntry.__module__)]


def test_no_mapping_is_forgotten():
    assert {Document, LayerEntry} <= set(ENTRIES)


@pytest.mark.parametrize('kind', ENTRIES, ids=lambda kind: kind.__name__)
def test_every_key_is_on_the_page(kind):
    words = set(re.findall(r'\w+', ' '.join(re.findall(r'`([^`]*)`', PAGE))))
    assert set(kind.model_fields) <= words
