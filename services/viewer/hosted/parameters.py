"""Behavioural constants of viewers that are assigned over the network."""

LEASE_S = 30.0  # without a query of the rig's launcher, after which its viewer ends; chosen by hand
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 10.0  # before a viewer that ended is started again; doubles each time; chosen by hand
SETTLED_S = 10.0  # run time after which the pause begins at its shortest again; chosen by hand
STOP_S = 8.0  # for a viewer to end before it is killed, as `zenocap up` has it
LAST_LINES = 5  # of a viewer's output that are kept, to find its error; chosen by hand
