"""The folder of a comparison: all files or none, and nothing left of a failure."""

from pathlib import Path

import pytest

from espalier.outputs import FILES, OutputError, OutputFolder


def writing(text: str) -> object:
    return lambda path: path.write_text(text)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_all_files_arrive_in_a_folder_that_is_made(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    with OutputFolder(folder) as outputs:
        outputs.publish({name: writing(name) for name in FILES})
    assert names(folder) == set(FILES)
    assert (folder / "report.json").read_text() == "report.json"


def test_files_of_an_earlier_comparison_do_not_stay_beside_new_ones(tmp_path: Path) -> None:
    for name in FILES:
        (tmp_path / name).write_text("old")
    (tmp_path / "mine.txt").write_text("kept")
    with OutputFolder(tmp_path) as outputs:
        outputs.publish({"espalier.png": writing("new"), "report.json": writing("new")})
    assert names(tmp_path) == {"espalier.png", "report.json", "mine.txt"}
    assert (tmp_path / "espalier.png").read_text() == "new"


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_error_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    def fail(path: Path) -> None:
        path.write_text("half")
        raise error

    folder = tmp_path / "a" / "b"
    with pytest.raises(error), OutputFolder(folder) as outputs:
        outputs.publish({"espalier.png": writing("whole"), "report.json": fail})
    assert names(tmp_path) == set()


def test_an_error_leaves_an_earlier_comparison_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text("old")
    with pytest.raises(RuntimeError), OutputFolder(tmp_path):
        raise RuntimeError
    assert names(tmp_path) == {"report.json"}


def test_a_folder_that_cannot_be_is_named_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(OutputError, match=r"Cannot write to .*file.*choose another folder"),
        OutputFolder(tmp_path / "file" / "below"),
    ):
        raise AssertionError("the work began")
    assert names(tmp_path) == {"file"}
