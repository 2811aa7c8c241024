"""Behavioural constants of cameras that other programs film, or assign to viewers."""

FILM_LEASE_S = 10.0  # without a query of who films, after which a film ends by itself; chosen by hand
EARLIEST_S, LATEST_S = 10.0, 60.0  # of a start before and after its query; chosen by hand
OPEN_S = 60.0  # in which an opened film must be started, so that a camera is not kept open; chosen by hand
SEARCH_STOP_S = 5.0  # for the search of a board to end, after which it is killed; chosen by hand
LAST_BYTES = 4096  # of its output, from which the reason of a failure is read
FILMS = "films"  # folder of films beside the rig file
TWIN_S = 0.5  # for another machine of the same name to answer; chosen by hand
LOOK_AGAIN_S = 5.0  # between looks which cameras are plugged in; chosen by hand

# Viewers that are assigned over the network
VIEWER_LEASE_S = 30.0  # without a query of the rig's launcher, after which its viewer ends; chosen by hand
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 10.0  # before a viewer that ended is started again; doubles each time; chosen by hand
SETTLED_S = 10.0  # run time after which the pause begins at its shortest again; chosen by hand
VIEWER_STOP_S = 8.0  # for a viewer to end before it is killed, less than `zenocap up` waits for it; chosen by hand
LAST_LINES = 5  # of a viewer's output that are kept, to find its error; chosen by hand
