#!/bin/sh
# Zones about a release of gas by riskfw 0.1.0 (explosion protection, zones by TRGS 721, ATEX groups):
# - `calculate_zone_extent`: the zone's volume is the release in kg/s over the lower limit, taken as m3 (times 5 for a jet).
#   One would expect the gas' volume and the airing in it. The radius is the same for 0.05 and for 5 m3/s of air, and the
#   molar mass in its own table is not used: hydrogen gets a zone 6.7 times smaller than petrol vapour at the same kg/s,
#   where it brings 7.4 times as much air to its lower limit. Without any airing and room volume the radius is 0.
# - `get_substance_properties`, and so `substance_name=`: a name that is not in its table of 13 is answered by the nearest
#   spelling, without a warning: acetylene is acetone (group IIA for IIC), ethylene ethyl acetate (IIA for IIB), pentane
#   methane (lower limit 4.4 % for 1.1 %), butane n-butanol (a liquid of flash point 29 degrees Celsius for a gas).
# Values to be: IEC 60079-20-1. Needs Python 3.11 or newer. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet riskfw==0.1.0
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from riskfw.substances import get_substance_properties
from riskfw.zones import calculate_zone_extent

RELEASE = 1e-3  # kg/s
volumes, air = {}, {}
for name in ("wasserstoff", "benzin"):
    radii = [calculate_zone_extent(RELEASE, airing, "jet", name).radius_m for airing in (0.05, 0.5, 5.0)]
    substance = get_substance_properties(name)
    volumes[name] = calculate_zone_extent(RELEASE, 0.5, "jet", name).volume_m3
    # 24.0 l/mol at 20 degrees Celsius
    air[name] = RELEASE / (1e-3 * substance.molar_mass_g_mol) * 0.0240 / (0.01 * substance.lower_explosion_limit)
    print(f"{name}, 1 g/s: radius {radii} m with 0.05, 0.5 and 5 m3/s of air; air to its lower limit {air[name]:.3f} m3/s")
    assert radii[0] == radii[1] == radii[2] > 0.0, "changed: airing counts"
print(f"hydrogen to petrol: volume of the zone {volumes['wasserstoff'] / volumes['benzin']:.2f}, air {air['wasserstoff'] / air['benzin']:.1f}")
assert volumes["wasserstoff"] / volumes["benzin"] < 0.2 and air["wasserstoff"] / air["benzin"] > 7.0, "changed: gas is a volume"
assert calculate_zone_extent(RELEASE, 0.0, "jet", "benzin").radius_m == 0.0, "changed: no airing has a radius"

# asked, answered, lower limit (%), group and flash point (Celsius, None for a gas) to be
for asked, answered, limit, group, flash in (
    ("acetylene", "Aceton", 2.3, "IIC", None),
    ("ethylene", "Ethylacetat", 2.3, "IIB", None),
    ("pentane", "Methan (Erdgas)", 1.1, "IIA", -40.0),
    ("butane", "n-Butanol", 1.4, "IIA", None),
):
    seen = get_substance_properties(asked)
    print(
        f"{asked} is {seen.name}: {seen.lower_explosion_limit} % for {limit} %, {seen.explosion_group} for {group},"
        f" flash point {seen.flash_point_c} for {flash}"
    )
    assert seen.name == answered, "changed: another substance or a refusal"
PYTHON
echo "as described: zones do not know the air, and acetylene is acetone"
