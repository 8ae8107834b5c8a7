#!/bin/sh
# Confidence interval of a rate when no event was seen, by the mid-p way of statsmodels 0.15.0,
# `confint_poisson(0, exposure, method="midp-c")`: both ends are the upper limit, 2.996 over the exposure, without a warning.
# One would expect 0 to 2.996, which holds the estimate, 0. So no hit in 30 trials reads as a rate proved to be 0.0999 and
# no less, and the interval has no width. From one event on the limits are those of the mid-p equation, and the other ways
# ("exact-c", "jeff", "score") begin at or near 0. Tolerance limits by that way then leave out 0. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet statsmodels==0.15.0 scipy==1.16.3 numpy==2.3.5 pandas==2.3.3
cd "$folder"
"$folder/env/bin/python" -W error - <<'PYTHON'
import math

from scipy.optimize import brentq
from scipy.stats import poisson
from statsmodels.stats.rates import confint_poisson, tolerance_int_poisson

ALPHA, EXPOSURE = 0.05, 30.0


def mid_p(count):
    """Limits of a Poisson mean at which half the probability of the count and all beyond make alpha/2."""

    def below(mean):
        return poisson.cdf(count, mean) - 0.5 * poisson.pmf(count, mean) - 0.5 * ALPHA

    def above(mean):
        return poisson.sf(count, mean) + 0.5 * poisson.pmf(count, mean) - 0.5 * ALPHA

    return brentq(above, 1e-9, count + 1.0) if count else 0.0, brentq(below, count + 1e-9, count + 20.0)


assert abs(mid_p(0)[1] - math.log(1.0 / ALPHA)) < 1e-9  # half of exp(-mean) is alpha / 2
for count in (0, 1, 3, 10):
    low, high = confint_poisson(count, EXPOSURE, method="midp-c", alpha=ALPHA)
    true = [limit / EXPOSURE for limit in mid_p(count)]
    print(f"{count} events in {EXPOSURE:.0f}: {low:.5f} to {high:.5f}, to be {true[0]:.5f} to {true[1]:.5f}")
    assert abs(high / true[1] - 1.0) < 1e-4
    if count:
        assert abs(low / true[0] - 1.0) < 1e-4
    else:
        assert abs(low / high - 1.0) < 1e-4, "changed: the interval of no events begins at 0"
for method in ("exact-c", "jeff", "score"):
    low, high = confint_poisson(0, EXPOSURE, method=method, alpha=ALPHA)
    print(f"no event, {method}: {low:.5f} to {high:.5f}")
    assert low < 1e-3
# counts of a further 300 trials that would pass for in keeping with it
low, high = (float(count) for count in tolerance_int_poisson(0, EXPOSURE, 0.95, 300.0, method="midp-c", alpha=ALPHA))
print(f"events to be looked for in 300 more trials: {low:.0f} to {high:.0f}, to be 0 to {high:.0f}")
assert low > 10.0, "changed: none is among them"
PYTHON
echo "as described: without an event the lower limit is the upper one"
