"""Rate of hoop strain read off the burst's radii: closed forms, what is missing, and the law that takes it."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUp, BreakUpSettings, InputError, Snapshot
from transition.law.expansion import HALF_CHORD, Expansion
from transition.law.mean_mass import mott_1947, mott_linfoot, thinned

TIME = np.arange(0.0, 120.5e-6, 1e-6)
SMALL = Tube(radial_cells=1, around=8, axial=10)


def expansion(growth, initial=(0.07, 0.0775, 0.0775), station=(0.05, 0.15, 0.25)):
    """Radii R0 (1 + growth(t)) in three bins."""
    return Expansion(TIME, np.array(station), np.outer(1.0 + growth(TIME), initial))


def test_rate_of_exponential_growth_is_its_exponent():
    """R = R0 exp(kt): the rate is k at every strain. Linear reading between times errs by (k dt)^2 at most."""
    k = 8000.0
    found = expansion(lambda t: np.expm1(k * t))
    for strain in (0.2, 0.5, 0.75):
        state = found.at_strain(0.0, 0.3, strain)
        assert state.rate == pytest.approx(k, rel=2e-4)
        assert state.time == pytest.approx(np.log1p(strain) / k, rel=1e-4)


def test_rate_at_constant_speed_falls_with_the_radius():
    """R = R0 + v t: rate v/R; the chord of half width h errs by (h/(1 + e))^2 / 3."""
    speed, start = 1000.0, 0.0775
    state = expansion(lambda t: speed * t / start).at_strain(0.1, 0.3, 0.75)
    assert state.radius == pytest.approx(1.75 * start, rel=1e-12)
    error = (HALF_CHORD / 1.75) ** 2 / 3.0
    assert state.rate == pytest.approx(speed / state.radius * (1.0 + error), rel=1e-6)


def test_part_of_the_casing_takes_its_own_stations():
    found = Expansion(TIME, np.array([0.1, 0.2]), np.column_stack([0.05 + 500.0 * TIME, 0.05 + 1000.0 * TIME]))
    slow, fast = found.at_strain(0.0, 0.15, 0.5), found.at_strain(0.15, 0.3, 0.5)
    assert fast.rate == pytest.approx(2.0 * slow.rate, rel=1e-9)
    assert found.at_strain(0.11, 0.12, 0.5) == slow  # shorter than a bin: the nearest one


@pytest.mark.parametrize(("strain", "why"), [(1.3, "the burst ended before"), (0.0, "no strain"), (-0.1, "no strain")])
def test_strain_that_was_not_reached_gives_nothing(strain, why):
    assert expansion(lambda t: 0.9 * t / TIME[-1]).at_strain(0.0, 0.3, strain) is None, why


def test_bins_without_nodes_are_left_out():
    radii = np.column_stack([np.full_like(TIME, np.nan), 0.05 + 1000.0 * TIME])
    found = Expansion(TIME, np.array([0.1, 0.2]), radii)
    assert found.at_strain(0.0, 0.3, 0.5).radius == pytest.approx(0.075)
    assert found.at_strain(0.0, 0.15, 0.5) is None


@pytest.mark.parametrize(
    ("time", "station", "radius", "message"),
    [
        (TIME, [0.1, 0.2], np.ones((3, 2)), r"outer_radius has shape \(3, 2\), needed \(121, 2\)"),
        (TIME[::-1], [0.1, 0.2], np.ones((121, 2)), "expansion: time does not rise"),
        (TIME, [0.2, 0.1], np.ones((121, 2)), "expansion: station does not rise"),
    ],
)
def test_arrays_that_cannot_be_read_are_refused(time, station, radius, message):
    with pytest.raises(InputError, match=message):
        Expansion(time, np.array(station), radius)


def with_radii(path, speed):
    """A tube's snapshot whose casing expands at a constant speed (m/s)."""
    SMALL.write(path)
    station = np.linspace(0.005, 0.295, 30)
    with h5py.File(path, "a") as file:
        file["rounds/0/expansion/time"], file["rounds/0/expansion/station"] = TIME, station
        file["rounds/0/expansion/outer_radius"] = np.repeat((SMALL.outer + speed * TIME)[:, None], 30, axis=1)
    return Snapshot.read(path)


def test_burst_rate_of_the_final_speed_differs_from_eq_21_by_the_wall_alone(tmp_path):
    """With dR/dt = v0 all the way the rate is v0/a, and only the wall of plane strain differs from Eq. 22's."""
    by_speed = BreakUp(SMALL.read(tmp_path / "a.h5"), BreakUpSettings()).laws[1]
    snapshot = with_radii(tmp_path / "b.h5", by_speed.v0)
    law = BreakUp(snapshot, BreakUpSettings(strain_rate="burst")).laws[1]
    assert (by_speed.rate_source, law.rate_source) == ("speed", "burst")
    assert law.rate == pytest.approx(by_speed.rate, rel=4e-4)
    assert law.wall == thinned(0.0775, 0.018, 0.0775 * 1.75)
    assert law.law.mean / by_speed.law.mean == pytest.approx(law.wall / by_speed.wall, rel=6e-4)
    assert law.radius == by_speed.radius


def test_twice_the_rate_breaks_finer_by_the_power_of_the_law(tmp_path):
    slow, fast = (with_radii(tmp_path / f"{v}.h5", v) for v in (800.0, 1600.0))
    for law, power in (("mott", 4.0 / 3.0), ("mott_1947", 2.0)):
        settings = BreakUpSettings(mean_mass=law, strain_rate="burst")
        ratio = BreakUp(slow, settings).laws[1].law.mean / BreakUp(fast, settings).laws[1].law.mean
        assert ratio == pytest.approx(2.0**power, rel=1e-3), law


def test_law_of_1947_reaches_the_break_up(tmp_path):
    law = BreakUp(SMALL.read(tmp_path / "a.h5"), BreakUpSettings(mean_mass="mott_1947")).laws[1]
    assert law.law.mean == pytest.approx(mott_1947(7850.0, 804e6, 67.0, 0.018 / 1.75, law.v0 / law.radius), rel=1e-12)
    assert law.rate == law.v0 / law.radius


def test_ends_and_casings_that_stop_short_keep_the_rate_of_their_speed(tmp_path):
    snapshot = with_radii(tmp_path / "s.h5", 400.0)  # strain 0.62 at the end
    laws = BreakUp(snapshot, BreakUpSettings(strain_rate="burst")).laws
    plain = BreakUp(snapshot, BreakUpSettings()).laws
    assert [law.rate_source for law in laws] == ["speed"] * 4
    assert [law.law.mean for law in laws] == [law.law.mean for law in plain]
    laws = BreakUp(snapshot, BreakUpSettings(strain_rate="burst", critical_strain=0.5)).laws
    assert [law.rate_source for law in laws] == ["speed", "burst", "burst", "speed"]  # nose and base are ends


def test_rate_at_the_leakage_radius(tmp_path):
    tube = Tube(radial_cells=1, around=8, axial=10, rupture=(0.11, 0.013))
    tube.write(tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5", "a") as file:
        file["rounds/0/expansion/time"], file["rounds/0/expansion/station"] = TIME, [0.15]
        file["rounds/0/expansion/outer_radius"] = (0.0775 + 900.0 * TIME)[:, None]
    settings = BreakUpSettings(strain_rate="burst", rupture="burst")
    law = BreakUp(Snapshot.read(tmp_path / "s.h5"), settings).laws[1]
    assert (law.radius, law.rupture) == (pytest.approx(0.11), "burst")
    assert law.rate == pytest.approx(900.0 / 0.11, rel=1e-3)


def test_snapshot_of_an_earlier_version_is_read_and_refused_where_radii_are_needed(tmp_path):
    snapshot = SMALL.read(tmp_path / "s.h5")
    assert snapshot.rounds[0].expansion is None
    with pytest.raises(
        InputError,
        match=r"round 'round 0', segment 'nose 0': the snapshot holds no radii over time, .*strain_rate = 'speed'",
    ):
        BreakUp(snapshot, BreakUpSettings(strain_rate="burst"))


def test_radii_at_fault_are_named_with_their_file(tmp_path):
    SMALL.write(tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5", "a") as file:
        file["rounds/0/expansion/time"], file["rounds/0/expansion/station"] = TIME, [0.1, 0.2]
        file["rounds/0/expansion/outer_radius"] = np.ones((5, 2))
    with pytest.raises(InputError, match=r"s.h5: rounds/0: expansion: outer_radius has shape \(5, 2\)"):
        Snapshot.read(tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5", "a") as file:
        del file["rounds/0/expansion/outer_radius"]
    with pytest.raises(InputError, match=r"s.h5: rounds/0: expansion/outer_radius is missing"):
        Snapshot.read(tmp_path / "s.h5")


def test_linfoot_with_rate_is_the_same_formula():
    assert mott_linfoot(4.0, 7850.0, 0.135, 14.7e4, 0.01, 0.135 * 8000.0) == pytest.approx(
        4.0 * 7850.0 ** (1 / 3) * 14.7e4 ** (2 / 3) * 0.01 / 8000.0 ** (4 / 3), rel=1e-12
    )


@pytest.mark.filterwarnings("error")
def test_without_times_stations_or_nodes_there_is_no_rupture():
    """Nor a warning: nothing is averaged there."""
    assert Expansion(np.zeros(0), np.array([0.1]), np.zeros((0, 1))).at_strain(0.0, 0.3, 0.5) is None
    assert Expansion(TIME, np.zeros(0), np.zeros((TIME.size, 0))).at_strain(0.0, 0.3, 0.5) is None
    assert Expansion(TIME, np.array([0.1]), np.full((TIME.size, 1), np.nan)).at_strain(0.0, 0.3, 0.5) is None
