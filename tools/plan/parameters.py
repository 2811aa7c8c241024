"""Constants of the plan: limits and measured costs, with provenance.

Measured on two cores of a small server with version 0.2, by `zenocap load`, `python -m benchmarks.animator` and others of
docs/measured.md.  `zenocap plan --measure` scales viewers, integrator, tracker and router to the user's machine.
"""

from zenocap.tools.plan.costs import Costs, Linear

MAX_CAMERAS, MAX_ROUTERS = 10_000, 1_000
USABLE = 0.6  # share of all cores; measured: loads are held up to 0.8 to 1.3 of two cores, processes then wait for one
LOOP_USABLE = 0.85  # cores of a service, whose loop is one thread; as `tools.load_test.costs` has it
TRACE_EVENT_BYTES = 11.0  # of an event in an input trace: index and time in MessagePack
FOXGLOVE_SIZE = 1.6  # size of a take with Foxglove channels relative to one without; by hand
GIGABIT = 1e9 / 8  # bytes per second of a usual network

COSTS = Costs(
    # `zenocap load --method hybrid --rate 30`: 0.04 cores of a viewer at 160 x 120, 0.10 at 640 x 480, 0.26 at 1280 x 720.
    silhouette=Linear(0.9, 7.0),
    # The loads of docs/load.md, frame rate reached: 0.26 cores at 160 x 120 and 60/s, 0.25 at 640 x 480 and 30/s.
    two_view=Linear(4.0, 14.0),
    decoding=Linear(0.05, 0.8),  # docs/measured.md: 0.3 ms at 640 x 480
    integrator=2.5,  # docs/load.md, the same loads: 0.16 cores at 60/s
    # `zenocap load --method hybrid --rate 30`: 0.50, 0.55, 0.63 cores with 2, 4 and 7 views, both threads; 18 ms of four
    # views at 8, 15 and 30/s, 14 ms at 60/s.  Longer than the 9.4 ms of docs/measured.md, where it never waits.
    tracker=Linear(14.8, 0.85),
    timekeeper=5.0,  # of a second; `zenocap load --method hybrid`: 0.01 cores of the integrator without a log
    logged=0.043,  # docs/measured.md: the log's thread, 1720 messages/s: 7.4 % of a core,
    logged_foxglove=0.1,  # and 17 % with Foxglove channels
    forwarded=0.05,  # `zenocap load --rigs 16`: 0.08 cores of the router for about 1400 messages/s
    animator=5.0,  # 27 % of a core without a page at 60/s, less the health of the process
    page=30.0,  # of a second; 27 % of a core without and 30 % with a page, 39 % with four
    process=8.0,  # of a second, for health, clock and Zenoh; by hand: fits 32 viewers whose frames are mostly left out
    # Means of a take of the demo at 160 x 120; its silhouettes in other sizes; a pose of 14 parts, 400 points.
    silhouette_bytes=Linear(125.0, 300.0),
    preview_bytes=Linear(3_000.0, 4_000.0),  # JPEG of at most 320 px; by hand
    sighting_bytes=573.0,
    bap_bytes=739.0,
    assignment_bytes=260.0,
    pose_bytes=634.0,
    tracker_pose_bytes=2_590.0,
    points_bytes=2_466.0,
    health_bytes=700.0,
    trace_bytes=100.0,
    overhead_bytes=90.0,  # Zenoh's frame and key, TCP and IP headers of a message that is sent alone
    stored=0.66,  # size of a take of the demo over that of its messages
    foxglove_size=FOXGLOVE_SIZE,
    viewer_mb=115.0,  # soak test of one hour: 113 MB
    integrator_mb=100.0,
    tracker_mb=175.0,  # 80 to 175 MB for the processes of a rig
    animator_mb=220.0,  # with 0 to 16 pages; 247 after half an hour with four
    router_mb=40.0,
)
MEASURED_RATE, MEASURED_S, MEASURED_VIEWS = 15.0, 8.0, 4  # frames/s, seconds and views of the loads of --measure; by hand
