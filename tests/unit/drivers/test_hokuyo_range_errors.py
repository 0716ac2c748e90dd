"""Error codes in the place of a distance."""

import numpy as np

from florence_bt.drivers.hokuyo.geometry import (
    URG_ERRORS,
    UTM_ERRORS,
    range_errors,
    summarise,
)


def test_the_model_decides() -> None:
    assert range_errors("URG-04LX(Hokuyo)", 5600) is URG_ERRORS
    assert range_errors("UTM-30LX", 60000) is UTM_ERRORS
    assert range_errors("UST-20LX", 60000) is UTM_ERRORS


def test_the_most_frequent_reason_is_told() -> None:
    assert summarise(np.array([100, 200], np.int32), 20, URG_ERRORS) == "0 of 2"
    assert summarise(np.array([0, 6, 6, 200], np.int32), 20, URG_ERRORS) == "3 of 4, mostly: other error"
    assert summarise(np.array([4, 200], np.int32), 20, URG_ERRORS) == "1 of 2, mostly: code 4"
