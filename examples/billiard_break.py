"""The break of a billiard game: one fast disk hits a rack of disks at rest; made into a moving picture.

    python examples/billiard_break.py [--smoke] [--out billiard_break.gif]

The picture on the first page of the documentation is made by this script.
"""

# %% Arguments: --smoke makes a short film, --out says where it goes.
import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw  # comes with matplotlib

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a few frames")
parser.add_argument("--out", type=Path, default=Path("billiard_break.gif"), help="file of the film")
args = parser.parse_args()
frames = 6 if args.smoke else 90

# %% The table: four cushions, a rack of 78 disks nearly in contact, and one disk that moves.
# Neighbors in the rack have small random gaps. At exact contact the outcome of a break is not defined.
BOX, SIGMA, ROWS = (32.0, 18.0), 1.0, 12
random = np.random.default_rng(4)
rack = [
    (13.0 + 0.5 * np.sqrt(3.0) * 1.01 * row, 9.0 + 1.01 * (k - 0.5 * row))
    for row in range(ROWS)
    for k in range(row + 1)
]
positions = np.vstack([[4.0, 9.3], np.array(rack) + random.uniform(-0.004, 0.004, (len(rack), 2))])
velocities = np.zeros_like(positions)
velocities[0] = [12.0, 0.0]
scene = carom.Scene(positions, box=BOX, diameter=SIGMA, velocities=velocities, walls=True)

# %% The run: from collision to collision; frames are taken in between, at equal times.
sim = carom.Simulation(scene, seed=1)
film = list(sim.sample(every=0.12, count=frames))
hits = sum(wall.hits for wall in sim.obstacles)
print(f"{sim.collisions} collisions between {scene.n} disks and {hits} with the cushions")
print(f"energy drift {sim.statistics.energy_drift:.1e}")

# %% The film: color is speed, from pale (at rest) to red.
SCALE, FINE = 15, 4  # pixels a diameter, and how much finer a frame is drawn before it is scaled down
SLOW, FAST = np.array([226, 232, 240]), np.array([220, 60, 40])


def drawn(frame: carom.Frame) -> Image.Image:
    """Draw the disks of a frame as shaded circles."""
    pixel = SCALE * FINE
    picture = Image.new("RGB", (int(BOX[0] * pixel), int(BOX[1] * pixel)), (18, 58, 66))
    draw = ImageDraw.Draw(picture)
    speeds = np.linalg.norm(frame.velocities, axis=1)
    for (x, y), speed in zip(frame.positions, speeds, strict=True):
        color = SLOW + (FAST - SLOW) * min(1.0, speed / 3.0) ** 0.6
        x, y, radius = x * pixel, (BOX[1] - y) * pixel, 0.48 * SIGMA * pixel
        draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=tuple((0.72 * color).astype(int)))
        x, y, radius = x - 0.06 * pixel, y - 0.06 * pixel, 0.39 * SIGMA * pixel
        draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=tuple(color.astype(int)))
    return picture.resize((int(BOX[0] * SCALE), int(BOX[1] * SCALE)), Image.Resampling.LANCZOS)


pictures = [drawn(frame) for frame in film]
palette = pictures[-1].quantize(20)  # one palette for all frames: no flicker, and a small file
pictures = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
path = args.out if args.out.suffix else args.out.with_suffix(".gif")
path.parent.mkdir(parents=True, exist_ok=True)
pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=60, loop=0, optimize=True)
print(path)
