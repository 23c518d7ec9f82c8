"""Sheared particles in the laboratory frame, from collision to collision: all pairs, and all their images."""

import itertools
import math

import numpy as np


class Naive:
    """Equal hard spheres, which may grow, under Lees and Edwards's boundary condition.

    The image that is k edges up along axis 1 stands ``k L_1 strain`` further along axis 0, and moves by ``k
    L_1 rate`` faster.
    """

    def __init__(self, places, peculiar, box, rate, restitution=1.0, growth=0.0):
        self.x, self.v = np.array(places, float), np.array(peculiar, float)
        self.v[:, 0] += rate * self.x[:, 1]
        self.box, self.rate, self.restitution = np.array(box, float), rate, restitution
        self.time = self.strain = 0.0
        self.diameter, self.growth = 1.0, growth

    def shift(self, image):
        move = np.array(image) * self.box
        move[0] += image[1] * self.box[1] * self.strain
        speed = np.zeros(len(self.box))
        speed[0] = image[1] * self.box[1] * self.rate
        return move, speed

    def images(self, dx, dv, duration):
        """All images that come within a diameter along every axis."""
        near = self.diameter + self.growth * duration
        spans = []
        for axis in range(1, len(self.box)):
            ends = np.array([dx[axis], dx[axis] + dv[axis] * duration])
            edge = self.box[axis]
            low, high = (-near - ends.max()) / edge, (near - ends.min()) / edge
            spans.append(range(math.ceil(low), math.floor(high) + 1))
        for others in itertools.product(*spans):
            start = dx[0] + others[0] * self.box[1] * self.strain
            end = start + (dv[0] + others[0] * self.box[1] * self.rate) * duration
            low, high = (-near - max(start, end)) / self.box[0], (near - min(start, end)) / self.box[0]
            for first in range(math.ceil(low), math.floor(high) + 1):
                yield (first, *others)

    def next(self, limit):
        best = None
        for i, j in itertools.combinations(range(len(self.x)), 2):
            dx, dv = self.x[j] - self.x[i], self.v[j] - self.v[i]
            for image in self.images(dx, dv, limit if best is None else best[0]):
                move, speed = self.shift(image)
                r, w = dx + move, dv + speed
                contact = self.diameter
                rv, vv, gap = r @ w - contact * self.growth, w @ w - self.growth**2, r @ r - contact**2
                root = rv * rv - vv * gap
                if (rv < 0.0 or vv < 0.0) and root >= 0.0:
                    t = max(gap / (math.sqrt(root) - rv), 0.0)
                    if t <= limit and (best is None or (t, i, j) < best[:3]):
                        best = (t, i, j, image)
        return best

    def run(self, collisions):
        while collisions:
            found = self.next(1.0)
            t = 1.0 if found is None else found[0]
            self.x += self.v * t
            self.time += t
            self.strain += self.rate * t
            self.diameter += self.growth * t
            if found is not None:
                collisions -= 1
                self.collide(*found[1:])
            self.wrap()  # after the collision, whose image is that of before

    def collide(self, i, j, image):
        move, speed = self.shift(image)
        r, w = self.x[j] + move - self.x[i], self.v[j] + speed - self.v[i]
        approach = r @ w - math.sqrt(r @ r) * self.growth  # of the surfaces
        change = 0.5 * (1.0 + self.restitution) * approach / (r @ r) * r
        self.v[i] += change
        self.v[j] -= change

    def wrap(self):
        for x, v in zip(self.x, self.v, strict=True):
            turns = math.floor(x[1] / self.box[1])
            x[1] -= turns * self.box[1]
            x[0] -= turns * self.box[1] * self.strain
            v[0] -= turns * self.box[1] * self.rate
            x -= np.floor(x / self.box) * self.box

    @property
    def peculiar(self):
        return self.v - self.rate * np.outer(self.x[:, 1], np.eye(len(self.box))[0])


def growing_as_all_pairs():
    """Compare growing disks in a wide and in a narrow box with the naive ones; return the steps compared."""
    import carom
    from carom.models import Shear

    steps = 0
    for box, n in ((7.0, 6.0), 16), ((12.0, 11.0), 40):
        rng, side = np.random.default_rng(5), int(np.ceil(n**0.5))
        places = (np.argwhere(np.ones((side, side)))[:n] + 0.5) * np.array(box) / side
        peculiar = rng.normal(size=places.shape)
        peculiar -= peculiar.mean(axis=0)
        naive = Naive(places, peculiar, box, 0.7, growth=0.05)
        scene = carom.Scene(places, box, velocities=peculiar, motion=Shear(0.7))
        sim = carom.Simulation(scene, growth=0.05)
        for _ in range(6):
            naive.run(8)
            sim.run(collisions=8)
            # Chaos: an error grows about tenfold with a collision of each, of which there are at most six.
            assert math.isclose(sim.time, naive.time, rel_tol=1e-8)
            assert np.abs(sim.frame().velocities - naive.peculiar).max() < 1e-6
            assert math.isclose(sim.frame().diameters[0], naive.diameter, rel_tol=1e-8)
            steps += 1
        assert sim.statistics.worst_overlap < 1e-12
        assert sim.time * 0.7 > 0.5
    return steps


if __name__ == "__main__":
    print(growing_as_all_pairs(), "steps")
