"""One bar of all work, from the records of a command."""

import tqdm.auto

import pytest
from test_commands import EXAMPLES, pytestmark  # noqa: F401

import starlings
from starlings.progress import Progress


class Bar(tqdm.auto.tqdm):
    """A bar that remembers how it looked."""

    made = []

    def __init__(self, *args, **more):
        Bar.made.append([])
        super().__init__(*args, **more)

    def refresh(self, *args, **more):
        Bar.made[-1].append((self.n, self.desc, self.postfix))
        return super().refresh(*args, **more)


@pytest.fixture
def bars(monkeypatch):
    """What every bar showed: percent, what is being done, the rest."""
    monkeypatch.setattr(Bar, "made", [])
    monkeypatch.setattr(tqdm.auto, "tqdm", Bar)
    return Bar.made


def shown(records):
    progress = Progress("run", True)
    for record in records:
        progress.show({"event": "progress", **record})
    progress.close()


def test_a_run_is_one_bar_that_only_grows(bars, tmp_path):
    starlings.run(EXAMPLES / "oscillator" / "study.toml", out=tmp_path / "out", workers=1, progress=True)
    (looks,) = bars
    percents = [percent for percent, _, _ in looks if percent is not None]
    assert percents == sorted(percents) and 0.0 < percents[-1] <= 100.0
    # Where the bar is made tqdm ends what it says with a colon of its own.
    said = [words for _, words, _ in looks[1:]]
    assert said[0] == "run: pass 1, 0 of 401 analyses"
    assert any(words.startswith("run: after the fit, ") for words in said)
    assert not any("observer" in words or ": :" in words or "0 runs" in words for words in said)
    assert any("left" in (rest or "") for _, _, rest in looks)


def test_what_the_fleet_says_of_an_analysis_is_no_progress_of_the_command(bars):
    shown([{"message": "1 of 4 runs", "run": "oscillator"}, {"message": "2 of 4 runs", "run": "oscillator"}])
    assert bars == []


def test_a_share_never_falls_and_the_time_left_stands_beside_it(bars):
    step = {"stage": "filter", "pass": 2, "passes": 3, "step": 5, "steps": 9, "workers": 2}
    shown(
        [
            {"stage": "screen", "runs": 0, "workers": 0},
            {**step, "share": 0.5, "left_s": 95.0},
            {**step, "share": 0.45},
            {**step, "share": 0.6, "left_s": 59.6},
            {**step, "share": 0.61, "left_s": 7200.0},
        ]
    )
    (looks,) = bars
    assert list(dict.fromkeys(looks[1:])) == [
        (0, "run: screen", ""),
        (50.0, "run: pass 2/3, 5 of 9 analyses", "2 workers, about 2 min left"),
        (50.0, "run: pass 2/3, 5 of 9 analyses", "2 workers"),
        (60.0, "run: pass 2/3, 5 of 9 analyses", "2 workers, about 60 s left"),
        (61.0, "run: pass 2/3, 5 of 9 analyses", "2 workers, about 2 h left"),
    ]
