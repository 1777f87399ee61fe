"""Films of pushes: a GIF that is small enough, an MP4 where ffmpeg is, and its name where it is not."""

import json
import shutil
import subprocess

import pytest
from PIL import Image

from tools.cli import main
from tools.report.film import gif


@pytest.mark.long
def test_a_gif_shows_the_push_four_times_as_fast(runs, tmp_path):
    assert main(["report", str(runs / "one"), str(runs / "open"), "--gif", "--out", str(tmp_path)]) == 0
    film = tmp_path / "film.gif"
    assert film.stat().st_size < 10_000_000
    with Image.open(film) as image:
        shown_s = 0.0
        for frame in range(image.n_frames):
            image.seek(frame)
            shown_s += image.info["duration"] / 1000.0
    summary = json.loads((runs / "one" / "summary.json").read_text())
    first_contact_s = 2.5  # settle, tare and approach of these runs take between 2 and 5 s
    run_s = summary["loop"]["ticks"] / 100.0 - first_contact_s
    assert shown_s == pytest.approx((run_s + 1.0) / 4.0 + 2.0, abs=0.7)  # the last frame stays for 2 s


@pytest.mark.long
def test_a_gif_that_is_too_large_shows_fewer_frames(runs, tmp_path, monkeypatch):
    main(["report", str(runs / "one"), "--gif", "--out", str(tmp_path / "all")])
    size = (tmp_path / "all" / "film.gif").stat().st_size
    monkeypatch.setattr(gif, "MOST_BYTES", size * 3 // 4)
    main(["report", str(runs / "one"), "--gif", "--out", str(tmp_path / "few")])
    assert (tmp_path / "few" / "film.gif").stat().st_size <= size * 3 // 4
    with Image.open(tmp_path / "all" / "film.gif") as all_, Image.open(tmp_path / "few" / "film.gif") as few:
        assert few.n_frames < all_.n_frames
        assert few.info["duration"] > all_.info["duration"]  # of the first frame


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg, which is not installed")
def test_an_mp4_is_one_that_others_read(runs, tmp_path):
    assert main(["report", str(runs / "one"), "--mp4", "--out", str(tmp_path)]) == 0
    film = tmp_path / "film.mp4"
    found = subprocess.run(
        ["ffprobe", "-v", "error", "-show_entries", "stream=codec_name,pix_fmt", "-of", "csv=p=0", film],
        capture_output=True, text=True, check=True, timeout=30,
    )  # fmt: skip
    assert found.stdout.strip() == "h264,yuv420p"
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_without_ffmpeg_it_is_named_before_anything_is_written(runs, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    assert main(["report", str(runs / "one"), "--mp4", "--out", str(tmp_path / "out"), "--json"]) == 3
    error = json.loads(capsys.readouterr().out)["error"]
    assert "ffmpeg" in error["what"]
    assert not (tmp_path / "out").exists()


def test_a_film_of_somebody_else_is_kept(runs, tmp_path, capsys):
    (tmp_path / "film.gif").write_text("mine")
    assert main(["report", str(runs / "one"), "--gif", "--out", str(tmp_path), "--json"]) == 2
    assert (tmp_path / "film.gif").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["film.gif"]
