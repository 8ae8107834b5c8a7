"""Pictures of a run by pyvista; ParaView opens burst.xdmf and trajectories.xdmf for all else."""

from __future__ import annotations

from fragfield.view.pictures import burst_sections, picture_fault, view_run

__all__ = ["burst_sections", "picture_fault", "view_run"]
