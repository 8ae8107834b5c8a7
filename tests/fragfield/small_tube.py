"""A small tube as a case made in Python: a burst of a second, with a witness ring."""

from __future__ import annotations

import fragfield

__all__ = ["BURST", "TUBE", "tube_case"]
TUBE = {"name": "tube", "profile": "tube", "explosive": "tnt", "casing": "steel_paper"}
BURST = {"cell_size": "14 mm", "end_time": "12 us", "energy_tolerance": 1.0, "output": {"interval": "4 us"}}


def tube_case():
    return fragfield.Case(
        title="A tube", burst=BURST, round=[TUBE], witness=[{"name": "ring", "radius": "7.62 m"}],
        break_up={"realisations": 8}, hazard={"tolerance": 0.5, "max_realisations": 8},
    )  # fmt: skip
