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
        "postures": "benchmarks.cases.recognition.postures:POSTURES_KIND",
        "postures-paper": "benchmarks.cases.recognition.postures:AS_IN_THE_PAPER",
        "confusions": "benchmarks.cases.recognition.postures:CONFUSIONS",
        "few-examples": "benchmarks.cases.recognition.postures:FEW",
        "one-person": "benchmarks.cases.recognition.postures:ONE_PERSON",
        "stream": "benchmarks.cases.recognition.streams:STREAM",
        "real-motion": "benchmarks.cases.recognition.real:REAL",
        "real-stream": "benchmarks.cases.recognition.real_stream:REAL_STREAM",
        "false-rate": "benchmarks.cases.recognition.false_rate:FALSE_RATE",
        "recognition-costs": "benchmarks.cases.recognition.costs:COSTS",
    },
)
