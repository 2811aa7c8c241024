"""The human model: anatomy as a table, sizes (BDP), pose (BAP), kinematics and projected outlines."""
