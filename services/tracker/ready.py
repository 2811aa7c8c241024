"""Loading what is compiled before the first instant: otherwise the first person seen costs the tracker instants."""

import numpy as np

from services.tracker.tracking import Setup, describe, follow, initial_state


def load_compiled(setup: Setup) -> str:
    """Follow nobody through one instant; returns what the tracker then does, in words."""
    masks = {viewer: np.zeros((camera.size[1], camera.size[0]), np.uint8) for viewer, camera in setup.cameras.items()}
    state, _ = follow(setup, initial_state(setup), 0, masks)
    return describe(state)
