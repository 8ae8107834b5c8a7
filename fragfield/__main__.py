"""`python -m fragfield` is the command `fragfield`."""

from __future__ import annotations

import sys

if __name__ == "__main__":
    # Python looks for modules in the working folder first: none of them is run, unless the program lies there.
    if not sys.flags.safe_path and not __file__.startswith(f"{sys.path[0]}/"):
        del sys.path[0]
    from fragfield.cli import main

    main()
