"""The page docs/case_file.md names every key that a case file may have."""

from pathlib import Path
import re

import pytest

from rotorsoil_ros.case import schema

PAGE = (Path(__file__).parents[2] / 'docs' / 'case_file.md').read_text()
ENTRIES = [kind for kind in vars(schema).values()
           if isinstance(kind, type) and issubclass(kind, schema.Entry)]


@pytest.mark.parametrize('kind', ENTRIES, ids=lambda kind: kind.__name__)
def test_every_key_is_on_the_page(kind):
    words = set(re.findall(r'\w+', ' '.join(re.findall(r'`([^`]*)`', PAGE))))
    assert set(kind.model_fields) <= words
