"""The flight itself: `fly`, integrators, the work of the threads, legs between impacts, contact between fragments."""
