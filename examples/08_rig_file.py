"""Write and check a rig file for two simulated cameras, and track one posture.

python examples/08_rig_file.py FOLDER
"""

import shutil
import sys
from pathlib import Path

import zenocap

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
demo = zenocap.demo_rig()
shutil.copy(next(path for path in demo.files if "calibration" in path.name), folder / "calibration.toml")
viewers = "".join(
    f"""
[[viewer]]
id = "{id}"
camera = "cam0{id}"
source = "actor:raise-both-arms?seed=7"
background = "first:30"
size = [160, 120]
fps = 15
"""
    for id in (1, 2)
)
(folder / "rig.toml").write_text(f'name = "arms"\ncalibration = "calibration.toml"\n{viewers}')
rig = zenocap.Rig.load(folder / "rig.toml")
print(f"rig {rig.name}: method {rig.method}, viewers {', '.join(viewer.id for viewer in rig.viewers)}")
take = zenocap.track(rig, folder / "arms.mcap")
print(f"{take.path}: {take.frame_count} poses")
