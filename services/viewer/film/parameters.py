"""Behavioural constants of films that are recorded at the command of another program."""

LEASE_S = 10.0  # without a query of who films, after which a film ends by itself; chosen by hand
EARLIEST_S, LATEST_S = 10.0, 60.0  # of a start before and after its query; chosen by hand
OPEN_S = 60.0  # in which an opened film must be started, so that a camera is not kept open; chosen by hand
STOP_S = 5.0  # for the search of a board to end, after which it is killed; chosen by hand
LAST_BYTES = 4096  # of its output, from which the reason of a failure is read
FILMS = "films"  # folder of films beside the rig file
TWIN_S = 0.5  # for another machine of the same name to answer; chosen by hand
LOOK_AGAIN_S = 5.0  # between looks which cameras are plugged in; chosen by hand
