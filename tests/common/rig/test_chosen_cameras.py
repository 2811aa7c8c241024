"""Only some cameras of a folder, a rig file or a list of videos are used."""

from pathlib import Path

import pytest

from tests.common.rig.test_rig import RIG, camera_table, write_folder, write_rig
from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Rig, load_rig, rig_of_videos

HYBRID = RIG.replace('"two-view"', '"hybrid"')
HEADINGS = [0.0, 60.0, 120.0]


def ids(rig: Rig) -> list[str]:
    return [viewer.id for viewer in rig.viewers]


def test_folder_and_videos_with_some_of_their_cameras(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "take", HEADINGS)
    rig = load_rig(folder, cameras=["cam03", "cam01"])
    assert ids(rig) == ["cam01", "cam03"]
    assert [note.split(":")[0] for note in rig.notes] == ["cam01, cam03"]  # no note about the camera that is not used
    assert ids(Rig.load(folder, cameras=("cam01", "cam02", "cam02"))) == ["cam01", "cam02"]
    videos = sorted((folder / "videos").iterdir())
    assert ids(rig_of_videos(videos, folder / "calibration.toml", cameras=["cam02", "cam03"])) == ["cam02", "cam03"]
    assert ids(load_rig(folder)) == ["cam01", "cam02", "cam03"]


def test_a_video_that_cannot_be_read_does_not_matter_where_its_camera_is_not_used(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "take", HEADINGS)
    (folder / "videos" / "cam02.mp4").write_bytes(b"no video")
    with pytest.raises(UserError, match=r"cam02\.mp4: not a video that can be decoded"):
        load_rig(folder)
    assert ids(load_rig(folder, cameras=["cam01", "cam03"])) == ["cam01", "cam03"]


def test_rig_file_takes_ids_and_names_of_cameras_and_has_another_digest(tmp_path: Path) -> None:
    third = '[[viewer]]\nid = "3"\ncamera = "cam03"\nsource = 3\n\n[zenoh]'
    path = write_rig(tmp_path, HYBRID.replace("[zenoh]", third))
    tables = "\n".join(camera_table(k, heading) for k, heading in enumerate(HEADINGS, start=1))
    (tmp_path / "calibration.toml").write_text(tables)
    found = load_rig(path, cameras=["3", "cam02"])
    assert ids(found) == ["2", "3"]
    assert found.digest not in (load_rig(path).digest, load_rig(path, cameras=["1", "2"]).digest)
    (tmp_path / "rig.toml").write_text(path.read_text().replace("source = 3", 'source = "a://b"'))
    with pytest.raises(UserError, match=r"viewer\[2\]\.source"):
        load_rig(path, cameras=["1", "3"])


@pytest.mark.parametrize(
    ("cameras", "words"),
    [
        (["cam01", "cam09"], "cameras: 'cam09': no such camera: allowed: cam01, cam02, cam03"),
        (["cam01"], r"cameras: cam01: 1 camera\(s\): allowed: two or more of cam01, cam02, cam03"),
        (["cam01", "cam01"], r"1 camera\(s\): allowed: two or more of"),
        ([], r"cameras: none: 0 camera\(s\): allowed: two or more of"),
    ],
)
def test_other_names_and_fewer_than_two_are_refused(tmp_path: Path, cameras: list[str], words: str) -> None:
    folder = write_folder(tmp_path / "take", HEADINGS)
    with pytest.raises(UserError, match=words):
        load_rig(folder, cameras=cameras)
    with pytest.raises(UserError, match=words):
        rig_of_videos(sorted((folder / "videos").iterdir()), folder / "calibration.toml", cameras=cameras)


def test_errors_of_a_rig_file_list_ids_and_cameras(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"rig\.toml: cameras: 'x': no such camera: allowed: 1 \(cam01\), 2 \(cam02\)"):
        load_rig(write_rig(tmp_path), cameras=["x", "1"])
