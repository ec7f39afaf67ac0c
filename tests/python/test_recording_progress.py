"""Progress bars: silent where nobody looks, right when many threads share one."""

import io
import sys
import threading

import pytest

from withe.common.progress import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def without_rich(monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "rich"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rich", None)
    monkeypatch.setitem(sys.modules, "rich.console", None)


@pytest.mark.parametrize("enabled", [True, False])
def test_nothing_is_written_when_stderr_is_not_a_terminal(monkeypatch, enabled):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress(2.0, "run", enabled) as bar:
        bar.update(1.0)
    assert stream.getvalue() == ""


def test_plain_text_counts_to_the_end_of_a_line(monkeypatch, without_rich):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress(2.0, "run") as bar:
        bar.update(1.0)
        assert "50 %" in stream.getvalue()
        bar.update(2.0)
    assert "run" in stream.getvalue()
    assert "100 %" in stream.getvalue()
    assert stream.getvalue().endswith("\n")


def test_plain_text_is_drawn_on_a_terminal_without_rich(monkeypatch, without_rich):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress(2.0, "run") as bar:
        bar.update(1.0)
    assert "1 of 2 s" in stream.getvalue()


def test_rich_draws_on_a_terminal(monkeypatch):
    pytest.importorskip("rich")
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm-256color")
    with progress(2.0, "run") as bar:
        bar.update(2.0)
    assert "run" in stream.getvalue()
    assert "100%" in stream.getvalue()


def test_tasks_of_many_threads_add_up_in_one_bar():
    with progress(8.0, "runs", enabled=False) as bar:

        def work():
            task = bar.task(1.0)
            for step in range(1, 101):
                task.update(step / 100)

        threads = [threading.Thread(target=work) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert bar.completed == pytest.approx(8.0, abs=1e-9)


def test_a_task_that_ends_early_counts_as_its_whole_share():
    with progress(2.0, enabled=False) as bar:
        task = bar.task(1.0)
        task.update(0.25)
        assert bar.completed == 0.25
        task.finish()
        assert bar.completed == 1.0


def test_a_bar_inside_a_bar_is_silent(monkeypatch, without_rich):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress(1.0, "outer"), progress(1.0, "inner") as bar:
        bar.update(1.0)
    assert "inner" not in stream.getvalue()
    with progress(1.0, "after"):
        pass
    assert "after" in stream.getvalue()


def test_an_exception_closes_the_bar(monkeypatch, without_rich):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)

    def interrupted():
        with progress(1.0, "run") as bar:
            bar.update(0.3)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert stream.getvalue().endswith("\n")
    assert "100 %" not in stream.getvalue()


@pytest.mark.parametrize("enabled", ["yes", None, 2])
def test_other_switches_are_refused(enabled):
    with (
        pytest.raises(ValueError, match="progress must be True or False"),
        progress(1.0, "", enabled),
    ):
        pass


def test_a_negative_total_is_refused():
    with pytest.raises(ValueError, match="total"), progress(-1.0):
        pass
