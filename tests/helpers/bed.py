"""A run of a bed on a shaken floor in a wall, whole and interrupted, as plain Python (``plain.py``)."""

import json
import os
import signal
import sys

import carom
from carom.cli.results import show
from carom.scene_file.scene_file import SceneFile

SCENE = """
[scene]
n = 3
box = [3.0, 6.0]
walls = "y"
diameter = 0.8
mass = 2.0

[scene.motion]
type = "gravity"
g = [0.0, -1.5]

[scene.impact]
type = "loss"
restitution = 0.8
contact_time = 1e-2

[scene.obstacles.floor]
type = "plane"
normal = [0.0, 1.0]
offset = 0.0
impact = { restitution = 0.8, contact_time = 1e-2 }
shake = { amplitude = 0.2, period = 2.0 }

[run]
equilibration = 2
time = 20.0
frames = 1
write = []
pictures = false
"""

if __name__ == "__main__":
    plan = SceneFile.from_toml(SCENE)
    whole = carom.run(plan, f"{sys.argv[1]}/whole")
    asked = []

    def stop(fraction, stage):
        if stage == "Measuring" and fraction > 0.4 and not asked:
            asked.append(fraction)
            os.kill(os.getpid(), signal.SIGINT)

    try:
        carom.run(plan, f"{sys.argv[1]}/cut", progress=stop)
    except KeyboardInterrupt:
        cut = carom.resume(f"{sys.argv[1]}/cut")
    keys = ("layers", "obstacles", "kT", "thermal", "weight", "time")
    print(json.dumps([{key: result.summary[key] for key in keys} for result in (whole, cut)]))
    show(whole, whole.folder, as_json=False)
