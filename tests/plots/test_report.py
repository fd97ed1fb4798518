"""One page about one block: it says what was asked and answered, and is the same each time."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg

import rbfrag
from rbfrag.fragility.model_selection import SHIPPED, data_name
from rbfrag.hazards.curve import HazardCurve
from rbfrag.plots import report
from rbfrag.plots.report_contents import RateQuestion, contents_of, report_of
from rbfrag.results.numbers import percent, return_period
from tests.cli.conftest import Rejects, Shell, rejects, shell

__all__ = ["rejects", "shell"]

ROCK = rbfrag.Block.rectangle(2.4, 0.5)
SLIDES = {
    "height_m": 2.5, "width_m": 2.5, "beta_deg": 20.0, "phi_deg": 32.0, "displacement_m": 0.1,
}  # fmt: skip
SHAPE = ("--height", "2.4", "--width", "0.5", "--dip", "3", "--phi", "35", "--pgv", "0.6")
CURVE = "pgv_m_s,annual_rate\n0.05,0.08\n0.1,0.03\n0.2,0.009\n0.4,0.0022\n0.8,0.0004\n1.6,5e-5\n"


def words_of(path: Path, pages: int = 1) -> str:
    """Return the text of a report, its lines joined."""
    if path.suffix == ".pdf":
        pypdf = pytest.importorskip("pypdf")
        result = pypdf.PdfReader(path).pages
        assert len(result) == pages
        assert [round(float(edge)) for edge in result[0].mediabox[2:]] == [595, 842]
        text = " ".join(page.extract_text() for page in result)
    else:
        text = re.sub(r"<(style|svg).*?</\1>", " ", path.read_text("utf-8"), flags=re.DOTALL)
        text = re.sub(r"<sub>(.)</sub>", r"_\1", text)
        text = html.unescape(re.sub(r"<[^>]*>", " ", text))
    return " ".join(text.split())


@pytest.mark.parametrize("suffix", ["pdf", "html"])
def test_a_report_says_what_was_asked_and_answered(shell: Shell, suffix: str) -> None:
    Path("curve.csv").write_text(CURVE)
    out = f"rock.{suffix}"
    answer = shell.json(
        "report", *SHAPE, "--hazard", "curve.csv", "--component", "rotd50", "--years", "100",
        "--title", "Rock above the mill", "--date", "1 May 2026", "--out", out,
    )  # fmt: skip
    predicted = shell.json("predict", *SHAPE, "--component", "rotd50")
    rate = shell.json("hazard", "curve.csv", *SHAPE[:-2], "--component", "rotd50", "--years", "100")
    assert answer["probability"] == predicted["probability"]
    assert answer["hazard"]["annual_rate"] == rate["annual_rate"]
    printed = shell("predict", *SHAPE, "--component", "rotd50").stdout.splitlines()
    words = words_of(Path(out))
    annual = shell("hazard", "curve.csv", *SHAPE[:-2], "--component", "rotd50", "--years", "100")
    for sentence in (printed[0], annual.stdout.splitlines()[0]):
        assert " ".join(sentence.split()) in words
    for text in (
        "Rock above the mill", "1 May 2026", "2.4 m", "0.5 m", "3°", "35°", "0.6 m/s",
        "P(failure in 100 years)", f"rbfrag {rbfrag.__version__}", answer["model"], "curve.csv",
        "100 earthquakes", "the built-in data set",
    ):  # fmt: skip
        assert text in words, text
    for warning in answer["warnings"][:-1]:
        assert warning[1:].split(":")[0] in words


TABLE = (
    "block_id,height [m],width [m],beta [deg],phi [deg],displacement [m],pgv [m/s],kind\n"
    "A1,2.4,0.5,3,35,,0.6,\nA2,1.2,0.4,0,40,,0.4,rocking\nB,2.5,2.5,20,32,0.1,,\n"
    "C,1,0.5,60,35,,0.6,\nD,4,0.8,2,x,,0.9,\n"
)


def test_a_table_becomes_one_document(shell: Shell) -> None:
    Path("blocks.csv").write_text(TABLE)
    Path("curve.csv").write_text(CURVE)
    rate = ("--hazard", "curve.csv", "--component", "rotd50")
    for suffix in ("pdf", "html"):
        out = f"blocks.{suffix}"
        answer = shell.json("report", "blocks.csv", "--pgv", "0.5", *rate, "--out", out)["blocks"]
        prediction = shell.json("predict", *SHAPE, "--component", "rotd50")
        assert [item["probability"] for item in answer[:2]] == [1.0, prediction["probability"]]
        assert len(answer) == 4
        words = words_of(Path(out), pages=3)
        for text in (
            "Seismic fragility of rock blocks", "return period",
            f"A1 toppling (rock face behind) {percent(prediction['probability'])}",
            "A2 rocking (free-standing)", "B sliding", "unstable at rest", "'x' is not a number",
            return_period(answer[2]["hazard"]["annual_rate"]), "sliding-pgv",
        ):  # fmt: skip
            assert text in words, text
    page = Path("blocks.html").read_text("utf-8")
    assert page.count("<svg") == 7  # of the unstable block its drawing alone
    names = re.findall(r'\bid="([^"]*)"', page)
    assert len(names) == len(set(names))
    notes = re.findall("<li>(.*?)</li>", page)
    assert len(notes) == len(set(notes))
    assert any("the curve is of RotD50" in text for text in notes)


def test_a_table_that_makes_no_document(rejects: Rejects) -> None:
    Path("blocks.csv").write_text(TABLE)
    question = ("report", "blocks.csv", "--pgv", "0.5", "--out")
    assert "require .pdf or .html" in rejects(*question, "a.png")
    Path("blocks.csv").write_text("height [m],width [m],pgv [m/s]\n1,x,0.5\n")
    assert "'x' is not a number" in rejects("report", "blocks.csv", "--out", "a.pdf")
    assert not list(Path().glob("a.*"))


def test_the_same_question_gives_the_same_file(tmp_path: Path) -> None:
    for suffix in ("pdf", "png", "html"):
        first, second = (
            rbfrag.report(tmp_path / f"{name}.{suffix}", block=ROCK, beta_deg=3.0, pgv_m_s=0.6)
            for name in ("first", "second")
        )
        assert first.read_bytes() == second.read_bytes()


def test_a_page_needs_nothing_but_itself(tmp_path: Path) -> None:
    curve = HazardCurve("pgv_m_s", np.array([0.1, 1.0]), np.array([0.02, 1e-4]))
    path = rbfrag.report(
        tmp_path / "a.html", p2=3.0, kr=0.1, pgv_m_s=0.6, curve=curve, component="single"
    )
    text = path.read_text("utf-8")
    assert text.count("<svg") == text.count("</svg>") == 4
    for outside in ("http", "src=", "@import", "<link", "<script"):
        assert outside not in text, outside
    names = re.findall(r'\bid="([^"]*)"', text)
    assert len(names) == len(set(names))
    used = set(re.findall(r'(?:url\(#|href="#)([^")]*)', text))
    assert used <= set(names)


@pytest.mark.parametrize(
    ("question", "words"),
    [
        (("--p2", "3", "--pgv", "0.6"), "kr is missing"),
        (("--p2", "3", "--kr", "0.1"), "no intensity measure is given"),
        (("--p2", "-3", "--kr", "0.1", "--pgv", "0.6"), "p2 = -3"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--kind", "sliding"), "kind sliding"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--hazard", "no.csv"), "no.csv: no such"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--years", "10"), "--years requires"),
        (("--height", "1", "--width", "2", "--phi", "30", "--pgv", "0.6"), "give --displacement"),
    ],
)
def test_bad_questions_leave_no_file(
    rejects: Rejects, question: tuple[str, ...], words: str
) -> None:
    assert words in rejects("report", *question, "--out", "a.pdf")
    assert not list(Path().iterdir())


def test_notes_are_sentences_and_symbols_have_their_index(tmp_path: Path) -> None:
    for suffix in ("pdf", "html"):
        path = rbfrag.report(tmp_path / f"a.{suffix}", p2=3.0, kr=0.1, pgv_m_s=30.0)
        words = words_of(path)
        assert "did you mean cm/s?" in words
        assert "cm/s?." not in words
    page = (tmp_path / "a.html").read_text("utf-8")
    assert "rectangle of this p² and k<sub>r</sub>" in page


def test_reports_of_blocks_that_slide_and_slump(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    component = ("--component", "rotd50")
    slides = ("--height", "2.5", "--width", "2.5", "--dip", "20", "--phi", "32",
              "--displacement", "0.1")  # fmt: skip
    slumps = ("--ks", "0.2", "--ps2", "3")
    pga = ("--pga", "0.5")
    for block, pictures, words in (
        (slides, 4, ("failure mode sliding", "displacement limit 0.1 m")),
        # no curve of one measure is enough for a slump
        (slumps, 1, ("failure mode slumping", "p_s² 3 1/s²", "velocity, y = k_s g/p_s")),
    ):
        shaking, hazard = ("--pgv", "0.6", *(pga if block is slumps else component)), ()
        if block is slides:
            hazard = ("--hazard", "curve.csv")
        answer = shell.json("report", *block, *shaking, *hazard, "--out", "a.html")
        assert answer["probability"] == shell.json("predict", *block, *shaking)["probability"]
        if hazard:
            rate = shell.json("hazard", "curve.csv", *block, *component)
            assert answer["hazard"]["annual_rate"] == rate["annual_rate"]
        page = Path("a.html").read_text("utf-8")
        assert page.count("<svg") == pictures
        assert "Design chart" not in page
        for text in words:
            assert text in words_of(Path("a.html")), text


def test_a_report_has_the_limit_state_and_the_level_that_are_asked_for(tmp_path: Path) -> None:
    slumps = {"ks": 0.2, "ps2": 3.0, "kind": "slumping", "pgv_m_s": 0.6, "pga_g": 0.5}
    path = rbfrag.report(tmp_path / "slump.html", **slumps, rotation_deg=2.0)
    p = rbfrag.predict(**slumps, rotation_deg=2.0).probability
    assert f"rotation of 2 degrees or failure past recovery) = {percent(p)}" in words_of(path)
    (tmp_path / "curve.csv").write_text(CURVE)
    rows = [{"p2": 3.0, "kr": kr, "pgv_m_s": 0.5, "level": 0.8} for kr in (0.1, 0.15)]
    meaning = {"component": "rotd50"}
    result = report_of(rows, RateQuestion(tmp_path / "curve.csv", meaning=meaning))
    rates = rbfrag.hazard(tmp_path / "curve.csv", p2=3.0, kr=[0.1, 0.15], level=0.8, **meaning)
    assert result.totals["expected_failures_per_year"] == rates.expected_failures_per_year
    assert any("80 % confidence" in value for _, value in result.summary)


def test_the_curve_of_a_report_scales_all_measures() -> None:
    shaking = {"pgv_m_s": 0.6, "pga_g": 0.5, "sa(1)": 0.5}
    contents = contents_of({"p2": 3.0, "kr": 0.05, **shaking})
    figure = report.new_figure(4.0, 4.0)
    report._draw_panel(figure, "curve", contents)
    (axes,) = figure.axes
    assert axes.get_title() == "other measures in proportion"
    x, y = axes.lines[0].get_data()
    stronger = {name: value * x[60] / 0.6 for name, value in shaking.items()}
    answer = rbfrag.predict(3.0, 0.05, sa_g={1.0: stronger.pop("sa(1)")}, **stronger)
    assert y[60] == pytest.approx(answer.probability)


def test_a_path_of_another_kind_is_rejected(rejects: Rejects) -> None:
    assert ".docx" in rejects("report", *SHAPE, "--out", "a.docx")


@pytest.mark.parametrize(
    ("block", "shaking", "with_rate"),
    [
        ({"block": ROCK}, {"pgv_m_s": 0.6, "pga_g": 0.5}, True),
        ({"block": ROCK, "kind": "rocking"}, {"pgv_m_s": 0.6}, False),
        ({"block": ROCK, "kind": "rocking"}, {"sa(1)": 0.5, "pga_g": 0.6}, False),
        ({"block": ROCK}, {"pgv_m_s": 0.6, "pga_g": 0.5, "tm_s": 0.6}, False),
        ({"block": ROCK}, {"pgv_m_s": 0.6, "pga_g": 0.5, "sa(0.3)": 0.9, "sa(1)": 0.5}, True),
        ({"block": ROCK}, {"sa(1)": 0.5}, False),
        (SLIDES, {"pgv_m_s": 0.6, "pga_g": 0.5}, True),
        ({"ky": 0.2, "displacement_m": 0.1}, {"pgv_m_s": 0.6}, False),
        ({"ks": 0.2, "ps2": 3.0}, {"pgv_m_s": 0.6, "pga_g": 0.5}, False),
    ],
)
def test_nothing_on_the_sheet_covers_anything(
    block: dict[str, Any], shaking: dict[str, float], with_rate: bool, tmp_path: Path
) -> None:
    (tmp_path / "curve.csv").write_text(CURVE)
    curve = tmp_path / "curve.csv" if with_rate else None
    rate = RateQuestion(curve, meaning={"component": "single"})
    contents = contents_of({**block, **shaking}, rate)
    with rc_context(report._RC):
        figure = report.new_figure(8.27, 11.69)
        report._draw(figure, contents, "A title", "today")
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        renderer = canvas.get_renderer()
        texts = [text for text in texts_of(figure) if text.get_text()]
        for axes in figure.axes:
            texts += [item for item in (axes.xaxis.label, axes.yaxis.label) if item.get_text()]
        boxes = [item.get_window_extent(renderer) for item in (*figure.axes, *texts)]
    for i, box in enumerate(boxes):
        assert figure.bbox.contains(*box.min)
        assert figure.bbox.contains(*box.max)
        for other in boxes[i + 1 :]:
            assert not box.padded(-1.0).overlaps(other.padded(-1.0))


def test_a_long_title_has_lines_and_its_dollars(tmp_path: Path) -> None:
    contents = contents_of({"block": ROCK, "pgv_m_s": 0.6})
    title = "Blocks above the road, at costs of $5 and $6 a day, " * 4
    figure = report.new_figure(8.27, 11.69)
    report._draw(figure, contents, title, "1 May 2026")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    texts = [text for text in texts_of(figure) if text.get_text()]
    heads = [text for text in texts if text.get_fontsize() == 15.0]
    assert len(heads) == 3
    assert "$5 and $6" in " ".join(text.get_text() for text in heads)
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in texts]
    for i, box in enumerate(boxes):
        assert figure.bbox.contains(*box.min)
        assert figure.bbox.contains(*box.max)
        assert not any(box.padded(-1.0).overlaps(other.padded(-1.0)) for other in boxes[:i])


def texts_of(part):
    return [*part.texts, *(text for subfig in part.subfigs for text in texts_of(subfig))]


def test_the_password_of_a_database_is_not_printed() -> None:
    assert data_name("postgresql://me:secret@host/rocks?options=-c") == "rocks"
    assert data_name("/home/me/rocks.db") == "rocks.db"
    assert data_name(SHIPPED) == SHIPPED


def test_the_most_critical_blocks_have_their_sensitivity(tmp_path: Path) -> None:
    curve = HazardCurve("pgv_m_s", np.array([0.1, 0.4, 1.6]), np.array([3e-2, 2.2e-3, 5e-5]))
    rows = [
        {"block_id": f"b{i}", "height_m": 2.0, "width_m": 0.3 + 0.02 * i, "phi_deg": 40.0,
         "pgv_m_s": 0.9}
        for i in range(8)
    ]  # fmt: skip
    out = tmp_path / "rocks.html"
    contents = report.write_report(out, rows, RateQuestion(curve))
    assert contents.most_critical == [f"b{i}" for i in range(6)]
    text = out.read_text("utf-8")
    title = "<figcaption>P at usual errors of measurement</figcaption>"
    assert text.count(title) == 6
    assert text.count("<figcaption>Probability of failure of this block</figcaption>") == 2
    rbfrag.report(out, curve=curve, height_m=2.0, width_m=0.4, phi_deg=40.0, pgv_m_s=0.6)
    alone = out.read_text("utf-8")
    assert alone.count(title) == 1
    assert alone.count("<figcaption>") == 5
