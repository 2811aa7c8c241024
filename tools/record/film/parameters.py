"""Behavioural constants of filming; those of the files are in `common/video/parameters.py`."""

READY_S = 30.0  # for all cameras to give their first image; chosen by hand
LONG_S = 7200.0  # from which the time that the disk lasts is given in hours; chosen by hand
ESTIMATE_S = 3.0  # after which the bytes a second are known; chosen by hand
FIND_S = 1.5  # to find the programs that have cameras; chosen by hand
QUERY_S = 2.0  # for the answer to a query; chosen by hand
STOP_S = 20.0  # for the answer to the query that ends a film, whose last frames are written before; chosen by hand
POLL_S = 0.5  # between queries of the state, well below the lease of a film; chosen by hand
TRIPS = 8  # round trips before a film, to know the clock; chosen by hand
LOST_S = 10.0  # without an answer, after which a camera is given up; as long as the lease of a film
LEAD_S = 1.0  # from the command to start to the first frame of all cameras; chosen by hand
CHECKSUM_S = 600.0  # for the checksum of a long film; chosen by hand
DETECT_S = 3600.0  # for the search of a board where a film is; 1,500 images take a minute or two; chosen by hand
FETCH_TRIES = 20  # queries for one part of a file, about a minute with their waits; chosen by hand
LATE_PERIODS = 2.0  # of a camera, from the start of the film to its first image, before it is warned of; chosen by hand
ROUTER_S = 3.0  # for the router of a rig to answer; without it only cameras of this machine are filmed; chosen by hand
# Of the files of a film beyond its images: measured were 33 B a frame in the container and 26 B in the table of times
FRAME_BYTES = 80  # a frame; chosen by hand
FILE_BYTES = 1 << 20  # and a file; chosen by hand
