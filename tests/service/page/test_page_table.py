"""A table of blocks that is pasted or dropped comes back with its answers."""

import csv
import io

import pytest
from playwright.sync_api import expect

import rbfrag
from rbfrag.db.location import REFERENCE

# a decimal comma, two languages, and a column that nothing depends on
ROWS = (
    "name\tHöhe [cm]\tWidth (m)\tDip of base (°)\tColour\n"
    "slab\t200\t0,4\t5°\tgrey\n=post\t300\t0,3\t0\t\nnone\t\t0,3\t0\t\n"
)

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
    table, _, notes = text.partition("# note")
    rows = csv.DictReader(io.StringIO(table.strip()), delimiter="\t")
    # the table has decimal commas, as the one that was pasted
    return [{n: cell.replace(",", ".") for n, cell in row.items()} for row in rows], notes


@pytest.mark.parametrize("dropped", [False, True])
def test_each_row_comes_back_with_its_answer(open_page, dropped):
    page = open_page("?height=1&width=1&pgv=0.8").page
    if dropped:
        page.evaluate(DROP, ROWS)
    else:
        page.fill("#table-text", ROWS)
        page.click("#table-ask")
    expect(page.locator("#table-said")).to_have_text(
        "2 of 3 blocks are answered; 1 without answer."
    )
    (slab, post, none), notes = downloaded(page)
    for row, height, width, dip in ((slab, 2.0, 0.4, 5.0), (post, 3.0, 0.3, 0.0)):
        expected = rbfrag.predict(
            height_m=height, width_m=width, beta_deg=dip, pgv_m_s=0.8, db=REFERENCE
        )
        assert float(row["probability"]) == pytest.approx(expected.probability, rel=1e-9)
        assert float(row["ci_low"]) == pytest.approx(expected.ci_low, rel=1e-9)
    assert post["name"] == "'=post"
    assert none["probability"] == ""
    assert none["reason"]
    for text in ("column Höhe [cm]: converted from cm to m", "column ignored: Colour"):
        assert text in notes
        expect(page.locator("#table-notes")).to_contain_text(text)
    expect(page.locator("#record-part")).to_be_hidden()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the table is empty"),
        ("height,width\n2,wide\n", "'wide' is not a number"),
        ("a,c\n1,2\n", "there is no column"),
        ("height,width,dip quality\n2,1,5\n", "'dip quality' is unknown"),
    ],
)
def test_a_table_that_cannot_be_read_is_rejected(open_page, text, message):
    opened = open_page()
    page = opened.page
    page.fill("#table-text", text)
    page.click("#table-ask")
    expect(page.locator("#table-error")).to_contain_text(message)
    expect(page.locator("#table-file")).to_be_hidden()
    opened.complaints.clear()  # the browser reports the rejected request
