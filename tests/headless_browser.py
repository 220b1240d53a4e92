"""Opens the pages of a site in a headless browser, searches it, and prints what it saw as JSON.

Runs in a process of its own, ``python headless_browser.py SITE WORD``: Qt takes its settings from the environment, and
its event loop ends with the process.
"""

import functools
import http.server
import json
import os
import sys
import threading
from pathlib import Path
from typing import Any

os.environ |= {
    "QT_QPA_PLATFORM": "offscreen",
    "QTWEBENGINE_DISABLE_SANDBOX": "1",
    "QTWEBENGINE_CHROMIUM_FLAGS": "--no-sandbox --disable-gpu",
}

from PyQt6.QtCore import QEventLoop, QTimer, QUrl
from PyQt6.QtWebEngineCore import QWebEnginePage
from PyQt6.QtWidgets import QApplication

PATIENCE = 30_000  # time after which a page is given up [ms]

SEARCH = """
document.querySelector('[data-md-toggle=search]').checked = true;
const query = document.querySelector('[data-md-component=search-query]');
query.focus();
query.value = WORD;
query.dispatchEvent(new Event('input', {bubbles: true}));
query.dispatchEvent(new KeyboardEvent('keyup', {bubbles: true}));
"""
HITS = "[...document.querySelectorAll('.md-search-result__item a')].map(a => a.getAttribute('href'))"


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *args: Any) -> None:
        pass


class Page(QWebEnginePage):
    """A page that remembers the errors of its scripts."""

    def __init__(self) -> None:
        super().__init__()
        self.errors: list[str] = []

    def javaScriptConsoleMessage(self, level: Any, message: str, line: int, source: str) -> None:
        if level == QWebEnginePage.JavaScriptConsoleMessageLevel.ErrorMessageLevel:
            self.errors.append(f"{source}:{line}: {message}")

    def opened(self, url: str) -> bool:
        loop, outcome = QEventLoop(), []
        self.loadFinished.connect(lambda ok: (outcome.append(ok), loop.quit()))
        QTimer.singleShot(PATIENCE, loop.quit)
        self.load(QUrl(url))
        loop.exec()
        self.loadFinished.disconnect()
        return bool(outcome and outcome[0])

    def answer(self, script: str) -> Any:
        loop, outcome = QEventLoop(), []
        self.runJavaScript(script, lambda value: (outcome.append(value), loop.quit()))
        QTimer.singleShot(PATIENCE, loop.quit)
        loop.exec()
        return outcome[0] if outcome else None


def pause(milliseconds: int) -> None:
    loop = QEventLoop()
    QTimer.singleShot(milliseconds, loop.quit)
    loop.exec()


def main(site: Path, word: str) -> None:
    handler = functools.partial(QuietHandler, directory=str(site))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/"
    _app = QApplication(["browser"])  # must live as long as the pages
    page = Page()
    pages = {
        file.name: {
            "opened": page.opened(address + file.name),
            "title": page.answer("document.querySelector('article h1').innerText"),
            "height": page.answer("document.querySelector('article').offsetHeight"),
            "formulas": page.answer("document.querySelectorAll('math').length"),
        }
        for file in sorted(site.glob("*.html"))
        if file.name != "404.html"
    }
    page.opened(address + "index.html")
    page.answer(SEARCH.replace("WORD", json.dumps(word)) + "0")
    hits: list[str] = []
    for _ in range(PATIENCE // 200):
        pause(200)
        if hits := page.answer(HITS) or []:
            break
    print(json.dumps({"pages": pages, "hits": [hit.removeprefix(address) for hit in hits], "errors": page.errors}))
    sys.stdout.flush()
    os._exit(0)  # Qt would wait for its processes


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
