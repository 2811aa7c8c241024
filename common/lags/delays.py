"""Camera delays from silhouettes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import Limits, Pairs, VideoOffset, offsets_of, reach_s
from zenocap.common.lags.tangents import SILHOUETTE_LIMITS, Outline, silhouette_pairs

SKEW_US = "camera_skew_us"  # count in the integrator's health: largest delay between cameras that is not corrected


@dataclass(frozen=True)
class CameraLags:
    """offsets: by viewer, seconds by which its images show later moments than the first certain one's at equal times."""

    offsets: Mapping[str, VideoOffset]

    @property
    def certain(self) -> dict[str, VideoOffset]:
        return {viewer: one for viewer, one in self.offsets.items() if not one.reason}

    @property
    def uncertain(self) -> list[str]:
        return [viewer for viewer, one in self.offsets.items() if one.reason]

    @property
    def delays_ms(self) -> dict[str, float]:
        """Delay of each certain viewer, ms: against the one whose images are the youngest, which has 0."""
        certain = self.certain
        latest = max((one.offset_s for one in certain.values()), default=0.0)
        return {viewer: 1e3 * (latest - one.offset_s) for viewer, one in certain.items()}


def limits_of(most_s: float) -> Limits:
    """What counts as certain in a comparison of silhouettes.  most_s: largest difference of two cameras."""
    return replace(SILHOUETTE_LIMITS, max_lag_s=most_s)


def lags_between(names: Sequence[str], pairs: Pairs, limits: Limits) -> CameraLags:
    """Lags of cameras from their pairs, which reach `reach_s` of the largest lag."""
    return CameraLags(offsets_of(names, pairs, limits, {}) if names else {})


def silhouette_lags(cameras: Mapping[str, Camera], outlines: Mapping[str, Sequence[Outline]], limits: Limits) -> CameraLags:
    """Lags of calibrated cameras from the outlines of a person, with their capture times."""
    return lags_between(list(cameras), silhouette_pairs(cameras, outlines, reach_s(limits.max_lag_s)), limits)
