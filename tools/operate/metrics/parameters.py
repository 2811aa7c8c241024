"""Limits, histogram buckets and names of the exported metrics.

A name in a label comes from a table here or a rig file, or is one of a limited number of identifiers.  So messages of
unknown origin cannot create series without bound.
"""

from zenocap.common.messages import Phase
from zenocap.common.rig.outputs import OUTPUTS as OUTPUT_KINDS
from zenocap.common.rig.services import ORDER
from zenocap.common.topics import TOPICS

MAX_RIGS = 16  # that are found on the network; rigs of files are always exported; by hand
MAX_SERVICES = 64  # of a rig, besides those of its file; by hand
FORGET_NS = 300_000_000_000  # a service not of a rig file and silent for this long is removed; by hand
TIMES_KEPT = 256  # capture times of a viewer from which its skew is computed, as many as a `Handled` message has

# Upper bounds of the latency histogram (s): about 20 % to 50 % apart around the tracker's budget of 20 ms, p99 40 ms.
LATENCY_BUCKETS_S = (
    0.002, 0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0,
)  # fmt: skip

SERVICE_NAMES = frozenset({*ORDER, "recorder"})
PHASES = tuple(phase.value for phase in Phase)
STAGES = (
    "frame_age", "result_age", "publish", "step_frame", "step_tick", "step_alive",
    *(f"step_{topic.name}" for topic in TOPICS),
)  # fmt: skip
OUTPUTS = OUTPUT_KINDS.names()
OUTPUT_RESULTS = ("sent", "refused", "dropped", "failed", "errors")
