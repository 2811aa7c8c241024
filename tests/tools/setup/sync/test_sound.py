"""Lags from sound, and its times in video files."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import resample_poly

from tests.support.video_file import Sound, copied, write_video
from tests.support.videos import grey_frames
from zenocap.common.lags.pairs import peak_of
from zenocap.common.video.reader import VideoReader
from zenocap.tools.setup.sync.sound import RATE, SOUND_LIMITS, SoundPair, phase_correlation, read_sound

SOURCE = np.random.default_rng(0).standard_normal(16_000 * 12) * 0.1


def test_phase_correlation_has_its_peak_at_the_lag_at_any_gain() -> None:
    noise = np.random.default_rng(1).standard_normal(20_000)
    one, other = noise[:15_000], 0.01 * noise[300:12_000]
    curve = phase_correlation(one, other, 1000)
    assert int(np.argmax(curve)) - 1000 == 300  # one[i] = other[i - 300]


def test_unrelated_sound_is_not_certain_and_a_clap_in_noise_is() -> None:
    rng = np.random.default_rng(2)
    one, other = rng.standard_normal((2, 10 * RATE)) * 0.01
    pair = SoundPair(one, other, 3.0)
    assert not peak_of(pair.curve.lags_s, pair.curve.values, SOUND_LIMITS).is_certain(SOUND_LIMITS)
    clap = rng.standard_normal(80) * np.exp(-np.arange(80) / 20)
    one[5 * RATE : 5 * RATE + 80] += clap
    other[4 * RATE : 4 * RATE + 80] += 0.5 * clap
    pair = SoundPair(one, other, 3.0)
    peak = peak_of(pair.curve.lags_s, pair.curve.values, SOUND_LIMITS)
    assert peak.is_certain(SOUND_LIMITS)
    lag = pair.refined(peak.lag_s)
    assert lag is not None
    assert abs(lag.lag_s - 1.0) < 0.001


@pytest.mark.parametrize(("suffix", "picture_s", "sound_s"), [(".mp4", 0.0, 0.0), (".mp4", 0.0, 0.4), (".mkv", 0.25, 0.0)])
def test_time_of_sound_counts_from_the_first_picture(tmp_path: Path, suffix: str, picture_s: float, sound_s: float) -> None:
    """The pictures begin at 3 s of the source, whenever the sound of the file begins."""
    first = round((3.0 - picture_s + sound_s) * 16_000)
    sound = Sound(SOURCE[first : first + 16_000 * 6], 16_000, sound_s)
    times = [picture_s + k / 30 for k in range(20)]
    path = write_video(tmp_path / f"one{suffix}", grey_frames(20), times, sound=sound)
    track = read_sound(path, 60.0)
    assert track is not None
    pair = SoundPair(resample_poly(SOURCE, RATE, 16_000), track, 5.0)
    lag = pair.refined(peak_of(pair.curve.lags_s, pair.curve.values, SOUND_LIMITS).lag_s)
    assert lag is not None
    assert abs(lag.lag_s - 3.0) < 0.001


def test_time_of_sound_counts_from_pictures_that_cannot_be_decoded(tmp_path: Path) -> None:
    """As the frames' times do: the copy begins five frames later, between two key frames, and the sound is whole."""
    whole = write_video(
        tmp_path / "whole.ts",
        grey_frames(60),
        sound=Sound(SOURCE[: 16_000 * 6]),
        options={"x264-params": "keyint=20:scenecut=0"},
    )
    path = copied(whole, tmp_path / "cut.ts", first=5)
    with VideoReader(path) as reader:
        frame = reader.next()
        assert frame is not None
        assert frame.time_ns == pytest.approx(15 / 30 * 1e9, abs=1e6)
    tracks = [read_sound(one, 60.0) for one in (whole, path)]
    assert tracks[0] is not None
    assert tracks[1] is not None
    pair = SoundPair(tracks[0], tracks[1], 5.0)
    lag = pair.refined(peak_of(pair.curve.lags_s, pair.curve.values, SOUND_LIMITS).lag_s)
    assert lag is not None
    assert abs(lag.lag_s - 5 / 30) < 0.001


def test_videos_without_sound_or_with_silence_have_none(tmp_path: Path) -> None:
    assert read_sound(write_video(tmp_path / "one.mp4", grey_frames(5)), 60.0) is None
    silent = Sound(np.zeros(16_000), 16_000)
    assert read_sound(write_video(tmp_path / "two.mp4", grey_frames(5), sound=silent), 60.0) is None
