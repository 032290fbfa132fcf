#!/bin/sh
# From the CAD files of the sample conveyor to pictures of it running: sh demo.sh FOLDER (default: demo).
# Needs beltconvert, partconvert and beltsim on the path. May be repeated: what an earlier run left is replaced.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:-demo}
mkdir -p "$folder"

echo "1. The belt: mid-surface mesh to bonded particles, stretched by 0.2 %"
beltconvert "$here/belt.stl" -o "$folder/belt.inp" --unit mm --elongation 100.2% --fibres rows --overwrite

echo "2. The rolls: cylinders out of the CAD assembly, beams and plates left out"
partconvert "$here/frame.sat" -o "$folder/parts.inp" --diameter-limit 300mm --name-by cad --overwrite

echo "3. The run: drive ramp, gravel feed, 3.8 s"
cp "$here/case.inp" "$folder/case.inp"
beltsim run "$folder/case.inp" -o "$folder/case.h5" --overwrite

echo "4. The pictures"
beltsim view "$folder/case.h5" -o "$folder/conveyor.png" --azimuth 35 --elevation 30 --overwrite
beltsim view "$folder/case.h5" -o "$folder/section.png" --section x=2.65 --azimuth 80 --elevation 15 --overwrite
beltsim view "$folder/case.h5" -o "$folder/sag.png" --color-by height --hide bulk --overwrite

echo "Done. The whole conveyor: $folder/conveyor.png; cut between two idler sets: $folder/section.png;"
echo "height of the belt without its load: $folder/sag.png; trajectory: $folder/case.h5"
