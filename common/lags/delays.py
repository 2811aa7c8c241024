"""By how long each camera's images are late, from the comparison of the outlines of all pairs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from zenocap.common.lags.pairs import Limits, Offset, Pairs, offsets_of
from zenocap.common.lags.tangents import SILHOUETTE_LIMITS

SKEW_US = "camera_skew_us"  # count in the integrator's health: largest delay between cameras that is not corrected


@dataclass(frozen=True)
class CameraLags:
    """offsets: by viewer, seconds by which its images show later moments than the first certain one's at equal times."""

    offsets: Mapping[str, Offset]

    @property
    def uncertain(self) -> list[str]:
        return [viewer for viewer, one in self.offsets.items() if one.reason]

    @property
    def delays_ms(self) -> dict[str, float]:
        """Delay of each viewer, ms: against the one whose images are the youngest, which has 0."""
        latest = max(one.offset_s for one in self.offsets.values())
        return {viewer: 1e3 * (latest - one.offset_s) for viewer, one in self.offsets.items()}


def limits_of(most_s: float) -> Limits:
    """What counts as certain in a comparison of silhouettes.  most_s: largest difference of two cameras."""
    return replace(SILHOUETTE_LIMITS, max_lag_s=most_s)


def lags_between(names: Sequence[str], pairs: Pairs, most_s: float) -> CameraLags:
    """Lags of cameras from their pairs.  most_s: largest difference of two cameras; the pairs reach `reach_s` of it."""
    found = offsets_of(names, pairs, limits_of(most_s), {})
    first_s = next((one.offset_s for one in found.values() if not one.reason), 0.0)
    return CameraLags({name: replace(found[name], offset_s=found[name].offset_s - first_s) for name in names})
