"""A table of blocks that is pasted or dropped comes back with its answers."""

import csv
import io

import pytest
from playwright.sync_api import expect

import rbfrag
from rbfrag.db.location import REFERENCE

ROWS = "name\theight_m\tWidth (m)\nslab\t2\t0,4\n=post\t3\t0.3\nnone\t\t0.3\n"

DROP = """(text) => {
  const data = new DataTransfer();
  data.items.add(new File([text], 'blocks.tsv'));
  document.querySelector('#table-text').dispatchEvent(
    new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));
}"""


def downloaded(page):
    with page.expect_download() as waited:
        page.click("#table-file")
    text = waited.value.path().read_text(encoding="utf-8-sig")
    return list(csv.DictReader(io.StringIO(text)))


@pytest.mark.parametrize("dropped", [False, True])
def test_each_row_comes_back_with_its_answer(open_page, dropped):
    page = open_page("?height=1&width=1&pgv=0.8").page
    if dropped:
        page.evaluate(DROP, ROWS)
    else:
        page.fill("#table-text", ROWS)
        page.click("#table-ask")
    expect(page.locator("#table-said")).to_have_text("2 of 3 blocks are answered.")
    slab, post, none = downloaded(page)
    for row, height, width in ((slab, 2.0, 0.4), (post, 3.0, 0.3)):
        known = rbfrag.predict(height_m=height, width_m=width, pgv_m_s=0.8, db=REFERENCE)
        assert float(row["probability"]) == pytest.approx(known.probability, rel=1e-9)
        assert float(row["ci_low"]) == pytest.approx(known.ci_low, rel=1e-9)
    assert post["name"] == "'=post"
    assert none["probability"] == ""
    assert none["reason"]
    expect(page.locator("#record-part")).to_be_hidden()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "Paste names of columns"),
        ("height,width\n2,wide\n", "Row 2: width is no number: wide"),
        ("a,b\n1,2\n", "No column names a block"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(open_page, text, said):
    page = open_page().page
    page.fill("#table-text", text)
    page.click("#table-ask")
    expect(page.locator("#table-error")).to_contain_text(said)
    expect(page.locator("#table-file")).to_be_hidden()
