"""The table of kinds of benchmarks."""

from benchmarks.harness.case import Kind
from zenocap.common.table import Table

KINDS = Table(
    Kind,
    "zenocap.benchmarks",
    {
        "clips": "benchmarks.cases.clips:CLIPS",
        "real-video": "benchmarks.cases.clips:BEAM",
        "scaling": "benchmarks.cases.clips:SCALING",
        "methods": "benchmarks.cases.clips:METHODS",
        "priors": "benchmarks.cases.clips:PRIORS",
        "recovery": "benchmarks.cases.clips:RECOVERY",
        "tracker-times": "benchmarks.cases.clips:TIMES",
        "table-1": "benchmarks.cases.paper:TABLE_1",
        "table-2": "benchmarks.cases.paper:TABLE_2",
        "table-2-simulated": "benchmarks.cases.paper:TABLE_2_SIMULATED",
        "regions": "benchmarks.cases.paper:REGIONS",
        "variants": "benchmarks.cases.two_cameras:VARIANTS",
        "bodies": "benchmarks.cases.two_cameras:BODIES",
        "two-view-clips": "benchmarks.cases.two_cameras:TWO_VIEW_CLIPS",
        "starts": "benchmarks.cases.starts:STARTS",
        "headings": "benchmarks.cases.starts:HEADING_STARTS",
        "confidence": "benchmarks.cases.starts:CONFIDENCE",
        "limits": "benchmarks.cases.starts:LIMITS",
        "jitter": "benchmarks.cases.jitter:JITTER",
    },
)
