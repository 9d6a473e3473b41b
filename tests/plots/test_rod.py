"""Pictures: what is in them, where the arrows point, and that no display is needed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.equilibria.result import Equilibrium
from peel_opt.model.labels import DISQUALIFYING
from peel_opt.plots import picture_file, plot_equilibrium, plot_family, save_figure
from peel_opt.plots.forces import COUNT, adhesive_force
from peel_opt.plots.words import length_unit, quantity

UNIT = po.Rod.from_ratio(1.0)
TAPE = po.Rod(bending_stiffness=9.5e-6, adhesion_strength=5e5, adhesion_range=4e-4)
GRAPHENE = po.Rod(bending_stiffness=5.7e-18, adhesion_strength=6.2e8, adhesion_range=1e-9)
MEMS = po.Rod(bending_stiffness=1.1e-7, adhesion_strength=8.9e5, adhesion_range=2e-8)


@cache
def shape(name: str) -> Equilibrium:
    makers = {
        "fig10a": lambda: po.equilibrium(beta0=53.16, beta1=113.1),
        "negative": lambda: po.equilibrium(beta0=4.0, lam=1.0),
        "no strength": lambda: po.equilibrium(beta0=0.0, lam=1.0),
        "spurious": lambda: po.equilibrium(beta0=4.0, lam=1.0, state="spurious"),
        "within": lambda: po.length_given_pressure(UNIT, 0.8),
        "beyond": lambda: po.length_given_pressure(UNIT, 0.2),
        "folded": lambda: po.length_given_pressure(UNIT, 0.2, state="folded"),
        "near T": lambda: po.length_given_pressure(UNIT, 0.999),
        "exponential": lambda: po.length_given_pressure(UNIT, 0.4, law=po.exponential()),
        "stiff": lambda: po.length_given_pressure(po.Rod.from_ratio(30.0), 0.01),
        "tape": lambda: po.length_given_pressure(TAPE, 1.75e5),
        "graphene": lambda: po.length_given_pressure(GRAPHENE, 1.86e8),
        "mems": lambda: po.length_given_pressure(MEMS, 8.9e4),
    }
    return makers[name]()


def _polar() -> Axes:
    return Figure().add_subplot(projection="polar")


@pytest.mark.parametrize(
    ("ax", "words"),
    [
        (lambda: Figure().subplots(2), "one Axes, got 2 of them"),
        (lambda: list(Figure().subplots(2)), "one Axes, got 2 of them"),
        (Figure, "an Axes, got a figure. Give figure.add_subplot()"),
        (lambda: Figure().subfigures(), "an Axes, got a figure"),
        (_polar, "the projection 'polar'"),
        (lambda: Figure().add_subplot(projection="3d"), "the projection '3d'"),
        (lambda: 3, "an Axes of Matplotlib, got int"),
    ],
)
@pytest.mark.parametrize("drawn", ["equilibrium", "family", "branch", "loop", "potential", "table", "sweep"])
def test_axes_that_cannot_be_drawn_into_are_refused(ax, words, drawn):
    with pytest.raises(po.InvalidInput, match=re.escape(words)):
        _drawers()[drawn](ax())


@cache
def _drawers():
    from functools import partial

    from peel_opt.plots.potential import plot_potential

    branch = po.trace(beta0=4.0, lam=(-1.0, 1.0), points=8)
    table = po.tradeoff(
        partial(po.equilibrium, beta0=4.0, lam=1.0), methods=("series",), tols=(1e-3,), repeats=1
    )
    return {
        "equilibrium": shape("within").plot,
        "family": lambda ax: plot_family([shape("within")], ax),
        "branch": branch.plot,
        "loop": po.hysteresis(beta0=4.0, points=5).plot,
        "potential": lambda ax: plot_potential(po.NormalForm.paper().at(4.0), ax=ax),
        "table": table.plot,
        "sweep": po.sweep({"ratio": [1.0, 2.0], "pressure_ratio": 0.8}, workers=1).plot,
    }


def test_the_place_of_a_picture_is_made_before_the_work(tmp_path):
    path = tmp_path / "deep" / "er" / "a.png"
    assert picture_file(path) == path
    assert path.parent.is_dir()
    with pytest.raises(po.InvalidInput, match="format"):
        picture_file(tmp_path / "other" / "a.txt")
    assert not (tmp_path / "other").exists()


def artist(ax: Axes, gid: str):
    """Return the artist of a name, None if it is not there."""
    found = [a for a in ax.get_children() if str(a.get_gid()).removeprefix("mark:") == gid]
    assert len(found) <= 1
    return found[0] if found else None


def arrows(ax: Axes, gid: str) -> tuple[np.ndarray, np.ndarray]:
    """Return tails and vectors, both (n, 2), the vectors on the scale of the paper."""
    quiver = artist(ax, gid)
    return np.asarray(quiver.get_offsets()), np.stack([quiver.U, quiver.V * ax.get_aspect()], axis=-1)


EVERY = (
    "fig10a",
    "negative",
    "no strength",
    "spurious",
    "within",
    "beyond",
    "folded",
    "near T",
    "stiff",
    "mems",
)


@pytest.mark.parametrize("name", EVERY)
def test_everything_is_there_and_inside_the_frame(name: str) -> None:
    eq = shape(name)
    ax = plot_equilibrium(eq)
    for gid in ("plate", "rod", "attached", "tip", "detachment", "pressure"):
        assert artist(ax, gid) is not None, gid
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    for gid in ("pressure", "adhesion", "repulsion"):
        if artist(ax, gid) is not None:
            quiver = artist(ax, gid)
            heads = quiver.get_offsets() + np.stack([quiver.U, quiver.V], axis=-1)
            assert np.all((heads >= (left, bottom)) & (heads <= (right, top)))
    assert artist(ax, "attached").get_xdata()[0] == 0.0
    assert artist(ax, "attached").get_xdata()[-1] > max(eq.x.max() / eq.length, 0.0)
    assert np.all(np.diff([bottom, *ax.get_yticks(), top]) >= 0.0)


@pytest.mark.parametrize("name", EVERY)
def test_dashed_exactly_where_the_linear_law_is_out_of_range(name: str) -> None:
    eq = shape(name)
    dashed = artist(plot_equilibrium(eq), "rod-beyond-y0")
    assert (dashed is not None) == ("y > y0" in eq.flags)
    if dashed is not None:
        y0 = eq.beta0 / eq.beta1
        assert np.nanmin(np.where(np.isnan(dashed.get_xdata()), np.nan, dashed.get_ydata())) == pytest.approx(
            y0
        )
        assert dashed.get_linestyle() != "-"


def test_a_true_shape_has_equal_scales_and_a_flat_one_says_so() -> None:
    assert plot_equilibrium(shape("beyond")).get_aspect() == 1.0
    assert "scale" not in plot_equilibrium(shape("beyond")).get_ylabel()
    flat = plot_equilibrium(shape("mems"))
    assert flat.get_aspect() == 100.0
    assert flat.get_ylabel().endswith("vertical scale × 100")


@pytest.mark.parametrize(("name", "unit"), [("tape", "[µm]"), ("graphene", "[nm]"), ("mems", "[µm]")])
def test_units_on_the_axes_follow_the_size(name: str, unit: str) -> None:
    ax = plot_equilibrium(shape(name))
    assert ax.get_xlabel() == f"$x$ {unit}"
    assert ax.get_ylabel().startswith(f"$y$ {unit}")
    eq = shape(name)
    size = {"[µm]": 1e-6, "[nm]": 1e-9}[unit]
    assert artist(ax, "rod").get_xdata() == pytest.approx(eq.x / size)
    assert artist(ax, "y0").get_ydata()[0] == pytest.approx(eq.rod.adhesion_range / size)


def test_without_units_lengths_are_ratios() -> None:
    assert plot_equilibrium(shape("fig10a")).get_xlabel() == r"$x/\bar s$"
    assert plot_equilibrium(shape("within")).get_xlabel() == r"$x/\eta$"
    assert UNIT.dimensionless
    assert not TAPE.dimensionless


def test_pressure_stands_normal_to_the_rod_and_pushes_the_right_way() -> None:
    eq = shape("folded")
    tails, vectors = arrows(plot_equilibrium(eq), "pressure")
    assert len(tails) == COUNT
    nearest = [int(np.argmin(np.hypot(eq.x - x, eq.y - y))) for x, y in tails]
    theta = eq.theta[nearest]
    pushes = np.stack([-np.sin(theta), np.cos(theta)], axis=-1)  # -p n
    along = np.sum(vectors * pushes, axis=-1) / np.linalg.norm(vectors, axis=-1)
    assert along == pytest.approx(np.ones(COUNT), abs=1e-3)
    assert vectors[0, 1] < 0.0  # down on the part that is folded over
    assert vectors[-1, 1] > 0.0


def test_a_negative_pressure_points_at_the_rod() -> None:
    tails, vectors = arrows(plot_equilibrium(shape("negative")), "pressure")
    assert np.all(vectors[:, 1] < 0.0)
    heads = tails + vectors / [1.0, plot_equilibrium(shape("negative")).get_aspect()]
    eq = shape("negative")
    gaps = [np.min(np.hypot(eq.x - x, eq.y - y)) for x, y in heads]
    assert max(gaps) < 0.01


def test_adhesion_is_vertical_and_as_long_as_its_traction() -> None:
    ax = plot_equilibrium(shape("within"))
    tails, vectors = arrows(ax, "adhesion")
    assert np.all(vectors[:, 0] == 0.0)
    assert np.all(vectors[:, 1] < 0.0)
    longest = -vectors[:, 1].min() / (1.0 - tails[np.argmin(vectors[:, 1]), 1])
    assert -vectors[:, 1] == pytest.approx(longest * (1.0 - tails[:, 1]), rel=1e-3)
    # To the same scale as the pressure, when both can be read.
    assert np.linalg.norm(arrows(ax, "pressure")[1], axis=-1) == pytest.approx(0.8 * longest, rel=1e-3)


def test_a_weak_pressure_says_how_much_it_is_magnified() -> None:
    labels = plot_equilibrium(shape("stiff")).get_legend().get_texts()
    assert any("pressure $p$ (arrows × 50)" in text.get_text() for text in labels)


def test_no_adhesion_on_the_free_arc() -> None:
    for name in ("beyond", "folded", "stiff"):
        eq = shape(name)
        tails, _ = arrows(plot_equilibrium(eq), "adhesion")
        assert len(tails) >= 3
        assert np.all(tails[:, 1] < eq.rod.adhesion_range)


def test_the_linear_law_repels_beyond_its_range() -> None:
    eq = shape("fig10a")
    ax = plot_equilibrium(eq)
    tails, vectors = arrows(ax, "repulsion")
    y0 = eq.beta0 / eq.beta1
    assert np.all(tails[:, 1] > y0)
    assert np.all(vectors[:, 1] > 0.0)
    assert np.all(arrows(ax, "adhesion")[0][:, 1] < y0)
    assert artist(plot_equilibrium(shape("within")), "repulsion") is None


@pytest.mark.parametrize(
    ("name", "tau"),
    [
        ("fig10a", lambda u: 1.0 - u),
        ("beyond", lambda u: np.maximum(1.0 - u, 0.0)),
        ("exponential", lambda u: np.exp(-u)),
    ],
)
def test_traction_from_the_balance_is_that_of_the_law(name: str, tau) -> None:
    eq = shape(name)
    u = eq.shape.y * eq.beta1 / eq.beta0
    assert -adhesive_force(eq) / eq.beta0 == pytest.approx(tau(u), abs=0.01)


def test_y0_out_of_the_frame_is_announced() -> None:
    ax = plot_equilibrium(shape("near T"))
    assert artist(ax, "y0") is None
    assert "uparrow" in artist(ax, "y0-label").get_text()
    assert artist(plot_equilibrium(shape("no strength")), "y0-label") is None


def test_the_caption_says_what_it_is_and_what_to_beware_of() -> None:
    ax = plot_equilibrium(shape("tape"))
    title = ax.get_title(loc="left")
    for words in ("175 kPa", "948.6 µm", "p/T_0 = 0.35", "lower state", "cohesive law", "certified, error"):
        assert words in title
    assert artist(ax, "flags") is None
    assert "overhang" in plot_equilibrium(shape("folded")).get_title(loc="left")
    assert "outside the range of the law" in artist(plot_equilibrium(shape("fig10a")), "flags").get_text()
    doubtful = replace(shape("tape"), status="not-certified", flags=DISQUALIFYING)
    ax = plot_equilibrium(doubtful)
    assert "not certified" in ax.get_title(loc="left")
    assert len(artist(ax, "flags").get_text().splitlines()) == len(DISQUALIFYING)


def test_given_axes_are_used_and_returned() -> None:
    ax = Figure().add_subplot()
    assert shape("tape").plot(ax) is ax
    assert ax.get_legend() is not None
    bare = Figure().add_subplot()
    plot_equilibrium(shape("tape"), bare, legend=False)
    assert bare.get_legend() is None


@pytest.mark.parametrize("name", ["tape", "folded", "mems"])
def test_the_legend_is_never_cut_off(name: str) -> None:
    for ax in (shape(name).plot(Figure().add_subplot()), shape(name).plot()):
        figure = ax.figure
        figure.draw_without_rendering()
        inside, box = figure.bbox, ax.get_legend().get_window_extent()
        assert inside.x0 <= box.x0 < box.x1 <= inside.x1
        assert inside.y0 <= box.y0 < box.y1 <= inside.y1


def test_nothing_to_draw() -> None:
    nothing = po.length_given_pressure(UNIT, 0.05, throw=False)
    with pytest.raises(po.InvalidInput, match="no shape to draw: status 'no-equilibrium'"):
        plot_equilibrium(nothing)
    with pytest.raises(po.InvalidInput, match="no shape to draw"):
        plot_family([shape("within"), nothing])


def test_a_family_shares_plate_and_unit() -> None:
    family = [shape("within"), shape("beyond"), shape("folded")]
    ax = plot_family(family)
    rods = [a for a in ax.get_children() if a.get_gid() == "family"]
    assert [line.get_xdata()[0] for line in rods] == pytest.approx([eq.x[0] for eq in family])
    assert (
        len(
            {
                line.get_color() if isinstance(line.get_color(), str) else tuple(line.get_color())
                for line in rods
            }
        )
        == 3
    )
    assert artist(ax, "plate") is not None
    assert artist(ax, "y0") is not None
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["$p/T_0 = 0.8$", "$p/T_0 = 0.2$, lower", "$p/T_0 = 0.2$, folded"]
    given = Figure().add_subplot()
    assert plot_family(family, given, labels=["a", "b", "c"]) is given
    assert [text.get_text() for text in given.get_legend().get_texts()] == ["a", "b", "c"]


def test_a_family_of_different_ranges_has_no_y0() -> None:
    assert artist(plot_family([shape("within"), shape("stiff")]), "y0-label") is None


@pytest.mark.parametrize(
    ("family", "labels", "message"),
    [
        ([], None, "needs shapes"),
        (["within"], ["a", "b"], "a label for each, got 1 and 2"),
        (["within", "fig10a"], None, "differ in unit"),
    ],
)
def test_families_that_cannot_be_meant(family: list[str], labels: list[str] | None, message: str) -> None:
    with pytest.raises(po.InvalidInput, match=message):
        plot_family([shape(name) for name in family], labels=labels)


@pytest.mark.parametrize(
    ("value", "text"),
    [(48679.459, "48.68 kPa"), (-133.3, "-133.3 Pa"), (6.2e8, "620 MPa"), (1e-9, "1 nPa"), (0.0, "0 Pa")],
)
def test_engineering_prefixes(value: float, text: str) -> None:
    assert quantity(value, "Pa") == text


@pytest.mark.parametrize(("extent", "name"), [(1.9e-3, "mm"), (9.5e-4, "µm"), (6e-9, "nm"), (2.0, "m")])
def test_unit_of_an_axis(extent: float, name: str) -> None:
    assert length_unit(TAPE, extent).name == name


class TestFiles:
    @pytest.mark.parametrize(
        ("suffix", "magic"),
        [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF"), (".PNG", b"\x89PNG")],
    )
    def test_formats(self, tmp_path: Path, suffix: str, magic: bytes) -> None:
        figure = plot_family([shape("tape")]).figure
        path = save_figure(figure, tmp_path / f"picture{suffix}", dpi=40)
        first = path.read_bytes()
        assert first.startswith(magic)
        assert save_figure(figure, path, dpi=40).read_bytes() == first
        assert list(tmp_path.iterdir()) == [path]

    @pytest.mark.parametrize("name", ["picture.bmp", "picture", "picture.png.exe"])
    def test_unknown_suffix(self, tmp_path: Path, name: str) -> None:
        with pytest.raises(po.InvalidInput, match=r"\.png, \.svg, \.pdf"):
            save_figure(Figure(), tmp_path / name)
        assert not list(tmp_path.iterdir())

    def test_an_interrupted_write_leaves_the_old_picture(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = tmp_path / "picture.png"
        path.write_bytes(b"old")

        def interrupted(figure: Figure, file, **options: object) -> None:
            file.write(b"half a picture")
            raise KeyboardInterrupt

        monkeypatch.setattr(Figure, "savefig", interrupted)
        with pytest.raises(KeyboardInterrupt):
            save_figure(Figure(), path)
        assert path.read_bytes() == b"old"
        assert list(tmp_path.iterdir()) == [path]

    def test_a_folder_that_is_not_there(self, tmp_path: Path) -> None:
        with pytest.raises(po.InvalidInput, match="cannot write"):
            save_figure(Figure(), tmp_path / "nowhere" / "picture.png")


def test_works_without_a_display_and_without_pyplot(tmp_path: Path) -> None:
    # An interactive backend that cannot start here must never be asked for.
    stored = shape("fig10a").save(tmp_path / "shape.npz")
    code = (
        "import sys; from peel_opt import Equilibrium; from peel_opt.plots import save_figure\n"
        f"ax = Equilibrium.load({str(stored)!r}).plot()\n"
        f"save_figure(ax.figure, {str(tmp_path / 'picture.png')!r}, dpi=40)\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["MPLBACKEND"] = "TkAgg"
    subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        check=True,
        env=environment,
        cwd=Path(__file__).parents[2],
    )
    assert (tmp_path / "picture.png").stat().st_size > 1000
