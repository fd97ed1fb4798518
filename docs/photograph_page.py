"""Take the picture of the page in docs/figures: python docs/photograph_page.py [CHROMIUM]."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

from playwright.sync_api import sync_playwright

FIGURE = Path(__file__).parent / "figures" / "page.png"
QUERY = "?alpha1=-15&alpha3=24&r3=2.5&beta=18&phi=38&pgv=0.8&pga=0.5"
PORT = 8641
SIZE = {"width": 1360, "height": 960}


def main() -> None:
    program = sys.argv[1] if len(sys.argv) > 1 else shutil.which("chromium")
    if program is None:
        sys.exit("no Chromium here: name its program")
    address = f"http://127.0.0.1:{PORT}/"
    told = json.dumps({"port": PORT})
    service = subprocess.Popen(
        [sys.executable, "-m", "rbfrag.service"], env={**os.environ, "RBFRAG_SERVICE": told}
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
            page = browser.new_page(viewport=SIZE)
            page.goto(address + QUERY)
            page.wait_for_selector("#main[aria-busy=false]")
            page.wait_for_load_state("networkidle")
            page.screenshot(path=FIGURE)
            browser.close()
    finally:
        service.terminate()
        service.wait(20)
    print(f"wrote {FIGURE}")


if __name__ == "__main__":
    main()
