#!/bin/sh
# A closed B-spline with uniform knots, as modellers write a closed curve into a DXF: ezdxf 1.4.5 draws it from the first
# knot to the last. The curve is defined between the knots that have `degree` knots before and behind them; outside of
# them the basis functions do not sum to one, and the points run towards the origin.
# Seen: ends 91 mm apart, one of them 21 mm from the origin, up to 36 mm off the curve that scipy evaluates by the same numbers,
# of an oval 60 mm by 24 mm. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet ezdxf==1.4.5 numpy==1.26.4 scipy==1.11.4
"$folder/env/bin/python" - <<'PYTHON'
import ezdxf
import numpy as np
from scipy.interpolate import BSpline

degree, turn = 3, 2.0 * np.pi * np.arange(8) / 8
ring = np.column_stack([60.0 + 30.0 * np.cos(turn), 40.0 + 12.0 * np.sin(turn), 0.0 * turn])
control = np.concatenate([ring, ring[:degree]])
knots = np.arange(len(control) + degree + 1.0)

spline = ezdxf.new().modelspace().add_spline(degree=degree)
spline.control_points, spline.knots, spline.closed = control, knots, True
drawn = np.array([tuple(point) for point in spline.flattening(0.01)])

curve = BSpline(knots, control, degree)(np.linspace(knots[degree], knots[-degree - 1], 4001))
off = max(float(np.linalg.norm(curve - point, axis=1).min()) for point in drawn)
gap, own = (float(np.linalg.norm(line[0] - line[-1])) for line in (drawn, curve))
print(f"ezdxf {ezdxf.__version__}: drawn from {drawn[0, :2].round(1)} to {drawn[-1, :2].round(1)}")
print(f"ends {gap:.1f} mm apart (of the curve: {own:.1f} mm), at most {off:.1f} mm off the curve")
assert own < 1e-9 and 85.0 < gap < 95.0 and 35.0 < off < 37.5, "the behaviour has changed"
PYTHON
