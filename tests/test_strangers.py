"""Contradictory files and first steps of strangers: tests of each point, and what it gave before.

`python -m tests.test_strangers` runs them all, and prints what became of each, with the command that runs it alone.
Column *after*: the last error, note or figure of the first test of a row that has one, as the program gave it.  TRIAL is
what the report of the trial has, BEFORE what other points gave, by the commits that mended them; SEARCHED are further
inputs of each kind that were looked for afterwards.
"""

import re
import runpy
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support.opensim_models import hands_off
from tests.support.places import CLIPS, ROOT, SHARED
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.errors import FileNote, UserError
from zenocap.common.formats.c3d_reader import read_c3d
from zenocap.common.formats.euler_solutions import continuous_euler
from zenocap.common.formats.mot import read_mot, write_mot
from zenocap.common.formats.opensim_coordinates import JOINTS, rotations_of
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import read_trc
from zenocap.common.video.reader import VideoReader, VideoSummary

BUGS = SHARED / "bugs"
AFTER = "after"  # property of a test: what the program gives now
needs_bugs = pytest.mark.skipif(not BUGS.is_dir(), reason="the inputs of bug reports are not beside the checkout")
FORMATS, TAKES, FILMS = "common/formats", "tools/takes", "common/video/test_reader.py"
DAMAGE = "common/recording/test_damage.py"
PICTURES = "services/viewer/sources/test_sources.py"
CALIBRATIONS = "common/camera/test_calibration_files.py"
PAGE = "system/browser/test_page.py"
TESTS: Mapping[str, tuple[str, ...]] = {  # of the folder tests
    "equal Euler solutions: that inside the reader's ranges": (
        f"{FORMATS}/test_euler_solutions.py::test_a_walk_after_a_t_pose_is_written_inside_the_models_ranges_and_played_as_it_was",
        f"{FORMATS}/test_euler_solutions.py::test_opensim_plays_a_walk_after_a_t_pose_as_it_was",
        "test_strangers.py::test_the_arms_of_a_bug_report_are_written_inside_the_ranges_and_played_by_opensim",
    ),
    "number or time: time": (
        f"{FORMATS}/test_trc.py::test_of_number_time_and_rate_the_time_decides",
        f"{FORMATS}/test_c3d_reader.py::test_the_first_frame_of_the_trial_is_used_where_it_agrees_with_the_rows",
        f"{FORMATS}/test_c3d_reader.py::test_a_rate_in_the_header_that_contradicts_the_parameter_is_said",
        f"{FORMATS}/test_motion_files.py::test_the_rate_is_that_of_the_times_and_rows_that_are_left_out_are_gaps",
        f"{TAKES}/test_export.py::test_frames_that_a_live_take_leaves_out_are_rows_without_pose",
        f"{TAKES}/test_export.py::test_uneven_times_in_a_format_with_one_rate_are_said",
        f"{TAKES}/test_evaluate.py::test_a_truth_that_counts_from_1_is_paired_by_time",
        f"{PICTURES}::test_numbers_that_are_left_out_in_the_names_of_pictures_are_gaps",
        f"{PICTURES}::test_pictures_state_their_gaps_and_an_assumed_rate",
    ),
    "a truth of another offset, side or unit: doubtful, status 3": (
        f"{TAKES}/test_evaluate.py::test_a_doubt_comes_first_and_with_status_3",
        f"{TAKES}/test_evaluate.py::test_a_truth_of_other_sides_or_another_unit_is_doubted",
        f"{TAKES}/test_evaluate_angles.py::test_a_truth_of_another_offset_side_or_unit_is_doubted",
    ),
    "header against rows: refused, or noted": (
        f"{FORMATS}/test_trc.py::test_fewer_names_than_columns_and_more_cells_than_names_are_refused",
        f"{FORMATS}/test_trc.py::test_counts_in_the_header_that_contradict_the_rows_are_said",
        f"{FORMATS}/test_c3d_reader.py::test_another_number_of_rows_than_is_read_is_said",
        f"{FORMATS}/test_c3d_reader.py::test_other_numbers_of_names_are_said_and_two_numbers_of_points_are_refused",
    ),
    "missing data as zeros: missing, noted once": (
        f"{FORMATS}/test_trc.py::test_zeros_are_missing_points_and_said_once",
        f"{FORMATS}/test_c3d_reader.py::test_zeros_with_a_valid_residual_are_missing_and_said_once",
    ),
    "points against the body": (
        f"{FORMATS}/test_marker_sets.py::test_of_two_people_the_first_whole_one_is_taken_and_said",
        f"{FORMATS}/test_marker_sets.py::test_a_left_handed_file_is_mirrored_and_the_log_says_so",
        f"{FORMATS}/test_marker_sets.py::test_exchanged_sides_look_left_handed_and_straight_legs_do_not_say",
        f"{FORMATS}/test_marker_sets.py::test_a_unit_that_contradicts_the_body_is_said",
    ),
    "time base and shape of films": (
        f"{FILMS}::test_a_bare_stream_has_the_rate_of_its_headers",
        f"{FILMS}::test_a_film_that_an_edit_list_trims_is_whole",
        f"{FILMS}::test_a_recording_that_begins_between_key_frames_keeps_its_times_and_says_so",
        f"{FILMS}::test_a_film_whose_beginning_is_missing_says_so",
        f"{FILMS}::test_a_film_that_begins_with_pictures_that_refer_to_earlier_ones_keeps_its_times",
        f"{FILMS}::test_a_mirror_in_the_display_matrix_is_said_and_no_half_turn",
        f"{FILMS}::test_pixels_that_are_not_square_are_said",
        f"{FILMS}::test_pixels_that_are_not_square_by_the_container_alone_are_said",
        f"{FILMS}::test_a_film_of_jpeg_pictures_with_exif_data_is_turned_as_they_ask_for",
        f"{FILMS}::test_a_film_without_key_frame_is_refused_for_that_reason",
        f"{FILMS}::test_more_frames_than_declared_are_used_and_said",
        f"{FILMS}::test_slow_motion_and_time_lapses_are_said",
        f"{FILMS}::test_of_several_films_in_one_file_the_first_is_used_which_is_said_and_a_cover_is_none",
        f"{FILMS}::test_an_avi_with_dropped_frames_is_whole",
        f"{TAKES}/test_take_videos.py::test_pictures_are_turned_as_the_file_asks_for",
        f"{TAKES}/test_take_videos.py::test_a_bare_stream_has_the_pictures_of_its_times",
        "tools/setup/sync/test_sound.py::test_time_of_sound_counts_from_pictures_that_cannot_be_decoded",
    ),
    "vendors' modes and units": (
        f"{CALIBRATIONS}::test_qualisys_cameras_without_a_calibrated_video_are_left_out_and_said",
        f"{CALIBRATIONS}::test_qualisys_intrinsics_are_those_of_the_sensor",
        f"{CALIBRATIONS}::test_the_part_of_a_qualisys_video_is_in_its_own_pixels",
        f"{CALIBRATIONS}::test_a_qualisys_video_that_is_higher_than_its_resolution_is_said",
        f"{CALIBRATIONS}::test_qualisys_video_cameras_of_old_files_without_a_resolution_are_read",
        f"{CALIBRATIONS}::test_easymocaps_rotation_is_the_one_that_others_read_and_contradictions_are_said",
        f"{CALIBRATIONS}::test_two_caliscope_cameras_of_one_number_are_refused_and_two_numbers_of_one_are_said",
        f"{CALIBRATIONS}::test_ros_camera_info_of_a_part_of_the_pixels_is_refused",
        f"{CALIBRATIONS}::test_the_guessed_size_of_easymocap_is_a_usual_one_and_is_said",
        f"{CALIBRATIONS}::test_distances_of_another_unit_than_metres_are_questioned",
    ),
    "a guess is marked in what is written": (
        "tools/cli/calibrate/test_convert.py::"
        "test_a_guessed_size_is_marked_in_what_is_written_and_noted_where_that_is_read",
        "tools/cli/calibrate/test_convert.py::test_a_guessed_vertical_is_marked_in_every_layout",
        "tools/cli/calibrate/test_convert.py::test_an_unknown_error_is_not_written_as_none",
        "tools/cli/calibrate/test_scene.py::test_a_guessed_size_of_a_lens_stays_marked_unless_the_images_give_it",
        "common/camera/test_lens_files.py::test_the_size_of_images_replaces_a_guess_unless_they_are_scaled",
        "common/rig/test_video_folder.py::test_the_size_of_a_video_replaces_a_guess_and_no_known_size",
        f"{TAKES}/test_export.py::test_a_body_that_was_not_measured_is_said",
    ),
    "valid containers": (
        f"{TAKES}/test_recover.py::test_chunks_of_lz4_are_read",
        f"{TAKES}/test_recover.py::test_another_compression_is_named_and_no_empty_take_is_written",
        f"{DAMAGE}::test_what_later_versions_and_other_programs_may_write_is_no_damage",
        f"{DAMAGE}::test_a_chunk_that_is_larger_than_is_read_is_named",
        f"{FORMATS}/test_c3d.py::test_any_number_of_points_is_read_back_with_its_names",
    ),
    "names": (
        "common/rig/test_video_folder.py::test_videos_belong_to_the_camera_whose_name_they_contain",
        f"{CALIBRATIONS}::test_files_of_others_that_are_not_read_are_named_in_one_line",
        f"{CALIBRATIONS}::test_what_ros_topic_echo_prints_is_read",
        "common/rig/test_video_folder.py::test_hidden_files_beside_the_videos_are_none",
        "common/rig/test_video_folder.py::test_capitals_in_the_names_of_files_do_not_count",
        "common/rig/test_video_folder.py::test_a_file_of_a_camera_that_is_not_taken_is_named",
        f"{FORMATS}/test_trc.py::test_a_byte_order_mark_is_no_part_of_the_file",
        f"{CALIBRATIONS}::test_a_byte_order_mark_is_no_part_of_the_file",
        "common/camera/test_lens_files.py::test_files_of_opencvs_programs_are_read",
        f"{FORMATS}/test_text_file.py::test_text_of_windows_is_read_and_a_guess_is_noted",
    ),
    "a frozen picture: point 6 of issue 48, of the tracker; what is there": (
        "services/tracker/view_check/test_view_consistency.py::"
        "test_frozen_view_is_reported_in_time_and_used_again_when_it_changes",
    ),
    "both colour schemes": (
        f"{PAGE}::test_every_text_has_contrast_in_every_window",
        f"{PAGE}::test_curves_have_the_colours_of_their_legend_and_the_room_is_light_where_the_colour_scheme_is",
    ),
    "a terminal of 80 x 24": (
        "tools/record/launcher/test_rig_status.py::test_everything_is_seen_in_a_terminal_of_80_columns_and_24_rows",
    ),
    "the empty scene": (
        "services/viewer/advice/test_faults.py::test_a_person_in_the_empty_scene_is_stated_and_not_learnt",
        "services/viewer/advice/test_person.py::test_another_person_and_a_place_that_one_has_left_are_distinguished",
        "common/rig/test_rig.py::test_first_frames_of_cameras_of_different_rates_end_at_the_same_time",
        f"{PICTURES}::test_the_background_of_a_film_is_that_of_its_empty_part",
        "tools/cli/test_track.py::test_a_fifth_more_empty_frames_than_there_are_lose_no_poses_or_are_named_first",
    ),
    "setup with another calibration": (
        "tools/cli/test_setup_steps.py::test_a_calibration_with_other_names_and_another_shape_is_matched_by_asking",
        "tools/setup/test_state.py::"
        "test_a_calibration_of_another_shape_is_refused_before_the_rig_file_and_the_step_can_be_repeated",
    ),
    "without T-pose": (
        "tools/judge/test_verdict.py::test_what_lies_before_the_first_pose_counts_in_a_short_take",
        "tools/cli/test_track.py::test_without_t_pose_the_frames_are_tracked_again_with_the_height_over_the_floor",
    ),
    "first hour: the frame in Blender": ("system/test_blender.py::test_blender_has_the_joints_where_they_are",),
    "first hour: 0 poses": ("tools/cli/test_track.py::test_the_height_is_advised_where_the_method_needs_it",),
    "first hour: two people": (
        "services/viewer/advice/test_faults.py::test_a_second_person_is_stated",
        "tools/cli/test_track.py::test_two_people_in_films_are_the_first_reason_that_is_printed",
    ),
    "first hour: a moved camera": ("tools/judge/test_wrong_inputs.py::test_the_camera_that_was_moved_is_named",),
    "first hour: angles of hanging arms": (
        f"{PAGE}::test_angles_are_0_in_the_hanging_arm_and_the_straight_knee_and_grow_as_they_lift_and_bend",
    ),
    "first hour: the amber box, and grey limbs": (
        f"{PAGE}::test_the_advice_is_calm_while_a_person_is_tracked_and_grey_limbs_are_explained",
    ),
    "first hour: frusta through panels": (f"{PAGE}::test_lines_of_the_cameras_do_not_shine_through_the_panels",),
    "first hour: points behind the body": (f"{PAGE}::test_scene_points_go_with_the_body_until_the_next_ones_come",),
    "first hour: a taken port": (
        "tools/cli/test_services.py::test_the_demo_takes_a_free_port_where_the_usual_one_is_taken",
    ),
    "first hour: gif, wav, mp3 and zip; walk/videos; -o no/such/a.xyz": (
        "tools/cli/test_suggestions.py::"
        "test_a_missing_file_and_one_of_the_wrong_type_are_a_line_that_suggests_the_right_command",
    ),
    "first hour: a take without pictures": (
        f"{TAKES}/test_take_videos.py::test_videos_are_found_by_the_name_of_the_rig_and_a_take_without_is_said",
        f"{TAKES}/test_take_videos.py::test_the_next_command_names_a_folder_that_is_not_beside_the_take",
    ),
    "first hour: pictures missing while a take plays": (
        "system/browser/test_show.py::test_pictures_follow_the_poses_while_the_take_plays",
    ),
    "first hour: zoom of the teaching page": (
        "system/browser/test_postures.py::test_the_whole_take_is_in_view_at_first_and_everything_has_a_name_in_every_window",
    ),
    "first hour: take.verdict.text": ("test_public_api.py::test_a_take_has_a_verdict_in_words",),
    "first hour: export without -o": (
        f"{TAKES}/test_export.py::test_without_output_a_file_is_written_beside_the_take_and_named",
    ),
    "first hour: level cameras looking at a point on the ground": (
        "tools/cli/calibrate/test_calibrate.py::"
        "test_the_plan_of_the_objects_is_on_the_page_that_the_help_names_and_drawn_as_the_help_places_them",
    ),
    "Ctrl-C": (
        "common/runtime/test_signals.py::test_a_process_that_still_loads_ends_at_once",
        "tools/record/launcher/test_child_processes.py::test_process_that_ignores_sigterm_prints_its_stacks_and_is_killed",
    ),
    "wrong inputs: the cause is the first reason": (
        "tools/judge/test_wrong_inputs.py::test_the_first_reason_of_a_wrong_input_is_its_cause",
        "tools/judge/test_verdict.py::test_what_the_cameras_show_is_the_first_reason",
        "tools/judge/test_verdict.py::test_missing_legs_are_the_first_reason_where_nothing_was_tracked",
        "services/viewer/advice/test_faults.py::test_a_second_person_is_stated",
        "tools/cli/test_track.py::test_two_people_in_films_are_the_first_reason_that_is_printed",
    ),
}

NOT_REPRODUCED = "not reproduced: the test passes on the code of then too"
TRIAL: Mapping[str, str] = {  # what each point gave, by the report
    "equal Euler solutions: that inside the reader's ranges": "OpenSim played the left hand 726 mm off",
    "number or time: time": "44 mm became 77 mm; a renumbered truth gave 2588 mm, with status 0",
    "header against rows: refused, or noted": "394 mm, with status 0",
    "missing data as zeros: missing, noted once": "44.2 mm became 81.0 mm, with status 0",
    "time base and shape of films": "30/s read at 25/s; a trimmed film was damaged; a late one gave 1128 mm",
    "vendors' modes and units": "a focal length twice too long; a camera 520 m away, with status 0",
    "a guess is marked in what is written": "a guessed size of 1951 x 1057 px was written as a fact",
    "valid containers": "LZ4 was damage; an empty recovered take was intact",
    "names": "cam8 had the video of cam10",
    "both colour schemes": "dark text on black",
    "a terminal of 80 x 24": "the address was cut",
    "the empty scene": "36 empty frames instead of 30: 66 % lost, no cause named",
    "setup with another calibration": "a rig file that the next step refused",
    "without T-pose": "45 of 74 frames without a pose, and the verdict good",
    "first hour: 0 poses": "always advised --height",
    "first hour: two people": "not named",
    "first hour: a moved camera": "named third",
    "first hour: angles of hanging arms": "168 and 193 degrees",
    "first hour: the amber box, and grey limbs": "amber while all is well; grey was not explained",
    "first hour: frusta through panels": "shone through",
    "first hour: points behind the body": "behind the playing body",
    "first hour: a taken port": "no demo",
    "first hour: gif, wav, mp3 and zip; walk/videos; -o no/such/a.xyz": "no command was suggested",
    "first hour: pictures missing while a take plays": f"missing; {NOT_REPRODUCED}",
    "first hour: zoom of the teaching page": f"full at the start; {NOT_REPRODUCED}",
    "Ctrl-C": "animator or recognizer killed after 8 s",
    "wrong inputs: the cause is the first reason": "unusable; two people were not named, a moved camera third",
}
BEFORE: Mapping[str, str] = {  # what other points gave, and the commit that mended it
    "a truth of another offset, side or unit: doubtful, status 3": "a note of offsets of centres, with status 0 (3adf8328)",
    "points against the body": "points of two people were mixed (72072b14); legs and feet of left-handed files pointed "
    "another way than the pelvis (e0bcdfdd)",
    "first hour: the frame in Blender": "'row k is frame k + 1': of Blender, or of the take, was open (5715d6e1)",
    "first hour: a take without pictures": "shown without pictures, without a note (e4e9eb6e)",
    "first hour: take.verdict.text": "no such attribute (3e615b10)",
    "first hour: export without -o": "refused: -o was required (3e615b10)",
    "first hour: level cameras looking at a point on the ground": "no drawing (3e615b10)",
}
WHOLE_TURN = "test_euler_solutions.py::test_a_free_angle_grows_past_a_turn_and_begins_in_the_middle"
COUNTS = (
    f"{FORMATS}/test_mot.py::test_errors_name_line_column_value_and_what_is_allowed",
    f"{FORMATS}/test_bvh_reader.py::test_errors_name_the_line",
)
RANGES = f"{FORMATS}/test_opensim_coordinates.py::test_coordinates_that_leave_the_ranges_of_the_model_give_a_note"
FOLDER = "common/rig/test_video_folder.py"
SEARCHED: Mapping[str, tuple[str, tuple[str, ...]]] = {  # what each gave before, and its tests
    "Euler: a person who turns beyond 90 degrees, in OpenSim": ("clamped without a note", (RANGES,)),
    "Euler: a person 4 m beside the origin, in OpenSim": ("clamped without a note", (RANGES,)),
    "Euler: an arm raised beyond the ranges of both solutions": ("clamped without a note", (RANGES,)),
    "Euler: two full turns of the trunk": ("right: continuous", (f"{FORMATS}/{WHOLE_TURN}",)),
    "number or time: rows that Frame# alone leaves out": (
        "no note",
        (f"{FORMATS}/test_trc.py::test_rows_that_only_numbers_or_only_times_leave_out_are_noted",),
    ),
    "number or time: pictures at 30/s by the rig file": (
        "'30/s assumed'",
        ("common/rig/test_rig.py::test_pictures_know_whether_the_rig_states_their_rate",),
    ),
    "header and rows: POINT:FRAMES that is no whole number": (
        "'not a C3D file'",
        (f"{FORMATS}/test_c3d_reader.py::test_a_number_of_rows_that_is_no_whole_number_is_read",),
    ),
    "header and rows: a .mot of degrees that states radians": (
        "degrees as radians",
        (f"{FORMATS}/test_opensim_coordinates.py::test_a_unit_that_the_angles_contradict_gives_a_note",),
    ),
    "header and rows: nRows of .mot, Frames of BVH": ("right: refused", COUNTS),
    "missing data: three times 9999": (
        "points, kilometres away",
        (f"{FORMATS}/test_trc.py::test_three_times_a_number_of_nines_is_a_missing_point",),
    ),
    "missing data: C3D points with a residual below 0, elsewhere than at 0": (
        "right: missing",
        (f"{FORMATS}/test_c3d_reader.py::test_points_with_a_residual_below_zero_are_missing_wherever_they_are",),
    ),
    "films: JPEG pictures that ask for a mirror": (
        "turned by 180 degrees; single pictures mirrored",
        (
            f"{FILMS}::test_a_film_of_jpeg_pictures_with_exif_data_is_turned_as_they_ask_for",
            f"{PICTURES}::test_pictures_are_turned_as_their_exif_data_ask_for_and_not_mirrored_which_is_noted",
        ),
    ),
    "films: slow motion of Sony's cameras": ("no note", (f"{FILMS}::test_slow_motion_of_sonys_cameras_is_noted",)),
    "films: slow motion of Apple's telephones": (
        "right: their times are those of the capture",
        (f"{FILMS}::test_slow_motion_of_apples_telephones_has_the_times_of_the_capture",),
    ),
    "films: interlaced": ("no note", (f"{FILMS}::test_an_interlaced_film_is_noted",)),
    "films: a bare stream in a folder": (
        "not used",
        (f"{FOLDER}::test_capitals_in_the_names_of_files_do_not_count",),
    ),
    "units: feet, of low or near cameras": (
        "no note",
        (
            f"{CALIBRATIONS}::test_distances_of_another_unit_than_metres_are_questioned",
            f"{CALIBRATIONS}::test_in_feet_a_calibration_of_the_clips_is_questioned_and_not_in_metres_or_yards",
        ),
    ),
    "units: yards": (
        "as metres, which they nearly are: it stays",
        (f"{CALIBRATIONS}::test_in_feet_a_calibration_of_the_clips_is_questioned_and_not_in_metres_or_yards",),
    ),
    "vendors: a Qualisys camera without a part of its video": (
        "the file was refused",
        (f"{CALIBRATIONS}::test_a_qualisys_camera_without_a_part_of_its_video_is_left_out_and_the_others_are_read",),
    ),
    "vendors: Qualisys' cameras that are shown turned": (
        "no note",
        (f"{CALIBRATIONS}::test_qualisys_cameras_that_are_shown_turned_are_noted",),
    ),
    "vendors: Qualisys' ProReflex, and the resolution none": (
        "read as cameras of video",
        (f"{CALIBRATIONS}::test_qualisys_cameras_without_a_calibrated_video_are_left_out_and_said",),
    ),
    "containers: MCAP's attachments and footers with more fields; a chunk of two Zstandard frames": (
        "damage",
        (f"{DAMAGE}::test_what_later_versions_and_other_programs_may_write_is_no_damage",),
    ),
    "containers: a chunk of two LZ4 frames": ("damage", (f"{TAKES}/test_recover.py::test_chunks_of_lz4_are_read",)),
    "names: letters with accents of macOS; cameras 1 and 2 with films of trials": (
        "refused; exchanged",
        (f"{FOLDER}::test_videos_belong_to_the_camera_whose_name_they_contain",),
    ),
    "names: calibrations of COLMAP and Metashape": (
        "'not XML'; 'no camera in it'",
        (f"{CALIBRATIONS}::test_files_of_others_that_are_not_read_are_named_in_one_line",),
    ),
}


def exists(test: str) -> bool:
    """Whether there is a test, FILE::NAME of the folder tests."""
    file, name = test.split("::")
    return re.search(rf"^def {name}\(", (ROOT / "tests" / file).read_text(encoding="utf-8"), re.MULTILINE) is not None


class Outcomes:
    """A plugin of pytest: what became of the tests, and what they ended with."""

    def __init__(self) -> None:
        self._found: list[tuple[str, str]] = []
        self._after: list[tuple[str, str]] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Keep the text of each error and note, also of those that the test expects."""

        def kept(error: Exception, *given: object) -> None:
            Exception.__init__(error, *given)
            item.user_properties.append((AFTER, " ".join(map(str, given))))

        with pytest.MonkeyPatch.context() as patch:
            for kind in (UserError, FileNote):
                patch.setattr(kind, "__init__", kept)
            return (yield)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" or not report.passed:
            self._found.append((report.nodeid, report.outcome))
        logged = [words[2] for line in report.caplog.splitlines() if len(words := line.split(maxsplit=2)) == 3]
        given = [str(value) for name, value in report.user_properties if name == AFTER]
        if report.when == "call" and (texts := given or logged):
            self._after.append((report.nodeid, re.sub(r"(?<!\S)/\S*/", "", texts[-1]).replace("\n", " ").replace("|", "/")))

    def of(self, test: str) -> set[str]:
        """What became of a test with any parameters, or of those of a file."""
        return {outcome for name, outcome in self._found if _is_of(test, name)} or {"not run"}

    def after(self, tests: Iterable[str]) -> str:
        """Text of the first test that has one, "" for none."""
        return next((text for test in tests for name, text in self._after if _is_of(test, name)), "")


def _is_of(test: str, name: str) -> bool:
    return re.match(rf"{re.escape(test)}(\[|::|$)", name) is not None


def run(table: Mapping[str, tuple[str, ...]], before: Mapping[str, str] | None = None) -> int:
    """Run the tests of a table, of all tiers; print what became of each row, and its command.  Returns the exit status.

    before: by row, for a column of its own.
    """
    rows = {row: [f"tests/{test}" for test in tests] for row, tests in table.items()}
    outcomes = Outcomes()
    status = pytest.main(["-m", "", *dict.fromkeys(test for tests in rows.values() for test in tests)], [outcomes])
    columns = ("what", *(() if before is None else ("before", "after")), "tests", "command")
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for row, tests in rows.items():
        found = ", ".join(sorted(set[str]().union(*map(outcomes.of, tests)))) or "none"
        was = "" if before is None else f" {before.get(row, '')} | {outcomes.after(tests)} |"
        command = f"`python -m pytest -m '' {' '.join(tests)}`" if tests else ""
        print(f"| {row} |{was} {found} | {command} |")
    return status


@pytest.mark.parametrize("point", [*TESTS, *SEARCHED])
def test_each_point_has_its_tests(point: str) -> None:
    assert [test for test in (TESTS.get(point) or SEARCHED[point][1]) if not exists(test)] == []


def test_what_the_report_has_is_of_points_of_the_table() -> None:
    assert {*TRIAL, *BEFORE} - set(TESTS) == set()
    assert set(TRIAL) & set(BEFORE) == set()


def test_after_is_what_the_program_gives_last_in_the_first_test_that_has_something() -> None:
    class Wrapped(UserError):
        def __init__(self, text: str) -> None:
            super().__init__(f"{text}, wrapped")

    outcomes = Outcomes()
    for name, kinds, logged in (
        ("a", (), ""),
        ("b", (), "WARNING  log:c.py:3 /tmp/x/c.trc: cut"),
        ("c", (FileNote, UserError, Wrapped), ""),
    ):
        item = SimpleNamespace(user_properties=[])
        for _ in outcomes.pytest_runtest_call(item):
            given = [kind(f"/tmp/x/a.trc: at 25/s, by {kind.__name__}") for kind in kinds]
        assert [str(one) for one in given] == [text for _, text in item.user_properties]
        report = SimpleNamespace(nodeid=f"f.py::{name}[0]", when="call", outcome="passed", passed=True, caplog=logged)
        report.user_properties = item.user_properties
        outcomes.pytest_runtest_logreport(report)
    assert outcomes.after(["f.py::a"]) == ""
    assert outcomes.after(["f.py::a", "f.py::b", "f.py::c"]) == "c.trc: cut"
    assert outcomes.after(["f.py::c"]) == "a.trc: at 25/s, by Wrapped, wrapped"


def film(name: str) -> VideoSummary:
    """What is said of a film that was read to its end."""
    with VideoReader(BUGS / name) as reader:
        for _ in iter(reader.next, None):
            pass
        return reader.summary()


@needs_bugs
@pytest.mark.parametrize(
    ("name", "frames", "rate", "note"),
    [
        ("raw-h264-rate/film30.h264", 60, 30.0, "has no times: 30 frames/s, as its headers state"),
        ("raw-h264-rate/film30_no_vui.h264", 60, 25.0, "states no frame rate: 25/s assumed"),
        ("trim-edit-list/trimmed.mp4", 45, 30.0, "15 frames are in the file and cut away by its edit list"),
        ("trim-edit-list/trimmed.mov", 45, 30.0, "15 frames are in the file and cut away by its edit list"),
        ("midgop-start/from_frame_12.ts", 30, 30.0, "begins between two key frames: the first 18 frames (0.60 s)"),
        ("midgop-start/from_frame_12.mkv", 30, 30.0, "its first frame is at 0.60 s: what came before is missing"),
        ("mirrored-matrix/hflip.mp4", 0, 0.0, "asks for a mirrored picture: not mirrored"),
        ("mirrored-matrix/vflip.mp4", 0, 0.0, "asks for a mirrored picture: not mirrored"),
        ("mirrored-matrix/rot90flip.mp4", 0, 0.0, "asks for a mirrored picture: not mirrored"),
    ],
)
def test_a_film_of_a_bug_report_is_read_as_it_is_and_what_is_odd_is_said(
    name: str, frames: int, rate: float, note: str
) -> None:
    found = film(name)
    assert any(one.startswith(note) for one in found.notes), found.notes
    assert found.damaged == 0
    if frames:
        assert (found.timing.frames, round(found.timing.rate, 1)) == (frames, rate)


@needs_bugs
def test_the_arms_of_a_bug_report_are_written_inside_the_ranges_and_played_by_opensim(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    path, rewritten = BUGS / "mot-arm-branch" / "walk_excerpt.mot", tmp_path / "a.mot"
    mot = read_mot(path)
    rotations, columns = rotations_of(mot, path)[0], dict(mot.columns)
    for side in ("right", "left"):
        ((triple,),) = JOINTS[f"{side}_shoulder"]
        chosen = np.degrees(continuous_euler(triple.axes, rotations[f"{side}_shoulder"], triple.ranges, 1.0 / mot.rate))
        for k, (name, (low, high)) in enumerate(zip(triple.names, triple.ranges_deg, strict=True)):
            columns[name] = triple.signs[k] * chosen[:, k]
            assert low <= columns[name].min() <= columns[name].max() <= high
    write_mot(rewritten, mot.times_s, columns)
    same, _ = rotations_of(read_mot(rewritten), rewritten)
    np.testing.assert_allclose(same["left_shoulder"], rotations["left_shoulder"], atol=1e-6)
    pytest.importorskip("opensim", reason="opensim is not installed: pip install opensim")
    assert hands_off(path, tmp_path)[:, 1].min() > 0.5
    off = hands_off(rewritten, tmp_path).max()
    record_property(AFTER, f"OpenSim plays the hands {1000.0 * off:.1f} mm off")
    assert off < 0.01


@needs_bugs
def test_the_late_c3d_of_a_bug_report_has_its_times() -> None:
    found = read_c3d(BUGS / "c3d-late-start" / "late.c3d")
    assert (found.frames[0], found.frames[-1]) == (70000, 70049)
    np.testing.assert_allclose(found.times_s[[0, -1]], (700.0, 700.49))


@needs_bugs
@pytest.mark.parametrize(
    ("file", "sizes", "note"),
    [
        ("calib-cm/calibration_cm.toml", None, "is the file in centimetres or inches"),
        ("easymocap-no-size/extri.yml", [(1920, 1080)] * 2, "1920 x 1080 px is a guess"),
        ("qca-modes/room.qca.txt", [(1920, 1088)], "20003"),
    ],
)
def test_a_calibration_of_a_bug_report_is_questioned(file: str, sizes: list[tuple[int, int]] | None, note: str) -> None:
    with pytest.warns(FileNote) as warned:
        cameras = read_calibration(BUGS / file)
    assert any(note in str(one.message) for one in warned), [str(one.message) for one in warned]
    assert sizes is None or [camera.size for camera in cameras.values()] == sizes


def same_times(found: Trajectories, same: Trajectories) -> None:
    np.testing.assert_allclose(found.times_s, same.times_s, atol=1e-3)
    np.testing.assert_array_equal(found.points, same.points)


def missing_wrists(found: Trajectories, same: Trajectories) -> None:
    wrists = [k for k, name in enumerate(found.names) if name.endswith("Wrist")]
    missing = np.isnan(found.points).all(axis=2)
    assert missing[99:, wrists].mean() == pytest.approx(0.2, abs=0.02)
    assert np.array_equal(found.points[~missing], same.points[~missing])


@needs_bugs
@pytest.mark.skipif(not CLIPS.is_dir(), reason="the shared clips are not beside the checkout")
@pytest.mark.parametrize(
    ("name", "check"),
    [
        ("from1", same_times),
        ("rate100", same_times),
        ("same_number", same_times),
        ("zeros", missing_wrists),
        ("name_missing", None),
    ],
)
def test_a_trc_of_a_bug_report_is_read_by_its_times_or_refused(
    name: str, check: Callable[[Trajectories, Trajectories], None] | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["trc_variants.py", str(CLIPS / "walk2" / "truth.trc"), str(tmp_path)])
    runpy.run_path(str(BUGS / "trc_variants.py"))
    if check is None:
        with pytest.raises(UserError, match="names"):
            read_trc(tmp_path / f"{name}.trc")
    else:
        check(read_trc(tmp_path / f"{name}.trc"), read_trc(tmp_path / "same.trc"))


if __name__ == "__main__":
    searched = {row: tests for row, (_, tests) in SEARCHED.items()}
    in_trial = {row: f"in the trial: {text}" for row, text in TRIAL.items()}
    sys.exit(
        run(
            {"inputs of bug reports": ("test_strangers.py",), **TESTS, **searched},
            {**in_trial, **BEFORE, **{row: gave for row, (gave, _) in SEARCHED.items()}},
        )
    )
