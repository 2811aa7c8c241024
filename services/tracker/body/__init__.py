"""Body model of the tracker: parts, sizes, poses and their Jacobian."""
