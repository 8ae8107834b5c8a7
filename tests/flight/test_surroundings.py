"""Air, drag, wind: tabulated values, safe interpolation, messages."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from flight import Drag, InputError, StandardAtmosphere, Wind
from flight.drag import BUILT_IN
from flight.scene.air import EARTH_RADIUS
from flight.scene.tables import evaluate_pieces

# US Standard Atmosphere 1976, table I: geometric altitude (m), temperature (K), pressure (Pa), density (kg/m3), sound
# (m/s)
STANDARD = [
    (0.0, 288.150, 1.01325e5, 1.2250, 340.294),
    (1000.0, 281.651, 8.9876e4, 1.1117, 336.435),
    (5000.0, 255.676, 5.4048e4, 7.3643e-1, 320.545),
    (11_000.0, 216.774, 2.2700e4, 3.6480e-1, 295.154),
    (15_000.0, 216.650, 1.2112e4, 1.9475e-1, 295.069),
    (30_000.0, 226.509, 1.1970e3, 1.8410e-2, 301.709),
    (50_000.0, 270.650, 7.9779e1, 1.0269e-3, 329.799),
    (70_000.0, 219.585, 5.2209, 8.2829e-5, 297.061),
]


@pytest.mark.parametrize("row", STANDARD)
def test_standard_atmosphere_as_tabulated(row: tuple[float, ...]) -> None:
    height, temperature, pressure, density, sound = row
    air = StandardAtmosphere()
    assert air.temperature(height) == pytest.approx(temperature, abs=2e-3)
    assert air.pressure(height) == pytest.approx(pressure, rel=1e-4)
    assert air.density(height) == pytest.approx(density, rel=1e-4)
    assert air.sound_speed(height) == pytest.approx(sound, abs=1e-2)
    raised = StandardAtmosphere(site_altitude=height)
    assert raised.density(0.0) == pytest.approx(float(air.density(height)), rel=1e-14)


def test_kernel_table_follows_the_atmosphere() -> None:
    air = StandardAtmosphere(site_altitude=300.0)
    height = np.random.default_rng(0).uniform(-5000.0, 84_000.0, 20_000)
    table, altitude = air.table(), height + air.site_altitude
    geopotential = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
    entries = table.bottom + table.step * np.arange(len(table.pieces) + 1)
    density = evaluate_pieces(entries, table.pieces[:, :4], geopotential)
    sound = 1.0 / evaluate_pieces(entries, table.pieces[:, 4:], geopotential)
    assert np.abs(density / air.density(height) - 1.0).max() < 1e-9
    assert np.abs(sound / air.sound_speed(height) - 1.0).max() < 1e-10


@pytest.mark.parametrize("name", BUILT_IN)
def test_drag_tables_never_overshoot(name: str) -> None:
    drag = Drag.named(name)
    assert len(drag.source) > 20
    reference = PchipInterpolator(drag.mach, drag.coefficient)
    mach = np.linspace(drag.mach[0], drag.mach[-1], 5001)
    assert np.abs(drag.at(mach) - reference(mach)).max() < 1e-12
    for i in range(drag.mach.size - 1):
        inside = drag.at(np.linspace(drag.mach[i], drag.mach[i + 1], 50))
        low, high = sorted(drag.coefficient[i : i + 2])
        assert inside.min() >= low - 1e-15
        assert inside.max() <= high + 1e-15
    assert drag.at(drag.mach[-1] + 5.0) == drag.coefficient[-1]
    assert drag.at(drag.mach[0] - 5.0) == drag.coefficient[0]


def kernel_drag(drag: Drag, mach: np.ndarray) -> np.ndarray:
    rows, bins, per_mach = drag.table()
    index = bins[np.minimum((mach * per_mach).astype(int), bins.size - 1)]
    index = index + (mach >= rows[index, 5])
    offset = mach - rows[index, 0]
    return rows[index, 1] + offset * (rows[index, 2] + offset * (rows[index, 3] + offset * rows[index, 4]))


@pytest.mark.parametrize("seed", range(4))
def test_look_up_grid_finds_the_right_piece(seed: int) -> None:
    generator = np.random.default_rng(seed)
    mach = np.sort(generator.uniform(0.0, 6.0, 40))
    drag = Drag(mach, generator.uniform(0.5, 1.5, 40))
    places = np.concatenate([generator.uniform(0.0, 7.0, 20_000), mach, np.nextafter(mach, 0), np.nextafter(mach, 9)])
    assert np.abs(kernel_drag(drag, places) - drag.at(places)).max() < 1e-9
    built_in = Drag.named(list(BUILT_IN)[seed])
    places = np.concatenate([places, built_in.mach])
    assert np.abs(kernel_drag(built_in, places) - built_in.at(places)).max() < 1e-12


def test_own_drag_table(tmp_path) -> None:
    path = tmp_path / "own.csv"
    path.write_text("# measured by hand\nmach,cd\n0.0,1.0\n1.0,1.5\n2.0,1.2\n")
    drag = Drag.of(path)
    assert drag.at(1.0) == 1.5
    assert drag.source == "measured by hand"
    assert Drag.of(str(path)).at(0.0) == 1.0
    assert Drag.of(0.9).at([0.1, 5.0]).tolist() == [0.9, 0.9]
    assert Drag(np.array([0.0, 100.0]), np.array([100.0, 1.0])).at(100.0) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mach,cd\n0.5,1\n0.2,1\n", r"own\.csv, line 3: Mach 0\.2 follows 0\.5; needed: a table sorted by rising"),
        ("# a\n\nmach,cd\n# b\n0.5,1\n\n0.7,1\n0.2,1\n", r"own\.csv, line 8: Mach 0\.2 follows 0\.7; needed"),
        ("mach,cd\n0.5,1\n0.5,1\n", "line 3: Mach 0.5 follows 0.5"),
        ("mach,cd\n0.5,-1\n", "line 2: Mach 0.5, coefficient -1.0"),
        ("mach,cd\n0.5,nan\n", "line 2: .*needed: both finite"),
        (
            "mach,cd\n0.5,1\n101,1\n",
            "line 3: Mach 101, coefficient 1; needed: at most Mach 100 and a coefficient of 100",
        ),
        ("mach,cd\n0.5,101\n", "line 2: Mach 0.5, coefficient 101; needed: at most Mach 100 and a coefficient of 100"),
        ("speed,cd\n0.5,1\n", "columns are speed, cd; a drag table has mach, cd"),
    ],
)
def test_drag_messages(tmp_path, text: str, message: str) -> None:
    path = tmp_path / "own.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        Drag.read(path)


def test_wind_profile() -> None:
    wind = Wind.profile([0.0, 10.0, 50.0], [2.0, 5.0, 8.0], [90.0, 90.0, 0.0])
    assert wind.at([-5.0, 0.0, 10.0, 50.0, 90.0]) == pytest.approx(
        np.array([[0, 2], [0, 2], [0, 5], [8, 0], [8, 0]]), abs=1e-12
    )
    assert (np.diff(Wind.power_law(10.0, 0.0).at(np.linspace(0.0, 1200.0, 500))[:, 0]) >= 0.0).all()
    assert Wind.power_law(10.0, 0.0).at(10.0)[0] == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize("offset", [-35.0, 20.0])
def test_warmer_air_at_the_pressure_of_the_standard(offset: float) -> None:
    """Density p / (R T) and speed of sound sqrt(gamma R T) of the offset temperature; the kernels' table agrees."""
    air, standard = StandardAtmosphere(300.0, offset), StandardAtmosphere(300.0)
    height = np.array([0.0, 130.0, 4321.0, 12_000.0])
    temperature = standard.temperature(height)
    assert air.pressure(height) == pytest.approx(standard.pressure(height))
    assert air.density(height) == pytest.approx(standard.density(height) * temperature / (temperature + offset))
    assert air.sound_speed(height) == pytest.approx(standard.sound_speed(height) * np.sqrt(1.0 + offset / temperature))
    table = air.table()
    rise = 37.0
    piece = int((1000.0 - table.bottom) / table.step)
    density = np.polynomial.polynomial.polyval(rise, table.pieces[piece, :4])
    geopotential = 1000.0 + rise
    radius = 6_356_766.0
    assert density == pytest.approx(air.density(radius * geopotential / (radius - geopotential) - 300.0), rel=1e-8)
