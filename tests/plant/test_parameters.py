"""The parameter table is the report's, and values outside it do not get in."""

import numpy as np
import pytest

from epv_env.plant.parameters import ParameterError, Parameters, table

TABLE_5 = {"kappa": 1.4, "mu0": 4e-7 * np.pi, "R_gas": 287.14}
TABLE_6 = {
    "cMV": (1500, 1000, 2000), "cPV": (10000, 8000, 15000), "d1": (0.018, 0.01, 0.02),
    "d2": (0.01, 0.008, 0.015), "dMB": (0.01, 0.006, 0.015), "dMVin": (0.0007, 0.0005, 0.001),
    "dMVexh": (0.0006, 0.0005, 0.001), "mMV": (0.002, 0.001, 0.003), "mPV": (0.02, 0.01, 0.03),
    "N": (1500, 1000, 2000), "R": (42, 35, 50), "V2": (0.001, 0.0001, 0.002),
    "V3": (0.000005, 0.000001, 0.00002), "xMV0": (0.002, 0.001, 0.0035),
    "xMVmax": (0.0005, 0.0003, 0.001), "xPV0": (0.009, 0.007, 0.015), "xPVmax": (0.002, 0.001, 0.004),
}  # fmt: skip
TABLE_7 = {
    "a1": (0, -0.1, 0.1), "a2": (0.0002, 0, 0.0004), "alphaMV": (0.7, 0.5, 1),
    "alphaPV": (0.27, 0.2, 1), "kMV": (2, 0, 10), "kPV": (10, 0, 100), "RML": (1.7e7, 1e7, 1e8),
}  # fmt: skip
TABLE_12 = {"alphaMV": 0.683461, "alphaPV": 0.296642, "RML": 1.842911e7, "R": 42.15999}


@pytest.mark.parametrize("symbol", TABLE_5)
def test_known_values_are_table_5_s_with_mu0_corrected(symbol):
    row = table()[symbol]
    assert (row.value, row.domain, row.group) == (pytest.approx(TABLE_5[symbol]), None, "known")


@pytest.mark.parametrize(
    ("rows", "group"), [(TABLE_6, "partially known"), (TABLE_7, "unknown")], ids=["6", "7"]
)
def test_values_and_domains_are_those_of_tables_6_and_7(rows, group):
    found = {
        symbol: (row.value, *row.domain)
        for symbol, row in table().items()
        if row.group == group and row.domain
    }
    assert found == rows


def test_every_row_is_complete():
    for symbol, row in table().items():
        assert row.symbol == symbol
        assert row.unit
        assert row.source
        assert row.meaning
        assert row.domain is None or row.domain[0] <= row.value <= row.domain[1]


def test_calibrated_values_are_table_12_s_without_the_cone_model():
    calibrated, nominal = Parameters.calibrated(), Parameters.nominal()
    assert {symbol: calibrated[symbol] for symbol in TABLE_12} == TABLE_12
    assert (calibrated["a1"], calibrated["a2"]) == (0.0, 0.0)
    changed = {symbol for symbol in nominal if calibrated[symbol] != nominal[symbol]}
    assert changed == {*TABLE_12, "a2"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"alphaXX": 0.5}, "unknown parameter 'alphaXX'.*alphaMV"),
        ({"alphaMV": 1.2}, r"alphaMV = 1.2 1 is outside its domain \[0.5, 1\] \(Table 7\).*inside"),
        ({"alphaMV": np.nan}, "alphaMV = nan .*outside"),
        ({"kappa": 1.3}, "kappa = 1.3 .*leave this constant out"),
        ({"R": "42"}, "R is '42': give one number"),
        ({"R": None}, "R is None: give one number"),
        ({"R": True}, "R is True: give one number"),
        ({"R": np.array([41.0, 42.0])}, "R is array.*give one number"),
    ],
    ids=lambda value: None if isinstance(value, str) else str(value),
)
def test_bad_values_are_refused_with_a_remedy(changes, message):
    with pytest.raises(ParameterError, match=message):
        Parameters.calibrated().replace(**changes)


def test_parameters_cannot_be_changed():
    p = Parameters.calibrated()
    with pytest.raises(TypeError):
        p["R"] = 40.0  # type: ignore[index]
    with pytest.raises(TypeError):
        table()["R"] = table()["V2"]  # type: ignore[index]
    p.replace(R=40.0)
    assert p["R"] == TABLE_12["R"]
