"""Attacks of the table in docs/machines.md and the tests of each.

`python -m tests.test_attacks` runs them all, and prints what became of each, with the command that runs it alone.
BEFORE is what they did, and the commit that mended it; of the others no other state is known.
"""

import re
import sys
from collections.abc import Mapping
from types import SimpleNamespace

import pytest

from tests.support.places import ROOT
from tests.test_strangers import AFTER, Outcomes, exists, run

SECURED, ENDPOINT = "system/test_secured.py", "services/camera/test_endpoint.py"
TESTS: Mapping[str, tuple[str, ...]] = {  # of the folder tests, by the first column
    "invalid messages on any key": (
        "system/test_hostile.py::test_hostile_bytes_stop_no_service_and_do_not_fill_the_memory",
        f"{SECURED}::test_members_publish_only_on_their_own_keys",
    ),
    "valid messages in the name of a service": (
        "system/test_hostile.py::test_valid_but_inconsistent_messages_stop_no_service",
        "services/viewer/two_view/test_step.py::test_a_false_assignment_interrupts_tracking_for_one_frame",
        "services/tracker/test_state_recovery.py::test_a_false_body_before_the_own_measurement_lasts_until_the_next_t_pose",
        "common/bus/test_zenoh_state_recovery.py::test_a_false_body_of_one_session_does_not_outvote_the_subscribers",
        "common/bus/test_access.py::test_only_the_service_named_in_a_key_publishes_on_it",
        f"{SECURED}::test_members_publish_only_on_their_own_keys",
        f"{SECURED}::test_every_certificate_puts_and_receives_on_every_key_what_the_rules_allow_and_no_more",
        f"{SECURED}::test_only_trusted_members_return_the_body_of_a_restarted_integrator",
    ),
    "invented services, viewers and rigs": (
        "common/bus/test_inbox.py::test_invented_names_of_one_topic_displace_no_other_topic",
        "common/observe/test_account.py::test_invented_services_and_processes_take_no_place_of_the_rigs_own",
        "common/observe/test_view.py::test_invented_services_are_bounded_and_displace_none_of_the_rig",
        "common/observe/test_watch.py::test_invented_rigs_are_read_up_to_a_limit",
        "common/recording/test_parts.py::test_invented_names_are_repeated_in_no_place_of_the_rigs_own",
        "common/recording/test_writer.py::test_invented_names_do_not_displace_the_rigs_own_services_and_topics",
        "services/animator/outputs/test_foxglove.py::test_invented_names_take_a_limited_number_of_channels",
        "common/bus/test_access.py::test_only_the_service_named_in_a_key_publishes_on_it",
    ),
    "another calibration of a camera": (
        "common/runtime/test_service.py::test_a_first_message_that_another_program_replaces_is_published_again",
    ),
    "a false start of a film or of the simulated person": (
        "services/viewer/test_epoch.py::test_a_start_far_ahead_or_longer_ago_than_the_film_lasts_is_ignored_and_named_once",
        "common/bus/test_access.py::test_only_the_service_named_in_a_key_publishes_on_it",
    ),
    "false answers for the integrator's clock": (
        "system/test_zenoh_bus.py::test_a_false_clock_answer_moves_no_time",
        "common/bus/test_access.py::test_a_member_sends_on_its_own_keys_what_the_table_says_and_on_those_of_others_nothing",
    ),
    "a false frame rate below 5 frames/s": (
        "common/runtime/test_frame_rate.py::test_older_impossible_and_far_decisions_are_not_followed",
    ),
    "another false frame rate, or delay of a camera": (
        "services/integrator/test_rate_control.py::test_a_decision_of_another_integrator_is_answered",
        "services/integrator/test_step.py::test_a_frame_rate_of_another_integrator_is_answered",
        "services/integrator/test_camera_delays.py::test_a_correction_of_another_program_is_answered_with_the_own_one",
    ),
    "requests that begin or end a take": (
        "services/integrator/test_log_control.py::test_at_most_one_request_a_second_is_obeyed",
        "common/bus/test_access.py::test_only_the_animator_publishes_requests",
    ),
    "assignments to `--discover`": (
        "services/camera/test_assigned.py::test_a_viewer_is_run_until_it_is_released",
        "common/rig/test_hosted.py::test_an_assignment_that_makes_no_viewer_is_refused",
        "tools/cli/test_services.py::test_an_assignment_has_no_working_size_above_the_cameras_own",
        "system/test_limits.py::test_the_largest_assignment_takes_a_limited_memory",
    ),
    "answers in place of a camera that is filmed": (
        "services/camera/test_host.py::test_a_second_program_that_answers_for_a_camera_is_found",
        "tools/record/film/test_remote.py::test_a_false_machine_gets_no_more_of_the_disk_than_it_announced",
    ),
    "films of a camera": (
        f"{ENDPOINT}::test_nothing_is_obeyed_without_permission",
        "system/test_film_machines.py::test_a_running_rig_without_permission_is_not_filmed",
        f"{SECURED}::test_only_the_operator_films_and_copies_pictures",
    ),
    "copies of films": (
        f"{ENDPOINT}::test_pictures_stay_without_permission_to_read",
        f"{ENDPOINT}::test_films_of_a_running_viewer_leave_its_machine_with_certificates_only",
        "services/camera/test_host.py::test_films_leave_no_host_also_where_previews_may",
        "tools/record/film/test_remote.py::"
        "test_on_an_open_network_nothing_is_copied_also_from_what_has_the_name_of_this_machine",
        "system/test_film_machines.py::test_pictures_stay_where_they_are_without_permission",
        "system/test_film_machines.py::test_messages_of_a_stranger_write_nothing_elsewhere",
        f"{SECURED}::test_only_the_operator_films_and_copies_pictures",
    ),
    "a flood of questions to a camera that is filmed": (
        "common/bus/test_query_server.py::test_a_flood_of_queries_keeps_nobody_who_films_from_an_answer",
        f"{SECURED}::test_only_the_operator_films_and_copies_pictures",
    ),
    "a flood of messages of megabytes": (
        "common/bus/test_inbox.py::test_a_queue_is_limited_in_bytes",
        "common/bus/test_inbox.py::test_an_unread_queue_is_bounded",
        "common/bus/test_inbox.py::test_messages_of_the_rig_are_delivered_whatever_others_send",
        "tools/record/launcher/test_statement.py::test_what_the_queue_drops_and_what_never_arrives_are_terms",
        "system/test_chaos.py::test_a_rig_survives_a_minute_of_chaos",
    ),
    "bodies and poses at the ends of their ranges": (
        "services/animator/outputs/test_output_group.py::"
        "test_values_at_the_ends_of_the_bus_ranges_reach_receivers_as_numbers",
        "services/animator/outputs/test_ros.py::test_bodies_and_poses_at_the_ends_of_their_ranges_are_numbers",
    ),
    "a flood of commands, or one that fails, from an open page": (
        "common/web/test_page.py::test_a_flood_of_commands_delays_neither_a_turn_nor_the_end",
        "common/web/test_page.py::test_commands_beyond_the_maximum_are_refused_with_a_reason",
        "common/web/test_page.py::test_a_command_that_fails_is_said_and_the_page_goes_on",
    ),
    "random commands to the pages of set-up and of postures": (
        "system/test_running_pages.py::test_the_page_of_postures_outlasts_hostile_commands",
        "system/test_running_pages.py::test_the_page_of_points_outlasts_hostile_commands",
        "system/test_running_pages.py::test_the_page_of_cameras_outlasts_hostile_commands",
        "system/test_running_pages.py::test_the_page_of_a_board_outlasts_hostile_commands",
        "tools/setup/page/test_live_page.py::test_an_unknown_command_is_answered_and_the_page_lives",
    ),
    "a web page of another site, also by DNS rebinding, or one without the token": (
        "common/web/test_server.py::test_a_foreign_host_name_is_refused",
        "common/web/test_server.py::test_without_the_token_there_is_neither_page_nor_socket",
        "tools/operate/metrics/test_shell.py::test_a_server_for_all_machines_is_asked_by_address_or_own_name",
        "services/animator/outputs/test_gate.py::test_a_page_of_a_name_that_now_leads_here_is_refused",
    ),
    "a camera that answers ONVIF with nonsense": (
        "tools/setup/cameras/test_onvif.py::test_a_device_with_an_odd_answer_is_named_and_the_others_are_asked",
        "tools/setup/cameras/test_onvif.py::test_answers_that_are_none_are_ignored",
    ),
    "a ROS router, or a collector of traces, that hangs": (
        "services/animator/outputs/test_ros.py::test_a_router_that_hangs_delays_the_end_by_a_limit",
        "tools/operate/traces/test_export.py::test_a_collector_that_never_answers_is_left",
        "tools/operate/traces/test_export.py::"
        "test_a_collector_whose_answer_has_no_end_delays_no_end_and_has_taken_the_spans",
    ),
    "the last memory of a service, or the last open files of a rig": (
        "system/test_limits.py::test_a_service_without_memory_ends_with_the_reason_and_no_other_one",
        "system/test_limits.py::test_a_full_table_of_files_in_the_whole_rig_stops_nothing_and_passes",
    ),
    "a revoked certificate under load": (
        "system/test_revocation.py::test_revocations_and_renewals_under_load_exclude_the_holder_and_bring_the_others_back",
    ),
    "damaged files": (
        "test_readers.py::test_every_reader_of_the_package_has_a_kind_of_damaged_file",
        "test_readers.py::test_a_damaged_file_is_refused_in_words",
        "test_readers.py::test_a_file_damaged_in_many_ways_is_refused_in_words",
    ),
    "a wheel with another model for `models add`": (
        "tools/setup/models/test_models.py::test_a_false_wheel_is_one_error_and_nothing_is_kept",
    ),
}
BEFORE: Mapping[str, str] = {
    "invalid messages on any key": "at the end of a run they hid the last healths: an unknown loss (383818bd)",
    "valid messages in the name of a service": "after a false body the tracker searched for ever (41838ff0)",
    "invented services, viewers and rigs": "256 names took 1 GB (bd5ddfa9), and as many services hid what the rig's "
    "own lost, with status 0 (107b7329); 1,024 cameras displaced the rig's own in later parts of a take (31de2412)",
    "another calibration of a camera": "held until the end of its viewer (14b70845)",
    "a false start of a film or of the simulated person": "a viewer slept for ever, or its film ended at once (35d1f717)",
    "false answers for the integrator's clock": "who had connected first moved all clocks by any time (8ea70257)",
    "a false frame rate below 5 frames/s": "no pose for 12 s and more (94208c1e)",
    "another false frame rate, or delay of a camera": "one with a time ahead held for 10 s (1cf642f6)",
    "assignments to `--discover`": "one took all memory of the machine: 5.3 GB after 45 s (c6ddc576)",
    "answers in place of a camera that is filmed": "the film was copied to the last byte of the disk (cd08394f)",
    "copies of films": "who received the queries of who filmed could take the film (bacc0993)",
    "a flood of questions to a camera that is filmed": "after 10 s the film ended (f41d13f4)",
    "a flood of messages of megabytes": "invented names filled queues, which refused newer messages of the rig (06be94aa)",
    "a flood of commands, or one that fails, from an open page": "Ctrl-C did not end it (a941741b)",
    "random commands to the pages of set-up and of postures": "tracebacks of *Save* (a941741b); views that had been "
    "discarded were in the calibration (2669120c)",
    "a web page of another site, also by DNS rebinding, or one without the token": "metrics answered it (aff57a2e)",
    "a camera that answers ONVIF with nonsense": "one that answered in single bytes kept the command for days (63a4a6bf)",
    "a ROS router, or a collector of traces, that hangs": "the end waited for 7 s (96a524fa), or never came (aae21067)",
    "the last memory of a service, or the last open files of a rig": "a viewer hung for ever (d96432fd); a start of one "
    "service that the machine refused ended the rig (649bdc0f)",
    "a revoked certificate under load": "the command got no answer where its router had just closed (39704db5)",
    "damaged files": "tracebacks (23c892ce); C3D files ended the program without a word (56280361)",
    "a wheel with another model for `models add`": "a traceback, where it was damaged (82705e57)",
}


def test_each_row_of_the_table_has_its_tests() -> None:
    page = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    _, table = page.split("\n| attack | without certificates | with certificates |\n|---|---|---|\n")
    rows = re.findall(r"^\| (.*?) \|.*\n", table.partition("\n\n")[0] + "\n", re.MULTILINE)
    assert list(TESTS) == rows
    assert [row for row in rows if row in BEFORE] == list(BEFORE)
    assert [test for tests in TESTS.values() for test in tests if not exists(test)] == []


def test_each_row_is_printed_with_what_became_of_it_and_its_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def main(arguments: list[str], plugins: list[Outcomes]) -> int:
        assert arguments == ["-m", "", "tests/a.py::one", "tests/a.py::two", "tests/b.py"]
        for name, when, outcome in [
            ("a.py::one[0]", "call", "passed"), ("a.py::one[1]", "setup", "skipped"), ("a.py::two_three", "call", "failed"),
            ("b.py::one", "setup", "passed"), ("b.py::one", "call", "failed"), ("b.py::one", "teardown", "passed"),
        ]:  # fmt: skip
            report = SimpleNamespace(nodeid=f"tests/{name}", when=when, outcome=outcome, passed=outcome == "passed")
            report.caplog, report.user_properties = "", [(AFTER, "refused")]
            plugins[0].pytest_runtest_logreport(report)
        return 1

    monkeypatch.setattr(pytest, "main", main)
    assert run({"first": ("a.py::one", "a.py::two"), "second": ("a.py::one", "b.py")}, {"first": "1 GB"}) == 1
    assert capsys.readouterr().out.splitlines()[2:] == [
        "| first | 1 GB | refused | not run, passed, skipped | `python -m pytest -m '' tests/a.py::one tests/a.py::two` |",
        "| second |  | refused | failed, passed, skipped | `python -m pytest -m '' tests/a.py::one tests/b.py` |",
    ]


if __name__ == "__main__":
    sys.exit(run(TESTS, {row: BEFORE.get(row, "as now") for row in TESTS}))
