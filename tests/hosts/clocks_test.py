#!/usr/bin/env python3
"""Wall clocks of two hosts that differ, by seconds and by decades: the link couples, the percept is felt, stops are reset, and the difference is told.

clocks_test.py --bin DIR --clock clock_step.so
"""
import time

from hosts import eventually, given_paths, need_rights, telling_logs
from two_sides import LIMIT_S, TwoSides

OFFSETS_S = (5.0, -5.0)
YEAR_S = 365.25 * 86400


def until(year):
    """Seconds from now to the middle of that year."""
    return (year - 1970 + 0.5) * YEAR_S - time.time()


def told(sides, offset_s):
    """Each side reports how far its clock is ahead of the other's."""
    for component, figure, expected in (("slave_io", "clock_ahead_of_master_io", offset_s), ("master_io", "clock_ahead_of_slave_io", -offset_s),
                                        ("phantom_sensing", "clock_ahead_of_slave_io", -offset_s)):
        def right(component=component, figure=figure, expected=expected):
            value = sides.figure(component, figure)
            return value is not None and abs(value - expected) < 0.4
        eventually(right, LIMIT_S, f"{component} reports {figure} {expected:.0f} s")
        message = sides.newest(component)["message"]
        assert "clocks differ by" in message, (component, message)


def main():
    given = given_paths("bin", "clock")
    need_rights()
    sides = TwoSides(given.bin, clock=given.clock)
    try:
        with telling_logs(sides.folder, 20):
            sides.set_clock("slave", OFFSETS_S[0])  # wrong from the start
            sides.start()
            for offset_s in (*OFFSETS_S, until(2040), until(2047), until(2110), -until(2040)):
                sides.set_clock("slave", offset_s)
                sides.coupled()
                told(sides, offset_s)
                sides.percept_is_felt()
                sides.a_stop_can_be_reset()
                print(f"the slave's host is {offset_s:+.0f} s off: coupled, felt, reset, told")
            assert "clocks differ by 5.0 s: this host's is ahead of that of master_io's host" in sides.log("slave_io"), "no warning in the log"
            sides.set_clock("slave", 0.0)
            eventually(lambda: "clocks differ" not in sides.newest("slave_io").get("message", "clocks differ"), LIMIT_S, "the message ends with its cause")
            sides.coupled()
    finally:
        sides.close()


if __name__ == "__main__":
    main()
