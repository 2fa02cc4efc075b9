"""A headless browser for the tests of pages, where there is one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Playwright, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@contextmanager
def headless() -> Iterator[Browser]:
    """The browser of the system, or the one that `playwright install chromium` brings; skips where there is neither."""
    with sync_playwright() as playwright:
        path = _path(playwright)
        if path is None:
            pytest.skip("no browser: install chromium, or run `playwright install chromium`")
        browser = playwright.chromium.launch(executable_path=path)
        try:
            yield browser
        finally:
            browser.close()


def _path(playwright: Playwright) -> str | None:
    own = playwright.chromium.executable_path
    found = [own] if Path(own).exists() else [path for name in NAMES if (path := shutil.which(name))]
    return found[0] if found else None
