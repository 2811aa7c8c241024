"""Export a take: BVH for Blender, TRC for OpenSim, CSV for a spreadsheet.

In Blender: File > Import > Motion Capture (.bvh), scale 0.01.

    python examples/05_export.py demo.mcap
"""

import sys
from pathlib import Path

import zenocap

path = Path(sys.argv[1])
take = zenocap.open_take(path)
for suffix in (".bvh", ".trc", ".csv"):
    written = take.export(path.with_suffix(suffix))
    print(f"{path.with_suffix(suffix)}: {written.rows} rows, {written.rate:g} frames/s, {written.unit}")
