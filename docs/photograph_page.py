"""Take the pictures of the page in docs/figures: python docs/photograph_page.py [CHROMIUM]."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

FIGURES = Path(__file__).parent / "figures"
PORT = 8641

PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}

PICTURES: dict[str, dict[str, Any]] = {
    "page.png": {"viewport": {"width": 1280, "height": 1130}},
    "page-phone.png": {**PHONE, "color_scheme": "dark", "device_scale_factor": 2},
}
"""The windows in which the page is opened, on its own example."""


def main() -> None:
    program = sys.argv[1] if len(sys.argv) > 1 else shutil.which("chromium")
    if program is None:
        sys.exit("no Chromium here: name its program")
    address = f"http://127.0.0.1:{PORT}/"
    settings = json.dumps({"port": PORT})
    service = subprocess.Popen(
        [sys.executable, "-m", "rbfrag.service"], env={**os.environ, "RBFRAG_SERVICE": settings}
    )
    try:
        for _ in range(100):
            try:
                urllib.request.urlopen(f"{address}v1/healthz", timeout=5).close()
                break
            except OSError:
                time.sleep(0.1)
        with sync_playwright() as player:
            browser = player.chromium.launch(executable_path=program, args=["--no-sandbox"])
            for name, window in PICTURES.items():
                page = browser.new_page(**window)
                page.goto(address)
                page.wait_for_selector("#main[aria-busy=false]")
                page.wait_for_load_state("networkidle")
                page.wait_for_selector("#curve:not(.stale) .curve")
                page.screenshot(path=FIGURES / name)
                page.close()
            browser.close()
    finally:
        service.terminate()
        service.wait(20)
    print(f"wrote {', '.join(PICTURES)} in {FIGURES}")


if __name__ == "__main__":
    main()
