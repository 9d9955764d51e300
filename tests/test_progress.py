"""Long jobs report, return and stop."""

import pytest

from napari_crfdeblur.progress import Progress, drain, nth, reporting


def counting(total, log):
    try:
        for done in range(total):
            yield Progress("count", done, total)
        return "result"
    finally:
        log.append("closed")


def test_draining_returns_the_result_and_reports_every_step():
    reports, log = [], []
    assert drain(counting(3, log), reports.append) == "result"
    assert reports == [Progress("count", done, 3) for done in range(3)]
    assert log == ["closed"]


def test_no_report_is_needed():
    assert drain(counting(2, [])) == "result"


def test_an_exception_of_the_report_stops_the_job():
    log = []

    def stop(progress):
        if progress.done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drain(counting(100, log), stop)
    assert log == ["closed"]


def test_closing_a_job_runs_its_clean_up():
    log = []
    job = counting(100, log)
    next(job)
    job.close()
    assert log == ["closed"]


def test_an_exception_of_the_job_reaches_the_caller():
    def failing():
        yield Progress("fail", 0, 1)
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        drain(failing())


def test_jobs_within_jobs_pass_their_reports_on():
    def outer():
        first = yield from counting(2, [])
        second = yield from counting(1, [])
        return first + second

    reports = []
    assert drain(outer(), reports.append) == "resultresult"
    assert [r.done for r in reports] == [0, 1, 0]


def test_parts_of_a_job_report_their_share_of_the_whole():
    def both():
        first = yield from nth(counting(2, []), 0, 2, "page")
        second = yield from nth(counting(2, []), 1, 2, "page")
        return [first, second]

    reports = []
    assert drain(both(), reports.append) == ["result", "result"]
    assert reports[-1] == Progress("count, page 2 of 2", 3, 4)
    assert [r.done for r in reports] == [0, 1, 2, 3]


def test_a_single_part_reports_as_it_is():
    reports = []
    drain(nth(counting(2, []), 0, 1, "page"), reports.append)
    assert reports == [Progress("count", 0, 2), Progress("count", 1, 2)]


def test_closing_a_part_closes_the_job():
    log = []
    job = nth(counting(9, log), 1, 3, "page")
    next(job)
    job.close()
    assert log == ["closed"]


def test_a_part_reports_where_the_whole_is_and_ends_with_it():
    closed = []

    def part():
        try:
            yield Progress("part", 0, 2)
            yield Progress("part", 1, 2)
            return "result"
        finally:
            closed.append(True)

    whole = Progress("whole", 3, 7)
    reports = []
    assert drain(reporting(part(), whole), reports.append) == "result"
    assert reports == [whole] * 2
    stopped = reporting(part(), whole)
    next(stopped)
    stopped.close()
    assert closed == [True, True]
