"""States at a sample time: places in the box, and the boxes that were crossed."""

import numpy as np

from carom.engine.advance import project
from carom.engine.boundary import NearestImage
from carom.engine.state import make_state
from carom.models.motions.free_flight import Inertial


def test_a_place_a_hair_below_the_lower_face_is_on_it_and_has_crossed_no_box():
    # A hair less than nothing plus the edge is the edge, in doubles: the place of the face above, one box up.
    edge, hair, d = 3.0, 2.0**-80, 2
    starts = np.array([[0.0, 1.0], [1.0, 0.0], [2.5, 0.5]])
    velocities = np.array([[-hair, 0.0], [0.0, -hair], [1.0, -1.0]])
    state = make_state(starts, velocities, 4.0, True, np.float64)
    boundary = NearestImage((edge,) * d, (1.0 / edge,) * d)
    found, speeds, images = np.empty_like(starts), np.empty_like(starts), state.images.copy()
    project(Inertial(), boundary, state, 1.0, found, speeds, images)
    assert found.tolist() == [[0.0, 1.0], [1.0, 0.0], [0.5, 2.5]]
    assert images.tolist() == [[0, 0], [0, 0], [1, -1]]
    assert speeds.tolist() == velocities.tolist()
