"""The contacts in plan and k_r over azimuth are those of the block."""

from __future__ import annotations

import numpy as np
import pytest

import rbfrag
from rbfrag.errors import InputError
from rbfrag.plots.block import plot_mesh_block
from tests.conftest import ROOT
from tests.meshes import box, cut_ellipsoid, turned, write_obj

BOULDER = ROOT / "docs" / "examples" / "boulder.obj"


@pytest.mark.parametrize("contact_mm", [7.0, 10.0])
def test_what_is_drawn_is_the_block(contact_mm, tmp_path, figures, overlapping):
    block = rbfrag.block_from_mesh(BOULDER, contact_mm=contact_mm)
    plot_mesh_block(block, tmp_path / "a.png")
    (figure,) = figures
    plan, polar = figure.axes
    contacts = next(line for line in plan.lines if line.get_label() == "contacts")
    np.testing.assert_array_equal(contacts.get_xydata(), block.hull.points_m)
    weakest = block.hull.weakest()
    drawn = {line.get_label(): line for line in polar.lines}
    assert drawn.keys() == {
        "weakest azimuth", *(f"contacts within {hull.contact_mm:g} mm" for hull in block.hulls)
    }  # fmt: skip
    # the dashes of two lines never look alike
    assert len({(x.get_linestyle(), x.get_linewidth()) for x in polar.lines}) == len(drawn)
    question = drawn[f"contacts within {contact_mm:g} mm"].get_xydata()
    np.testing.assert_allclose(
        question[:, 1], block.hull.rocking(np.degrees(question[:, 0])).kr_forward, rtol=1e-12
    )
    (x, y) = drawn["weakest azimuth"].get_xydata()[0]
    assert (np.degrees(x), y) == pytest.approx((weakest.azimuth_deg, weakest.kr))
    # the arrow ends on the hull's nearest edge
    (arrow,) = [text for text in plan.texts if text.arrow_patch is not None]
    assert np.hypot(*arrow.xy) == pytest.approx(weakest.kr * block.hull.height_m)
    assert "[m]" in plan.get_xlabel()
    assert "[g]" in polar.get_title()
    texts = [*plan.texts, plan.xaxis.label, plan.yaxis.label, polar.title, figure._suptitle]
    legend = figure.legends[0].get_texts()
    numbers = [*polar.get_xticklabels(), *polar.get_yticklabels()]
    assert overlapping(figure, [*texts, *legend, *numbers]) == []


def test_axes_are_named_as_in_the_file_and_what_falls_is_left_out(tmp_path, figures):
    vertices, faces = turned(box(0.4, 0.5, 1.1), "y", -1.0)
    path = write_obj(tmp_path / "a.obj", (np.roll(vertices, 1, axis=1), faces))
    plot_mesh_block(rbfrag.block_from_mesh(path, up="x"), tmp_path / "a.svg")
    plan, polar = figures[0].axes
    assert plan.get_xlabel().startswith("y of the mesh")
    assert plan.get_ylabel().startswith("z of the mesh")
    labels = {line.get_label() for line in polar.lines}
    assert "contacts within 5 mm" not in labels
    assert "contacts within 20 mm" in labels


def test_a_path_that_cannot_be_written_is_rejected(tmp_path):
    path = write_obj(tmp_path / "a.obj", cut_ellipsoid((0.3, 0.3, 0.4), 0.7, 6))
    with pytest.raises(InputError, match="plot file"):
        plot_mesh_block(rbfrag.block_from_mesh(path), tmp_path / "a.jpg")
