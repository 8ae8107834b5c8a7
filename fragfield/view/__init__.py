"""Looking at a run: pictures drawn off-screen, or pyvista's window; ParaView opens burst.xdmf and trajectories.xdmf."""

from __future__ import annotations

from fragfield.view.offscreen import PictureUnavailableError, offscreen_fault
from fragfield.view.show import view_run

__all__ = ["PictureUnavailableError", "offscreen_fault", "view_run"]
