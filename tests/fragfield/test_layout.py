"""Figures laid out once: whole, without overlaps, with the ticks that they had."""

from __future__ import annotations

import pytest

from fragfield.report.figures.drawing import WIDE, drawing_style, new_figure
from fragfield.report.figures.layout import place_panels, prepare, without_markup


def test_panels_with_their_decorations_fill_the_figure_and_do_not_overlap():
    with drawing_style():
        figure, axes = new_figure(2, 2, width=WIDE, height=5.0, gridspec_kw={"height_ratios": (3, 1)})
        for number, axis in enumerate(axes):
            axis.plot([0, 1], [0, 10.0 ** (3 * number)])
            axis.set(xlabel="x", ylabel="y\nof two lines", title="Title")
        prepare(figure)
        place_panels(figure)
        drawn = [axis.get_tightbbox() for axis in axes]
        for i, one in enumerate(drawn):
            for other in drawn[:i]:
                assert not one.overlaps(other)
        size = figure.get_size_inches() * figure.dpi
        for edge, end in ((min(box.x0 for box in drawn), 0.0), (max(box.x1 for box in drawn), size[0]),
                          (min(box.y0 for box in drawn), 0.0), (max(box.y1 for box in drawn), size[1])):  # fmt: skip
            assert edge == pytest.approx(end, abs=0.15 * figure.dpi)
        high = [axis.get_window_extent().height for axis in axes]
        assert high[0] == pytest.approx(high[1])
        assert high[0] == pytest.approx(3 * high[2])


@pytest.mark.parametrize("shared", [False, True])
def test_minor_ticks_of_logarithmic_axes_are_marked_on_every_panel(shared):
    with drawing_style():
        figure, axes = new_figure(1, 2, width=WIDE, height=3.0, sharey=shared)
        for axis in axes:
            axis.plot([1, 2], [1, 1000])
            axis.set(yscale="log", ylim=(1, 1000))
        prepare(figure)
        expected = [factor * 10.0**power for power in range(3) for factor in range(2, 10)]
        for axis in axes:
            marks = [line for line in axis.lines if line.get_label() == "_minor"]
            assert len(marks) == 1
            assert sorted(marks[0].get_ydata()) == pytest.approx(expected)
            assert axis.get_ylim() == (1, 1000)
            assert axis.get_xlim() == pytest.approx((0.95, 2.05))
        assert [text.get_text() for text in axes[0].get_yticklabels()][1:-1] == ["10⁰", "10¹", "10²", "10³"]


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        (r"$\mathdefault{10^{-12}}$", "10⁻¹²"),
        (r"$\mathdefault{10^{3}}$", "10³"),
        (r"$\mathdefault{-10^{3}}$", "−10³"),
        (r"$\mathdefault{2\times10^{-1}}$", "2×10⁻¹"),
        (r"$\mathdefault{e^{3}}$", r"$\mathdefault{e^{3}}$"),
        ("", ""),
        ("5 m", "5 m"),
    ],
)
def test_powers_without_markup(text, plain):
    assert without_markup(text) == plain
