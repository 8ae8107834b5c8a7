"""The parts of the summary: read back as written, refused where they are not what the program writes."""

from __future__ import annotations

import json
import math

import pytest

from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.quantities import QUANTITIES
from fragfield.results.burst import Burst
from fragfield.results.hazard import Hazard
from fragfield.results.part import to_json
from fragfield.results.summary import Summary, schema
from tests.fragfield.example_results import complete, example


def test_a_written_summary_is_read_back_equal(whole_run):
    directory = RunDirectory(whole_run[0])
    results = directory.results()
    written = json.loads((whole_run[0] / "summary.json").read_text())
    assert results.hazard.recommended == written["hazard"]["recommended"]
    assert results.burst.speed_quantiles.speed_99 == written["burst"]["speed_quantiles"]["99"]
    assert to_json(results) == {key: one for key, one in written.items() if key != "checksum"}
    assert Summary.read(to_json(results)) == results


def test_a_missing_key_is_refused_with_the_stage_to_run_again_and_an_unknown_one_left_out(tmp_path):
    directory = RunDirectory(tmp_path)
    assert directory.results() == Summary()
    burst = complete(Burst, {"cells": 8})
    del burst["steps"]
    directory.write_summary({"title": "x", "burst": burst})
    with pytest.raises(InputError, match=r"summary.json: another version .* \(burst.steps: .*run `fragfield burst`"):
        directory.results()
    directory.write_summary({"hazard": {**complete(Hazard, {}), "upper_bound": 3.0}})
    assert directory.results().hazard == example(Hazard)


def test_what_was_never_reached_is_none():
    assert example(Hazard, recommended=math.nan, upper=math.inf).recommended is None


def test_the_schema_names_every_value_of_the_catalogue():
    keys = json.dumps(schema())
    assert all(f'"{path.rpartition(".")[2].removesuffix("[]")}"' in keys for path in QUANTITIES)
