"""Strength of solids, one module a law; every module of this folder is known by its `MATERIAL`.

MATERIAL : `CasingMaterial`, or a class derived from it with constants of the law's own.
PARAMETERS : the law's columns of the table of solids, from `SOLID_OWN` on.
constants : those columns of a material.
strengths : shear and tensile strength (Pa) of a lane after plastic strains; numbers of one lane, compiled.
is_elastic, return_stress : whether a stress keeps within them; a trial stress returned to them, likewise.
without_strength : which cells have lost their shear strength, arrays.
"""

from __future__ import annotations

__all__: list[str] = []
