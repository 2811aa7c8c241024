"""Films of simulated people by two cameras, in the folder layout of the README."""

from pathlib import Path

from tests.support.simulated_cameras import paper_cameras
from tests.support.stored import stored_files
from tests.support.video_file import write_video
from tests.support.walkers import walker
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZE, FPS, EMPTY = (320, 240), 15, 15


def film(folder: Path, size: tuple[int, int] = SIZE, frames: int = 150) -> None:
    """Videos of the simulated person by two cameras, in the folder layout of the README."""
    subject = person(0)
    script = demo_timeline(subject, 0)
    first_s = script.segments[0].end_s - EMPTY / FPS
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(size), strict=True))
    (folder / "videos").mkdir(parents=True)
    for name, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, 0)
        images = [renderer.render(script.pose_at(first_s + k / FPS), k) for k in range(frames)]
        write_video(folder / "videos" / f"{name}.mp4", images, fps=FPS)
    write_calibration(folder / "calibration.toml", cameras)
    (folder / "clip.toml").write_text(f"empty_frames = {EMPTY - 1}\n")


def small_film(folder: Path) -> Path:
    """Such videos of 3 s, small."""
    return stored_files(folder, _film_small, "small film", sources=[__name__])


def _film_small(place: Path) -> None:
    film(place, (160, 120), 45)


def walker_film(folder: Path) -> Path:
    """Videos of a simulated person who walks about.  Returns `known.toml` beside the folder, the lenses of the cameras."""
    stored_files(folder, _film_walker, "walker film", sources=[__name__])
    return (folder / "known.toml").rename(folder.parent / "known.toml")


def _film_walker(place: Path) -> None:
    one = walker(0, 2)
    (place / "videos").mkdir(parents=True)
    for name, camera in one.cameras.items():
        renderer, end_s = SimulatedCamera(camera, one.person, 0), one.motion.duration_s
        poses = [None] * EMPTY + [one.motion.pose_at(k / FPS) for k in range(int(end_s * FPS))]
        images = [renderer.render(pose, k) for k, pose in enumerate(poses)]
        write_video(place / "videos" / f"{name}.mp4", images, fps=FPS)
    write_calibration(place / "known.toml", dict(one.cameras))
    (place / "clip.toml").write_text(f"empty_frames = {EMPTY - 1}\n")
