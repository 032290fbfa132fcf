#!/bin/sh
# From the CAD files of the sample conveyor to pictures of it running: sh demo.sh FOLDER (default: demo).
# Needs beltconvert, partconvert and beltsim on the path. May be repeated: what an earlier run left is replaced.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:-demo}
mkdir -p "$folder"

echo "1. The belt: mid-surface mesh to bonded particles, stretched by 0.12 %"
beltconvert "$here/belt.stl" -o "$folder/belt.inp" --unit mm --elongation 100.12% --fibres rows --overwrite

echo "2. The rolls: cylinders out of the CAD assembly, beams and plates left out"
partconvert "$here/frame.sat" -o "$folder/parts.inp" --diameter-limit 300mm --name-by cad --overwrite

echo "3. The run: drive ramp, gravel feed, 3.8 s"
cp "$here/case.inp" "$folder/case.inp"
beltsim run "$folder/case.inp" -o "$folder/case.h5" --overwrite

echo "4. The pictures"
beltsim view "$folder/case.h5" -o "$folder/conveyor.png" --azimuth -50 --elevation 30 \
    --zoom -0.2,-0.4,0.4,5.9,0.4,1.1 --overwrite
beltsim view "$folder/case.h5" -o "$folder/trough.png" --section x=2.65 --azimuth 8 --elevation 10 \
    --zoom 2.3,-0.42,0.8,2.65,0.42,1.2 --overwrite
beltsim view "$folder/case.h5" -o "$folder/sag.png" --color-by height --range 0.97,1.03 --hide bulk \
    --azimuth -70 --elevation 40 --zoom 0.7,-0.45,0.8,5.4,0.45,1.1 --overwrite
beltsim view "$folder/case.h5" -o "$folder/conveyor.html" --overwrite

echo "Done, all in $folder:"
echo "  conveyor.png  the whole conveyor, loaded and running"
echo "  trough.png    cut half-way between two idler sets"
echo "  sag.png       height of the belt, its load hidden: it sags between the idler sets"
echo "  conveyor.html the conveyor to turn, zoom and cut in a browser"
echo "  case.h5       the trajectory, for beltsim view, VTK and h5py"
