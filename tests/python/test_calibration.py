"""The constants of the cost model: measured once, kept, and measured anew for another machine."""

import json

import espalier_rt as rt
import pytest

from espalier import calibration


@pytest.fixture
def cache_file(tmp_path, monkeypatch):
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    calibration.cost_constants.cache_clear()
    yield calibration.cache_file()
    calibration.cost_constants.cache_clear()


def test_calibration_measures_every_cost_of_the_model():
    costs = rt.calibrate()
    assert set(costs) == {name for name in rt.default_config("hybrid") if name.endswith("_ns")}
    assert all(0.0 < value < 1e5 for value in costs.values())


def test_a_measurement_is_kept_for_later_sessions(cache_file):
    measured = calibration.cost_constants()
    calibration.cost_constants.cache_clear()
    assert calibration.cost_constants() == measured
    assert json.loads(cache_file.read_text())["costs"] == measured


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"machine": ["another"], "costs": {"node_ns": 1.0}}'])
def test_a_broken_or_foreign_file_is_replaced(cache_file, content):
    cache_file.parent.mkdir(parents=True)
    cache_file.write_text(content)
    assert json.loads(cache_file.read_text() or "null") != calibration.cost_constants()
    assert json.loads(cache_file.read_text())["costs"] == calibration.cost_constants()


def test_a_folder_that_cannot_be_written_costs_nothing_but_the_memory(cache_file):
    cache_file.parent.parent.joinpath("espalier").write_text("a file where the folder should be")
    assert calibration.cost_constants() == calibration.cost_constants()
