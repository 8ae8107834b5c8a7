"""Masses of the drawing against those of the contours: what is within 1 % passes, and the likely mistake is named."""

from __future__ import annotations

import copy

import pytest

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.geometry.files import PROFILES
from fragfield.case.checks.expected_masses import likely_cause
from fragfield.case.conversion.rounds import masses_of
from fragfield.case.load import case_from_document, read_document
from fragfield.errors import InputError
from fragfield.studies.uncertainty.plan import plan_samples
from tests.fragfield.short_run import ROOT

M107 = {"casing": 34.53, "charge": 6.863}  # kg, of the drawing
TABLES = read_document(PROFILES / "m107.toml")


def _case(profile: object = "m107", expected: dict | None = None, **more):
    entry = {"name": "shell", "profile": profile, "explosive": "tnt", "casing": "steel_m107", **more}
    if expected is not None:
        entry["expected"] = expected
    document = {"burst": {"cell_size": "8 mm"}, "round": [entry]}
    return case_from_document(document, source="case.toml", folder=ROOT)


def _masses(factor: float = 1.0) -> dict[str, str]:
    return {name: f"{factor * mass} kg" for name, mass in M107.items()}


def _radii_times(factor: float) -> dict:
    """The contours with every radius times a factor."""
    tables = copy.deepcopy(TABLES)
    for contour in ("outer", "cavity"):
        tables[contour]["points"] = [[x, factor * r] for x, r in tables[contour]["points"]]
        tables[contour].pop("arcs", None)
    if "fuze" in tables:
        tables["fuze"]["mass"] *= factor**2
    return tables


def test_the_masses_of_the_drawing_pass():
    case = _case(expected=_masses())
    assert case.round[0].expected.casing == pytest.approx(34.53)
    found = masses_of(case.round[0])
    assert (found.casing, found.charge) == pytest.approx((34.53, 6.863), rel=1e-3)
    assert sum(one.casing for one in found.segments) == pytest.approx(found.casing)


@pytest.mark.parametrize(("factor", "refused"), [(0.991, False), (1.009, False), (0.988, True), (1.012, True)])
def test_one_percent_is_allowed(factor, refused):
    if not refused:
        _case(expected=_masses(factor))
        return
    with pytest.raises(
        InputError, match=r"round\[1\]\.expected\.casing: found 3\d\.\d\d kg.* % (more|less); allowed: with"
    ):
        _case(expected=_masses(factor))


def test_diameters_given_for_radii_are_named():
    """Areas and volumes are those of twice the radius: four times the mass, of casing and charge alike."""
    base = masses_of(_case(_radii_times(1.0)).round[0])
    doubled = masses_of(_case(_radii_times(2.0)).round[0])
    assert doubled.casing == pytest.approx(4.0 * base.casing)
    assert doubled.charge == pytest.approx(4.0 * base.charge)
    expected = {"casing": f"{base.casing} kg", "charge": f"{base.charge} kg"}
    with pytest.raises(InputError) as found:
        _case(_radii_times(2.0), expected)
    text = str(found.value)
    assert text.startswith("case.toml: 2 faults")
    assert text.count("4 times as much (were diameters given for radii?)") == 2


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (4.1, "diameters given for radii"), (0.25, "radii halved"), (8.2, "twice too long"), (1.0, ""), (2.0, ""),
        (5.5, ""), (25.4**3, "read as inches"), (25.4**-3, "inches read as"), (0.4536, "pounds"), (1e9, "as metres"),
    ],
)  # fmt: skip
def test_causes(factor, words):
    found = likely_cause(factor)
    assert words in found
    assert bool(found) == bool(words)


def test_no_mass_is_refused_and_rounds_alike_are_reported_once():
    with pytest.raises(InputError, match=r"round\[1\]\.expected: found no mass; allowed: casing, charge or both"):
        _case(expected={})
    pair = {
        "burst": {"cell_size": "8 mm"},
        "round": [
            {"name": name, "profile": "m107", "explosive": "tnt", "casing": "steel_m107",
             "position": [f"{x} m", "0 m", "0 m"], "expected": {"casing": "8.63 kg"}}
            for name, x in (("a", 0), ("b", 1))
        ],
    }  # fmt: skip
    with pytest.raises(InputError) as found:
        case_from_document(pair, source="case.toml", folder=ROOT)
    assert str(found.value).count("expected.casing") == 1


def test_a_study_of_uncertainty_varies_densities_and_expects_no_mass():
    entry = {"name": "a", "profile": "m107", "explosive": "tnt", "casing": "steel_m107", "expected": _masses()}
    case = case_from_document({"burst": {"cell_size": "8 mm"}, "round": [entry]}, source="case.toml", folder=ROOT)
    assert "expected" not in plan_samples(case).document(0)["round"][0]


@pytest.mark.parametrize(
    ("mass", "refused"), [(0.001, True), (0.0075, False), (0.55, False), (0.6, True), (90.0, True)]
)
def test_a_fuze_has_a_density_that_matter_has(mass, refused, tmp_path):
    """The well of the 105 mm M1 holds 62.8 cm3: 6.28 g at 0.1 g/cm3, 0.565 kg at 9 g/cm3."""
    profile = load_profile("m1_105")
    assert profile.fuze_volume == pytest.approx(62.83e-6, rel=1e-3)
    assert 100.0 < profile.fuze_density < 9000.0
    text = (PROFILES / "m1_105.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace("mass = 0.192", f"mass = {mass}"))
    document = {
        "burst": {"cell_size": "8 mm"},
        "round": [{"name": "a", "profile": "mine.toml", "explosive": "tnt", "casing": "steel_m107"}],
    }
    if not refused:
        case_from_document(document, source="case.toml", folder=tmp_path)
        return
    words = r"round\[1\]\.profile.*\[fuze\]: mass = .* allowed: 0.1 to 9 g/cm3, 0.00628 to 0.565 kg"
    with pytest.raises(InputError, match=words):
        case_from_document(document, source="case.toml", folder=tmp_path)
