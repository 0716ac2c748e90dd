"""Error codes in the place of a distance."""

import numpy as np

from florence_bt.drivers.hokuyo.geometry import (
    URG_ERRORS,
    UTM_ERRORS,
    range_errors,
    summarise,
    without_codes,
)


def test_the_model_decides() -> None:
    assert range_errors("URG-04LX(Hokuyo)", 5600) is URG_ERRORS
    assert range_errors("UTM-30LX", 60000) is UTM_ERRORS
    assert range_errors("UST-20LX", 60000) is UTM_ERRORS


def test_codes_become_no_numbers() -> None:
    urg = without_codes(np.array([0, 1, 2, 19, 20, 1500], np.int32), 20, URG_ERRORS)
    np.testing.assert_allclose(urg, [np.nan, np.nan, np.nan, np.nan, 0.02, 1.5])
    utm = without_codes(np.array([1, 2, 3, 5, 23], np.int32), 23, UTM_ERRORS)
    np.testing.assert_allclose(utm, [np.inf, -np.inf, np.nan, np.nan, 0.023])
    assert utm.dtype == np.float32


def test_the_most_frequent_reason_is_told() -> None:
    assert summarise(np.array([100, 200], np.int32), 20, URG_ERRORS) == "0 of 2"
    assert summarise(np.array([0, 6, 6, 200], np.int32), 20, URG_ERRORS) == "3 of 4, mostly: other error"
    assert summarise(np.array([4, 200], np.int32), 20, URG_ERRORS) == "1 of 2, mostly: code 4"
