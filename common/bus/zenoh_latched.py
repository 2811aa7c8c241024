"""LATCHED topics over Zenoh: an advanced publisher with a cache of one for late joiners."""

import zenoh
import zenoh.ext

from zenocap.common.bus.zenoh_queries import ENCODING

HEARTBEAT_S = 1.0  # longest time until a reader detects that it missed the last value, chosen by hand


def latched_publisher(session: zenoh.Session, key: str) -> zenoh.ext.AdvancedPublisher:
    """Publisher whose last value late joiners receive.  Raises ZError."""
    return zenoh.ext.declare_advanced_publisher(
        session, key, encoding=ENCODING, congestion_control=zenoh.CongestionControl.DROP,
        cache=zenoh.ext.CacheConfig(max_samples=1),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=HEARTBEAT_S, sporadic_heartbeat=None),
        publisher_detection=True,
    )  # fmt: skip


def latched_subscriber(
    session: zenoh.Session, expression: str, on_sample: "zenoh.handlers.Callback[zenoh.Sample]"
) -> zenoh.ext.AdvancedSubscriber[None]:
    """Subscriber that also receives the last value.  on_sample: called with each sample, on a thread of Zenoh's."""
    return zenoh.ext.declare_advanced_subscriber(
        session, expression, on_sample, history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
        recovery=zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
    )  # fmt: skip
