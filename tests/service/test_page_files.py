"""The files of the page: all there, none from elsewhere, nothing written into the document."""

import re
from hashlib import sha256
from html.parser import HTMLParser

import pytest

from rbfrag.service.app import FOLDER
from rbfrag.vocabulary.quantities import INPUTS, OTHER_WORDS, parameter_of

SOURCES = sorted(
    path for path in FOLDER.rglob("*.*") if path.suffix in (".html", ".js", ".css", ".svg")
)
EXPECTED = [path for path in SOURCES if "vendor" not in path.parts]
MODULES = [path for path in EXPECTED if path.suffix == ".js"]

SVG_NAMESPACE = "http://www.w3.org/2000/svg"


class Document(HTMLParser):
    """Return the files that a document loads, and the parts that a strict policy forbids."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.inline: list[str] = []
        self.ids: list[str] = []
        self._script = False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        inputs = dict(attrs)
        if tag in ("script", "img"):
            self.loads.append(inputs.get("src") or "")
        if tag == "link":
            self.loads.append(inputs["href"])
        self._script = tag in ("script", "style")
        self.inline += [f"{name}=" for name in inputs if name == "style" or name.startswith("on")]
        if "id" in inputs:
            self.ids.append(inputs["id"])

    def handle_data(self, data):
        if self._script and data.strip():
            self.inline.append(data)

    def handle_endtag(self, tag):
        self._script = False


PAGE = Document((FOLDER / "index.html").read_text(encoding="utf-8"))


def test_labels_units_and_hints_of_inputs_come_from_the_vocabulary():
    text = (FOLDER / "index.html").read_text(encoding="utf-8")
    labels = dict(re.findall(r'<label for="(\w+)">(.*?)</label>', text))
    words = {*map(parameter_of, INPUTS), *OTHER_WORDS} & {*labels}
    assert len(words) > 25
    for word in words:
        assert labels[word] == ""
        assert f'id="{word}-help"></p>' in text
        assert f'id="{word}-unit">' not in text or f'id="{word}-unit"></span>' in text


def test_what_the_document_loads_is_served_with_its_type(client):
    types = {".js": "javascript", ".css": "text/css", ".svg": "image/svg+xml"}
    assert len(PAGE.loads) > 4
    for path in PAGE.loads:
        answer = client.get(f"/{path}")
        assert answer.status_code == 200, path
        assert types["." + path.rsplit(".", 1)[1]] in answer.headers["content-type"]


def test_nothing_but_the_service_itself_is_allowed(client):
    for path in ("/", "/js/main.js", "/css/page.css"):
        headers = client.get(path).headers
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'self'" in policy
        assert "unsafe" not in policy
        assert "*" not in policy
        assert headers["x-content-type-options"] == "nosniff"


def test_the_document_holds_no_script_and_no_style():
    assert PAGE.inline == []
    assert len(set(PAGE.ids)) == len(PAGE.ids)


@pytest.mark.parametrize("path", EXPECTED, ids=lambda path: path.name)
def test_no_file_of_ours_names_another_host(path):
    text = path.read_text(encoding="utf-8").replace(SVG_NAMESPACE, "")
    assert re.findall(r"(?:https?:)?//[\w.-]+\.\w+\S*", text) == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.name)
def test_every_module_imports_modules_that_are_there(path):
    text = path.read_text(encoding="utf-8")
    for imported in re.findall(r'from "(\S+)";', text):
        assert (path.parent / imported).is_file(), imported


def test_every_module_is_used():
    seen, waiting = set(), [FOLDER / "js" / "main.js"]
    while waiting:
        path = waiting.pop()
        if path in seen:
            continue
        seen.add(path)
        text = path.read_text(encoding="utf-8")
        waiting += [path.parent / name for name in re.findall(r'from "\./(\S+)";', text)]
    assert set(MODULES) == seen


def test_modules_turn_no_text_into_elements():
    for path in MODULES:
        text = path.read_text(encoding="utf-8")
        for word in (
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            ".html(",
            "eval(",
            "Function(",
        ):
            assert word not in text, f"{path.name}: {word}"


def test_the_checksum_stands_beside_the_library():
    for library in (FOLDER / "vendor").iterdir():
        value = [line.split() for line in (library / "SHA256SUMS").read_text("utf-8").splitlines()]
        shipped = {path.name for path in library.iterdir()} - {"LICENSE", "SHA256SUMS"}
        assert {name for _, name in value} == shipped
        for checksum, name in value:
            assert sha256((library / name).read_bytes()).hexdigest() == checksum, name


def test_the_licence_stands_beside_the_library():
    for library in (FOLDER / "vendor").iterdir():
        assert "Permission to use, copy, modify" in (library / "LICENSE").read_text("utf-8")
