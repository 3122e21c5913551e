#!/bin/sh
# Exports the parts (all, or those named: export.sh vice arm/wrist) to ../meshes and ../arm/meshes as binary STL.
# Needs Debian's openscad and python3.
set -eu
cd "$(dirname "$0")"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
[ $# -gt 0 ] || set -- $(ls *.scad arm/*.scad | grep -v '^lib' | sed 's/\.scad$//')
failed=0
for part in "$@"; do
  case $part in arm/*) target=../arm/meshes/${part#arm/}.stl ;; *) target=../meshes/$part.stl ;; esac
  openscad -q -o "$scratch/part.stl" "$part.scad" && python3 ascii_to_binary.py "$scratch/part.stl" "$target" || { failed=1; echo "failed: $part"; }
done
exit $failed
