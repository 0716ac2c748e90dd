"""Error codes in the place of a distance."""

import numpy as np

from florence_bt.drivers.hokuyo.geometry import (
    BEYOND,
    URG_04LX,
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
    def told(*distances_mm: int) -> str:
        return summarise(np.array(distances_mm, np.int32), URG_04LX, URG_ERRORS)

    assert told(100, 5600) == "0 of 2"
    assert told(0, 6, 6, 200) == "3 of 4, mostly: other error"
    assert told(4, 200) == "1 of 2, mostly: code 4"
    assert told(5601, 65533, 6, 200) == f"3 of 4, mostly: {BEYOND}"
