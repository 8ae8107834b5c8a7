"""The contract that fills the flight: shapes, messages, files."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from flight import FlightWarning, Fragments, InputError, fly
from flight.fragments import shaped
from flight.shape import BOX_5_2_1_STEEL, Box, Lognormal, Mean
from tests.flight.clouds import cloud


@pytest.fixture
def some() -> Fragments:
    generator = np.random.default_rng(1)
    return Fragments(
        mass=generator.uniform(1e-4, 0.5, 50),
        position=generator.normal(size=(50, 3)),
        velocity=1e3 * generator.normal(size=(50, 3)),
        shape_factor=generator.uniform(2000.0, 5000.0, 50),
        round=generator.integers(0, 3, 50),
        segment=generator.integers(0, 9, 50),
    )


def same(one: Fragments, other: Fragments) -> bool:
    names = ("mass", "position", "velocity", "shape_factor", "round", "segment")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_single_values_stand_for_all() -> None:
    fragments = Fragments(0.01, (0, 0, 1), np.ones((4, 3)))
    assert len(fragments) == 4
    assert fragments.mass.shape == (4,)
    assert (fragments.shape_factor == 2600.0).all()
    assert fragments.round.dtype == np.int32
    assert len(Fragments(0.01, np.zeros((3, 3)), (1, 2, 3), round=[1, 2, 3])) == 3
    assert len(Fragments(0.01, (0, 0, 1), (1, 2, 3))) == 1
    assert len(Fragments([], (0, 0, 1), (1, 2, 3))) == 0


def test_sums(some: Fragments) -> None:
    assert some.total_mass == pytest.approx(some.mass.sum())
    assert some.momentum == pytest.approx((some.mass[:, None] * some.velocity).sum(axis=0))
    assert some.kinetic_energy == pytest.approx(0.5 * (some.mass * (some.velocity**2).sum(axis=1)).sum())
    joined = Fragments.concatenate([some.select(some.mass > 0.2), some.select(~(some.mass > 0.2))])
    assert joined.total_mass == pytest.approx(some.total_mass, rel=1e-14)
    assert len(some.select([])) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": [0.01, 0.0]}, r"mass of fragment 1 is 0\.0; needed: from 1e-15 to 1e\+06 kg"),
        ({"mass": [-1.0, 0.0]}, r"mass of fragment 0 is -1\.0, and 1 more"),
        ({"velocity": [[1, 2, 3], [np.nan, 0, 0]]}, r"velocity of fragment 1 is \[nan"),
        ({"position": [[0, 0, np.inf], [0, 0, 0]]}, r"position of fragment 0"),
        ({"shape_factor": 0.0}, r"shape_factor of fragment 0 is 0\.0, and 1 more.*kg/m3"),
        ({"position": np.zeros((2, 2))}, r"position has shape \(2, 2\), but 2 fragments need \(2, 3\)"),
        ({"mass": [0.1, 0.1, 0.1]}, r"velocity has shape \(2, 3\), but 3 fragments need \(3, 3\)"),
        ({"round": 0.5}, r"round must hold whole numbers"),
        ({"mass": "heavy"}, r"mass is the text .heavy.; needed: kilograms as numbers"),
    ],
)
def test_what_cannot_fly_is_refused(change: dict[str, object], message: str) -> None:
    good: dict[str, object] = {"mass": [0.01, 0.02], "position": (0.0, 0.0, 1.0), "velocity": np.ones((2, 3))}
    with pytest.raises(InputError, match=message):
        Fragments(**(good | change))  # type: ignore[arg-type]


def test_fragments_are_turned_and_moved_as_one(some: Fragments) -> None:
    turned = Fragments(0.1, (1.0, 0.0, 2.0), (5.0, 0.0, 1.0)).rotated((0, 0, 2), 90.0, about=(1.0, 1.0, 0.0))
    assert turned.position[0] == pytest.approx([2.0, 1.0, 2.0])
    assert turned.velocity[0] == pytest.approx([0.0, 5.0, 1.0], abs=1e-14)
    back = some.rotated((1, 2, -1), 37.0).translated((1.0, 2.0, 3.0)).translated((-1.0, -2.0, -3.0))
    back = back.rotated((-1, -2, 1), 37.0)
    assert back.position == pytest.approx(some.position, abs=1e-12)
    assert back.velocity == pytest.approx(some.velocity, abs=1e-9)
    assert same(some.translated((0.0, 0.0, 0.0)), some)
    with pytest.raises(InputError, match=r"axis is .*, needed: a direction"):
        some.rotated((0.0, 0.0, 0.0), 10.0)


def test_names_of_rounds_are_kept_where_they_agree(some: Fragments, tmp_path) -> None:
    named = Fragments([0.1, 0.2], (0.0, 0.0, 1.0), np.ones((2, 3)), round=[0, 2], round_names=("a", "b", "c"))
    first = Fragments(0.1, (0.0, 0.0, 1.0), (1.0, 2.0, 3.0), round_names=("a",))
    other = Fragments(0.1, (0.0, 0.0, 1.0), (1.0, 2.0, 3.0), round_names=("z",))
    assert Fragments.concatenate([named, first, some]).round_names == ("a", "b", "c")
    assert Fragments.concatenate([named, other]).round_names == ()
    assert named.select([1]).round_names == ("a", "b", "c")
    assert Fragments.read(named.write(tmp_path / "f.h5")).round_names == ("a", "b", "c")
    with pytest.raises(InputError, match="round 2 has no name; there are 2 names"):
        Fragments(0.1, (0.0, 0.0, 1.0), (1.0, 2.0, 3.0), round=2, round_names=("a", "b"))


def test_hdf5_round_trip(some: Fragments, tmp_path) -> None:
    path = some.write(tmp_path / "fragments.h5", {"case": "title = 1\n", "seed": "7"})
    assert same(Fragments.read(path), some)
    with h5py.File(path) as file:
        assert file.attrs["format"] == "fragfield fragments"
        assert file.attrs["format_version"] == 1
        assert file.attrs["case"] == "title = 1\n"
        assert file.attrs["seed"] == "7"


def test_csv_round_trip(some: Fragments, tmp_path) -> None:
    path = some.write(tmp_path / "fragments.csv")
    assert path.read_text().startswith("id,round,segment,mass_kg,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,speed_m_s")
    again = Fragments.read(path)
    assert again.mass == pytest.approx(some.mass, rel=1e-9)
    assert again.velocity == pytest.approx(some.velocity, rel=1e-9)
    assert np.array_equal(again.segment, some.segment)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass_kg,vx_m_s,vy_m_s\n1,2,3\n", "column vz_m_s missing"),
        ("mass,vx_m_s,vy_m_s,vz_m_s\n1,2,3,4\n", "unknown column 'mass'; did you mean 'mass_kg'"),
        ("mass_kg,vx_m_s,vy_m_s,vz_m_s\n1,2,3,4\n1,2,x,4\n", "line 3, column vy_m_s: 'x' is not a number"),
        ("mass_kg,vx_m_s,vy_m_s,vz_m_s\n1,2,3\n", "line 2 has 3 cells"),
        ("mass_kg,vx_m_s,vy_m_s,vz_m_s\n0,2,3,4\n", r"own\.csv: fragments: mass of fragment 0 is 0\.0"),
        ("mass_kg,vx_m_s,vy_m_s,vz_m_s\n", "no rows"),
        ("# nothing\n", "no table in it"),
    ],
)
def test_csv_messages(tmp_path, text: str, message: str) -> None:
    path = tmp_path / "own.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        Fragments.read(path)


def test_file_messages(some: Fragments, tmp_path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.h5: no such file"):
        Fragments.read(tmp_path / "nowhere.h5")
    whole = some.write(tmp_path / "whole.h5")
    cut = tmp_path / "cut.h5"
    cut.write_bytes(whole.read_bytes()[:3000])
    with pytest.raises(InputError, match=r"cut\.h5: cut off, or not an HDF5 file"):
        Fragments.read(cut)
    with h5py.File(whole, "a") as file:
        del file["fragments/velocity"]
    with pytest.raises(InputError, match=r"whole\.h5: /fragments/velocity missing"):
        Fragments.read(whole)
    with h5py.File(whole, "a") as file:
        file.attrs["format_version"] = 9
    with pytest.raises(InputError, match="format_version is 9, this program reads 1"):
        Fragments.read(whole)
    with h5py.File(whole, "a") as file:
        file.attrs["format"] = "something else"
    with pytest.raises(InputError, match="attribute format is 'something else', needed 'fragfield fragments'"):
        Fragments.read(whole)
    with pytest.raises(InputError, match="cannot be written"):
        some.write(tmp_path / "no" / "folder" / "fragments.h5")


# --- Presented areas: the mean of a tumbling box, the lognormal distribution, what the flight says of them


def test_tumbling_and_mean() -> None:
    fragments = cloud(5)
    assert shaped(fragments, Box()).shape_factor == pytest.approx(BOX_5_2_1_STEEL, rel=1e-3)
    assert shaped(fragments, Mean(2370.0)).shape_factor.tolist() == [2370.0] * 5


def test_lognormal_has_its_median_and_spread() -> None:
    k = np.log(shaped(cloud(200_000), Lognormal(0.2, median=2500.0), seed=9).shape_factor)
    assert np.median(k) == pytest.approx(np.log(2500.0), abs=4.0 * 1.2533 * 0.2 / 447.0)
    assert k.std() == pytest.approx(0.2, rel=4.0 / np.sqrt(2.0) / 447.0)
    assert np.mean(((k - k.mean()) / k.std()) ** 3) == pytest.approx(0.0, abs=4.0 * np.sqrt(6.0) / 447.0)


def test_shapes_belong_to_the_realisation_and_to_the_row_of_a_segment() -> None:
    whole = cloud(60)
    whole = Fragments(whole.mass, whole.position, whole.velocity, round=[0] * 30 + [1] * 30, segment=[0, 1] * 30)
    one, two = (shaped(whole, Lognormal(0.4), seed=5 + number).shape_factor for number in range(2))
    assert (one != two).all()
    shorter = whole.select(np.delete(np.arange(60), 28))  # the last of its round and segment
    np.testing.assert_array_equal(shaped(shorter, Lognormal(0.4), seed=5).shape_factor, np.delete(one, 28))
    assert len(np.unique(one)) == 60


def test_the_flight_takes_the_model_and_says_so() -> None:
    fragments = cloud(2000, seed=4)
    spread = Lognormal(0.3)
    drawn = fly(fragments, shape=spread, seed=6)
    assert drawn.summary["presented_area"]["model"] == "lognormal"
    assert drawn.summary["presented_area"]["spread"] == 0.3
    assert (drawn.landing == fly(shaped(fragments, spread, seed=6), seed=6).landing).all()
    assert (shaped(fragments, spread, seed=7).shape_factor != shaped(fragments, spread, seed=6).shape_factor).all()
    assert fly(fragments).summary["presented_area"] == {
        "model": "as given", "shape_factor_5_percent": 2600.0, "shape_factor_median": 2600.0,
        "shape_factor_95_percent": 2600.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Mean(0.0), r"shape: shape factor of the mean is 0\.0 kg/m3, needed: above zero"),
        (lambda: Lognormal(-0.1), "spread of the lognormal is -0.1, allowed: 0 to 2"),
        (lambda: Box((1.0, 0.0, 1.0)), "ratios of the box are"),
        (lambda: fly(cloud(1), shape="box"), "shape is 'box', allowed: flight.shape.Mean"),  # type: ignore[arg-type]
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_masses_that_may_be_grams_are_named() -> None:
    with pytest.warns(FlightWarning, match="the lightest of 2 weighs 10 kg; masses are in kilograms"):
        fly(Fragments([10.0, 20.0], (0.0, 0.0, 1.0), (10.0, 0.0, 5.0)))
