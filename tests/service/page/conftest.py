"""A service that runs, and a real browser on its page."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.error import URLError

import pytest
from playwright.sync_api import Browser, Page, Request, Route, expect, sync_playwright

from rbfrag.db.location import REFERENCE
from tests.conftest import missing

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

# Chromium as root and in a container, and without its own calls to other hosts.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)

PATIENCE_MS = 20_000

NUMBERS = "?p2=3&kr=0.1&pgv=0.6"
"""A block of two numbers, and a shaking; an empty query opens the page's own example."""

DESKTOP = {"width": 1366, "height": 900}


@pytest.fixture(scope="session")
def chromium() -> str:
    """The browser's program."""
    result = next((path for name in NAMES if (path := shutil.which(name))), None)
    if result is None:
        missing("no Chromium to open the page in: install the package chromium")
    return str(result)


# Not for the session: while a player is there its event loop runs, and no other test may have one.
@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as player:
        opened = player.chromium.launch(executable_path=chromium, args=list(FLAGS))
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a service in a process of its own, on a copy of the shipped models."""
    folder = tmp_path_factory.mktemp("service")
    database = shutil.copyfile(REFERENCE, folder / "models.db")
    with socket.socket() as free_standing:
        free_standing.bind(("127.0.0.1", 0))
        port = free_standing.getsockname()[1]
    document = json.dumps({"db": str(database), "port": port})
    root = Path(__file__).resolve().parents[3]
    with (folder / "log.txt").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "rbfrag.service"],
            cwd=root,
            env={**os.environ, "RBFRAG_SERVICE": document},
            stdout=log,
            stderr=log,
        )
        address = f"http://127.0.0.1:{port}/"
        try:
            _wait_until_it_answers(address, process)
            yield address
        finally:
            process.terminate()
            process.wait(20)


def _wait_until_it_answers(address: str, process: subprocess.Popen[bytes]) -> None:
    for _ in range(300):
        assert process.poll() is None, "the service ended at its start"
        try:
            with urllib.request.urlopen(f"{address}v1/healthz", timeout=5):
                return
        except (URLError, TimeoutError):  # a loaded machine answers late
            time.sleep(0.1)
    pytest.fail("the service does not answer")


@pytest.fixture
def ask(service: str) -> Callable[..., Any]:
    """Ask the service as another client would."""

    def get(path: str, **query: object) -> Any:
        words = "&".join(f"{name}={value}" for name, value in query.items())
        with urllib.request.urlopen(f"{service}{path}?{words}", timeout=20) as answer:
            return json.load(answer)

    return get


@dataclass
class Opened:
    """A page in a window, and what went on behind it."""

    page: Page
    requests: list[str] = field(default_factory=list)
    rejected: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    def settled(self) -> Page:
        """Wait until what is shown answers the fields; return the page."""
        self.page.wait_for_function(
            "() => document.querySelector('#main').ariaBusy === 'false'"
            " && ![...document.querySelectorAll('#chart.stale, #curve.stale')]"
            "   .some((each) => each.checkVisibility())"
            " && document.querySelector('#probability').dataset.state"
        )
        return self.page

    def text(self, selector: str) -> str:
        return " ".join((self.page.text_content(selector) or "").split())


@pytest.fixture
def open_page(browser: Browser, service: str) -> Iterator[Callable[..., Opened]]:
    """Open the page with a query in a window; other hosts are out of reach."""
    contexts = []
    every = []

    def opening(query: str = NUMBERS, *, settle: bool = True, **window: Any) -> Opened:
        context = browser.new_context(**{"viewport": DESKTOP, **window})
        context.set_default_timeout(PATIENCE_MS)
        contexts.append(context)
        opened = Opened(context.new_page())
        every.append(opened)

        def local_only(route: Route, request: Request) -> None:
            opened.requests.append(request.url)
            if request.url.startswith((service, "blob:", "data:")):
                route.continue_()
            else:
                opened.rejected.append(request.url)
                route.abort()

        context.route("**/*", local_only)
        opened.page.on("pageerror", lambda error: opened.complaints.append(str(error)))
        opened.page.on(
            "console",
            lambda message: (
                message.type in ("error", "warning") and opened.complaints.append(message.text)
            ),
        )
        opened.page.goto(service + query)
        if settle:
            opened.settled()
        return opened

    yield opening
    for context in contexts:
        context.close()
    for opened in every:
        assert opened.rejected == [], "the page asked another host"
        assert opened.complaints == [], "the browser complained"
