"""Looking at a run: pictures and interactive pages drawn off-screen, or a window where there is a display."""

from __future__ import annotations

from fragfield.view.interactive import write_interactive_views
from fragfield.view.offscreen import PictureUnavailableError, display_available, offscreen_fault
from fragfield.view.pictures import picture_of_burst, picture_of_fragments
from fragfield.view.show import open_window, view_run, write_pictures

__all__ = [
    "PictureUnavailableError",
    "display_available",
    "offscreen_fault",
    "open_window",
    "picture_of_burst",
    "picture_of_fragments",
    "view_run",
    "write_interactive_views",
    "write_pictures",
]
