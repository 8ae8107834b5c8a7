"""Kernels of the axisymmetric burst: one-point quadrilaterals of the meridian, the slide line, the whole macro step.

Radial, circumferential and axial components stand as x, y and z, so that stress, strength, products and burn are
computed by the kernels of the hexahedra.
"""
