#!/bin/sh
# `import dolfinx` of Debian 12 (python3-dolfinx-real 0.5.2) leaves Python's dlopen flags at RTLD_NOW | RTLD_GLOBAL: the line
# that would put them back is a comment. Every extension imported later shows its libraries' names to all others. With
# Debian's python3-rasterio next (GDAL, GEOS 3.11.1) and PyPI's shapely 2.1.2 after it (GEOS 3.13.1 of its own), shapely's
# C interface calls the system's GEOS: areas are right, but the text of every geometry, `str(Point(1, 2))`, ends in
# "WKT output dimension must be 2 or 3". In any other order, or without dolfinx, all is well. Cure: after the import
# sys.setdlopenflags(os.RTLD_NOW). Debian 13 (0.9.0) and the wheel of PyPI (0.11) leave the flags as they were.
# Needs Debian 12 with python3-dolfinx-real and python3-rasterio. Fails where the behaviour changes.
set -eu
/usr/bin/python3 -c "import dolfinx, rasterio" 2>/dev/null || { echo "skipped: needs Debian 12's dolfinx and rasterio"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
/usr/bin/python3 -m venv --system-site-packages "$folder/env"
"$folder/env/bin/pip" install --quiet shapely==2.1.2
cd "$folder"
text() {  # IMPORTS: what shapely says of a point after them
    "$folder/env/bin/python" -c "$1
import sys, shapely
try:
    print(sys.getdlopenflags(), shapely.Point(1, 2))
except shapely.errors.GEOSException as fault:
    print(sys.getdlopenflags(), fault)"
}
after=$(text "import dolfinx, rasterio")
before=$(text "import rasterio, dolfinx")
cured=$(text "import dolfinx, os, sys; sys.setdlopenflags(os.RTLD_NOW); import rasterio")
printf 'dolfinx, rasterio: %s\nrasterio, dolfinx: %s\ndolfinx, flags put back, rasterio: %s\n' "$after" "$before" "$cured"
case $after in "258 "*"WKT output dimension"*) ;; *) echo "changed: flags are put back, or GEOS is kept apart"; exit 1 ;; esac
test "$before" = "258 POINT (1 2)" && test "$cured" = "2 POINT (1 2)"
echo "as described: dolfinx leaves RTLD_GLOBAL set"
