"""Tiny runs in a process of their own, and the digest of their bits."""

from helpers.scripts import python

TINY = """
import hashlib, carom
digest = hashlib.sha256()
cases = [
    ("sectors", carom.Scene.random(12, 0.4, 2, seed=1), None),
    ("lists", carom.Scene.random(30, 0.5, 2, seed=1), 1.2),
    ("sectors", carom.Scene.random(3, box=(1.3, 5.0), seed=1), None),
]
for kind, scene, shell in cases:
    sim = carom.Simulation(scene, seed=2, tuning=carom.Tuning(neighbors=kind, shell=shell))
    sim.run(collisions=40)
    sim.run(time=2.0 * sim._state.epoch_length)
    frame = sim.frame()
    for array in (frame.positions, frame.velocities, frame.images):
        digest.update(array.tobytes())
    done = sim.statistics
    counts = (frame.time, done.collisions, done.transits, done.advancements, done.third_party_first)
    digest.update(repr(counts).encode())
print(digest.hexdigest())
"""


def run_tiny(source=None, **environment):
    """Run the tiny cases in a process of their own and return the digest of all bits."""
    # A checkout's own folder first, for the test of an edited copy.
    path = {"PYTHONPATH": str(source)} if source else {}
    return python("-W", "ignore::RuntimeWarning", "-c", TINY, timeout=300, **path, **environment).strip()
