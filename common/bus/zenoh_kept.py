"""KEPT topics over Zenoh: an advanced publisher with a cache of one, which who joins late or comes back asks."""

from collections.abc import Callable

import zenoh
import zenoh.ext

from common.bus.zenoh_clock import ENCODING

HEARTBEAT_S = 1.0  # how soon a reader learns that it missed the last value


def kept_publisher(session: zenoh.Session, key: str) -> zenoh.ext.AdvancedPublisher:
    """Raises ZError."""
    return zenoh.ext.declare_advanced_publisher(
        session,
        key,
        encoding=ENCODING,
        congestion_control=zenoh.CongestionControl.DROP,
        cache=zenoh.ext.CacheConfig(max_samples=1),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=HEARTBEAT_S, sporadic_heartbeat=None),
        publisher_detection=True,
    )


def kept_subscriber(
    session: zenoh.Session, expression: str, heard: Callable[[zenoh.Sample], None]
) -> zenoh.ext.AdvancedSubscriber[None]:
    """heard: is given each sample, on a thread of Zenoh's."""
    return zenoh.ext.declare_advanced_subscriber(
        session,
        expression,
        heard,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
        recovery=zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
    )
