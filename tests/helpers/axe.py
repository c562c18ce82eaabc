"""What axe-core finds in a page: faults for those who use it by a keyboard or a screen reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

try:
    from axe_playwright_python.sync_playwright import Axe
except ImportError:
    Axe = None

if TYPE_CHECKING:
    from playwright.sync_api import Page


def violations(page: Page) -> list[str]:
    """Every rule that the page breaks, with the first element that does."""
    if Axe is None:
        pytest.skip("pip install axe-playwright-python to look for faults of accessibility")
    found = Axe().run(page).response["violations"]
    return [f"{one['id']}: {one['help']}: {one['nodes'][0]['html'][:200]}" for one in found]
