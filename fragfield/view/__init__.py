"""Looking at a run: pictures and interactive pages drawn off-screen, or a window where there is a display."""

from __future__ import annotations

from fragfield.view.offscreen import PictureUnavailableError, display_available, offscreen_fault
from fragfield.view.show import open_window, view_run

__all__ = ["PictureUnavailableError", "display_available", "offscreen_fault", "open_window", "view_run"]
