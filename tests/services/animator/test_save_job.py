"""Saving: names that are never replaced, one job at a time, nothing left behind."""

import sys
import threading
from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.services.animator import save_job as module
from zenocap.services.animator.page.save_messages import SaveTake, SavingUpdate
from zenocap.services.animator.save_job import SaveJob, moved


class Job(SaveJob):
    """Job whose command is a program of the test.  states: published ones."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, program: str) -> None:
        self.states: list[SavingUpdate] = []
        self.ended = threading.Event()
        monkeypatch.setattr(
            module, "command_line", lambda take, output, *_, **__: [sys.executable, "-c", program, str(output)]
        )
        super().__init__(self._keep, lambda path: f"/saved/{path.name}", 1)

    def _keep(self, update: SavingUpdate) -> None:
        self.states.append(update)
        if update.state != "running":
            self.ended.set()

    def run(self, folder: Path) -> SavingUpdate:
        self.ended.clear()
        self.start(SaveTake("bvh"), folder / "walk.mcap", folder)
        assert self.ended.wait(60)
        return self.states[-1]


WRITE = "import sys; open(sys.argv[1], 'w').write('new'); print(f'{sys.argv[1]}: 3 frames');"


def new_file(folder: Path, text: str = "") -> Path:
    (folder / "new").mkdir(exist_ok=True)
    file = folder / "new" / "walk.bvh"
    file.write_text(text)
    return file


def test_a_taken_name_gets_a_number(tmp_path: Path) -> None:
    for expected in ("walk.bvh", "walk-2.bvh", "walk-3.bvh"):
        assert moved(new_file(tmp_path, expected), tmp_path).name == expected
    assert list((tmp_path / "new").iterdir()) == []
    assert (tmp_path / "walk.bvh").read_text() == "walk.bvh"


def test_too_many_names_are_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_SAVED_NAMES", 1)
    (tmp_path / "walk.bvh").touch()
    with pytest.raises(UserError, match=r"walk\.bvh: 1 files of this name exist"):
        moved(new_file(tmp_path), tmp_path)


def test_states_of_a_file_that_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    progress = """print('{"done": 1, "total": 2}\\nnote: a gap', file=sys.stderr)"""
    job = Job(monkeypatch, WRITE + progress)
    last = job.run(tmp_path)
    assert last == SavingUpdate("done", "walk.bvh", text="3 frames", notes=["a gap"], address="/saved/walk.bvh")
    assert [(one.state, one.done, one.total) for one in job.states[:-1]] == [("running", 0, 0), ("running", 1, 2)]
    assert job.run(tmp_path).name == "walk-2.bvh"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["walk-2.bvh", "walk.bvh"]


def test_a_failure_is_one_line_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job(monkeypatch, WRITE + "print(f'error: {sys.argv[1]}: bad', file=sys.stderr); sys.exit(1)")
    assert job.run(tmp_path) == SavingUpdate("failed", "walk.bvh", text="walk.bvh: bad")
    assert list(tmp_path.iterdir()) == []
    missing = tmp_path / "gone"
    last = job.run(missing)
    assert last.state == "failed"
    assert last.text == f"{missing}: cannot be written: No such file or directory"


def test_a_second_file_is_refused_until_the_first_is_cancelled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job(monkeypatch, WRITE + "import time; time.sleep(100)")
    job.start(SaveTake("bvh"), tmp_path / "walk.mcap", tmp_path)
    with pytest.raises(ValueError, match="another file is being saved"):
        job.start(SaveTake("csv"), tmp_path / "walk.mcap", tmp_path)
    job.cancel()
    assert job.ended.wait(60)
    assert job.states[-1] == SavingUpdate("cancelled", "walk.bvh")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", ["exe", "opensim", "", "../walk"])
def test_another_format_is_refused_with_the_allowed_ones(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = Job(monkeypatch, WRITE)
    with pytest.raises(ValueError, match=f"refused: format '{kind}': allowed: trc, bvh, .*, usd, .*mp4, webm, png$"):
        job.start(SaveTake(kind), tmp_path / "walk.mcap", tmp_path)
    assert not job.running


def test_a_part_that_ends_before_it_starts_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job(monkeypatch, WRITE)
    with pytest.raises(ValueError, match="the part ends at 2 s: allowed: 3 s or later"):
        job.start(SaveTake("bvh", 3.0, 2.0), tmp_path / "walk.mcap", tmp_path)
    assert not job.running
