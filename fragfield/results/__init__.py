"""What a run has found: the summary as frozen dataclasses, read and written as summary.json."""
